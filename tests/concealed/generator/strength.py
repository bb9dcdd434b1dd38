"""How strongly an effect shows beside everything that the nominal model can imitate: s = ‖M x‖ / σ.

x is the torque that the true arm needed beyond rigid bodies (MuJoCo's inverse dynamics) and static friction, along its
own noise-free motion; M projects off base parameters, friction, offset and the constants of the friction's curve. s is
the effect's true coefficient over its Cramér–Rao standard deviation.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import signal

from concealed.generator.forward import FINE, Entry, Passage, physical, sensory
from concealed.generator.laws import law_torque
from concealed.generator.motions import RATE_HZ
from concealed.generator.sensing import sensed
from tauscope.dynamics import base_parameters, smooth_sign, smooth_sign_slope, torque_regressor
from tauscope.robot import Robot
from tauscope_sim.friction import static_friction_torque
from tauscope_sim.inverse_dynamics import rigid_body_torque
from tauscope_sim.model import build_model

Array = NDArray[np.float64]

BAND_HZ = 20.0
EDGE_S = 0.3


def strength(
    robot: Robot, entries: Sequence[Entry], passages: Sequence[Passage], torque_std: ArrayLike
) -> tuple[float, Array]:
    """s, and the same by joint, (n,): the effects of some entries in the passages that they made."""
    return _shown([_rows(robot, entries, passage) for passage in passages], torque_std)


def foreseen_strength(robot: Robot, entry: Entry, passages: Sequence[Passage], torque_std: ArrayLike) -> float | None:
    """The s that an effect would have along passages without it; None where that takes a simulation."""
    if sensory([entry]):
        return strength(robot, [entry], passages, torque_std)[0]
    (effect,) = physical([entry])
    parts = []
    for passage in passages:
        torque = law_torque(robot, effect, passage)
        if torque is None:
            return None
        columns, missing = _rows(robot, [], passage)
        edge = round(EDGE_S * RATE_HZ)
        parts.append((columns, missing + _banded(torque, FINE * RATE_HZ)[::FINE][edge:-edge].T))
    return _shown(parts, torque_std)[0]


def _shown(parts: Sequence[tuple[Array, Array]], torque_std: ArrayLike) -> tuple[float, Array]:
    """Norm of what the nominal columns leave, whole and by joint."""
    columns = np.concatenate([part[0] for part in parts], axis=1)  # (n, N, p)
    missing = np.concatenate([part[1] for part in parts], axis=1)  # (n, N)
    scale = 1.0 / np.asarray(torque_std)
    whole = (columns * scale[:, None, None]).reshape(-1, columns.shape[2])
    target = (missing * scale[:, None]).ravel()
    size = np.linalg.norm(whole, axis=0)
    left, singular, _ = np.linalg.svd(whole / np.where(size > 0.0, size, 1.0), full_matrices=False)
    basis = left[:, singular > 1e-9 * singular[0]]
    shown = (target - basis @ (basis.T @ target)).reshape(len(scale), -1)
    by_joint = np.sqrt(np.sum(shown**2, axis=1))
    return float(np.linalg.norm(by_joint)), by_joint


def _rows(robot: Robot, entries: Sequence[Entry], passage: Passage) -> tuple[Array, Array]:
    """Nominal columns (n, N, p) and missing torque (n, N), in the band and at the recorded rate."""
    rate = FINE * RATE_HZ
    position, velocity = passage.position, passage.velocity
    acceleration = np.gradient(velocity, 1.0 / rate, axis=0)
    _, recorded = sensed(entries, *passage.recorded)
    nominal = rigid_body_torque(build_model(robot), position, velocity, acceleration)
    if robot.model.friction is not None:
        nominal += static_friction_torque(velocity, robot.model.friction, [j.friction_shape for j in robot.joints])
    # The sensors' effects exist at the recorded rate only: what they change is added to the true torque there.
    changed = recorded - passage.recorded[1]
    missing = _banded(passage.torque - nominal, rate)[::FINE] + _banded(changed, RATE_HZ)
    base = base_parameters(robot)
    regressor = torque_regressor(robot, position, velocity, acceleration, columns=np.asarray(base.independent_columns))
    count, n = regressor.shape[0], robot.joint_count
    own = np.zeros((count, n, n * 6))
    for joint in range(n):
        v, shape = velocity[:, joint], robot.joints[joint].friction_shape
        k_v, delta = shape.k_v or 500.0, shape.delta or 10.0
        own[:, joint, 6 * joint : 6 * joint + 6] = np.stack(
            [smooth_sign(v, k_v), smooth_sign(v, delta), v, np.ones(count)]
            + [constant * smooth_sign_slope(v, constant) for constant in (k_v, delta)],
            axis=1,
        )
    columns = _banded(np.concatenate([regressor, own], axis=2), rate)[::FINE]
    edge = round(EDGE_S * RATE_HZ)
    return columns[edge:-edge].transpose(1, 0, 2), missing[edge:-edge].T


def _banded(values: Array, rate_hz: float) -> Array:
    """What lies within the band."""
    band = signal.butter(4, BAND_HZ, fs=rate_hz, output="sos")
    return np.asarray(signal.sosfiltfilt(band, values, axis=0), dtype=np.float64)
