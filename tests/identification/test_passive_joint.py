"""A joint without a motor: its torque is zero throughout, and its equations still tell of its link."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from tauscope.identification import document, identify
from tauscope.recording import Recording
from tauscope.robot import read_robot

Array = NDArray[np.float64]

LENGTH, CENTRE, GRAVITY = 0.3, 0.15, 9.81
MASS, INERTIA, VISCOUS = (1.0, 0.6), (0.01, 0.006), (0.1, 0.02)
NOISE, POSITION_NOISE = 0.02, 1e-4

ARM = """
name: pendulum
gravity: [0, -9.81, 0]
kinematics:
  dh:
    - {a: 0.3, alpha: 0, d: 0, theta: 0}
    - {a: 0.3, alpha: 0, d: 0, theta: 0}
joints:
  - {name: shoulder, limits: {position: [-90, 90], velocity: 90, acceleration: 900, torque: 20}}
  - {name: elbow, limits: {position: [-90, 90], velocity: 90, acceleration: 900, torque: 20}}
"""


def rates(state: Array, torque: Array) -> Array:
    """The double pendulum in closed form."""
    q, v = state[:2], state[2:]
    coupling = MASS[1] * LENGTH * CENTRE
    far = INERTIA[1] + MASS[1] * CENTRE**2
    mixed = far + coupling * np.cos(q[1])
    near = INERTIA[0] + MASS[0] * CENTRE**2 + MASS[1] * LENGTH**2 + 2.0 * mixed - far
    whirl = coupling * np.sin(q[1])
    turned = GRAVITY * MASS[1] * CENTRE * np.cos(q.sum())
    weight = np.array([GRAVITY * (MASS[0] * CENTRE + MASS[1] * LENGTH) * np.cos(q[0]) + turned, turned])
    spin = np.array([-whirl * (2.0 * v[0] * v[1] + v[1] ** 2), whirl * v[0] ** 2])
    inner = torque - spin - weight - np.array(VISCOUS) * v
    return np.asarray(np.append(v, np.linalg.solve([[near, mixed], [mixed, far]], inner)), dtype=np.float64)


def swing(driven: int, phase: float) -> Recording:
    """One joint follows waves under a spring and a damper, the other swings."""

    def torque(t: float, state: Array) -> Array:
        wanted = 0.8 * np.sin(1.7 * t + phase) + 0.4 * np.sin(4.1 * t + 2.0 * phase) - (1.2 if driven == 0 else 0.0)
        found = np.zeros(2)
        found[driven] = 20.0 * (wanted - state[driven]) - 1.0 * state[2 + driven]
        return found

    time = np.arange(0.0, 12.0, 0.01)
    solved: Any = solve_ivp(
        lambda t, x: rates(x, torque(t, x)), (0.0, 12.0), [-1.5, 0.2, 0.0, 0.0], t_eval=time, method="LSODA", rtol=1e-7
    )
    rng = np.random.default_rng([driven, int(10 * phase)])
    measured = np.array([torque(t, x) for t, x in zip(time, solved.y.T, strict=True)])
    measured[:, driven] += NOISE * rng.standard_normal(len(time))
    position = solved.y[:2].T + POSITION_NOISE * rng.standard_normal((len(time), 2))
    return Recording.from_arrays(f"swing-{phase}", time, position, measured)


@pytest.mark.parametrize("driven", [0, 1])
def test_what_hangs_on_a_passive_joint_is_found(driven: int, tmp_path: Path) -> None:
    """Weighted by what its torque leaves, nothing at all, it would be a link of nothing, and the arm with it."""
    (tmp_path / "arm.yaml").write_text(ARM)
    found = identify(read_robot(tmp_path / "arm.yaml"), [swing(driven, 0.0)], [swing(driven, 1.3)])
    values = dict(zip(found.structure.names, found.parameters, strict=True))
    assert found.held_out is not None
    assert found.held_out.relative_error < 0.05
    assert values["m2 + 3.33333*msx2"] == pytest.approx(MASS[1] * CENTRE / LENGTH, rel=0.05)
    about_tip = INERTIA[1] + MASS[1] * (LENGTH - CENTRE) * (LENGTH - CENTRE - LENGTH)
    assert values["Izz2 + 0.3*msx2"] == pytest.approx(about_tip, rel=0.05)
    assert values["viscous elbow"] == pytest.approx(VISCOUS[1], rel=0.2)
    assert not found.reversed_joints
    silent = [each.joint for each in document(found).warnings if each.code == "no-torque"]
    assert silent == [("elbow", "shoulder")[driven]]
