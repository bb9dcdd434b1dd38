"""How strongly an effect shows beside everything that the nominal model can imitate: s = ‖W M x‖.

x is the torque that the true arm needs beyond rigid bodies and static friction along its own noise-free motion; M
projects off base parameters, friction, a constant torque and the constants of the friction's curve; W whitens the noise
of the torque. s is the effect's true coefficient over its Cramér–Rao standard deviation. Where friction holds a joint,
it may take any value: those rows say nothing.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import ndimage, signal

from concealed.generator.arms import BREAKAWAY_SLOPE, arm_named, noise_std
from concealed.generator.forward import Entry, Passage, passage, physical, sensory
from concealed.generator.laws import law_torque
from concealed.generator.motions import campaign
from concealed.generator.rates import FINE, RATE_HZ
from concealed.generator.sensing import sensed
from tauscope.dynamics import base_parameters, smooth_sign, smooth_sign_slope, torque_regressor
from tauscope.robot import Robot
from tauscope_sim.friction import static_friction_torque
from tauscope_sim.model import build_model
from tauscope_sim.recording import rigid_body_torque

Array = NDArray[np.float64]

BAND_HZ = 20.0
EDGE_S = 0.3

NYQUIST_SHARE = 0.8
"""Of half the recorded rate, up to which a recording can show anything."""

REST_SPEED = 1e-3
"""Speed below which dry friction holds a joint [rad/s or m/s]."""

REST_SPREAD_S = 0.05
"""By so much the band's filter carries rest into what is before and after it [s]."""


@dataclass(frozen=True)
class Reference:
    """On which training motions, and through which sensors, a strength is stated.

    kind : str
        of the motions
    every : int
        the logger keeps every so many samples
    correlation : float
        of the torque's noise, from one recorded sample to the next
    """

    kind: str = "rich"
    every: int = 1
    correlation: float = 0.0


class Sight:
    """What some passages can show of an effect.

    Parameters
    ----------
    passages : sequence of Passage
        under nothing, or under what is looked at
    torque_std : (n,) float64
        of a recorded sample [Nm or N]
    """

    def __init__(
        self, robot: Robot, passages: Sequence[Passage], torque_std: ArrayLike, reference: Reference | None = None
    ) -> None:
        self.robot, self.passages = robot, list(passages)
        self._reference = reference or Reference()
        self._scale = 1.0 / np.asarray(torque_std, dtype=np.float64)
        self._moving = [self._moves(each.velocity) for each in self.passages]
        columns = np.concatenate(
            [
                self._weigh(self._sample(_nominal_columns(robot, each), FINE * RATE_HZ), moving)
                for each, moving in zip(self.passages, self._moving, strict=True)
            ]
        )
        whole = columns.reshape(-1, columns.shape[2])
        size = np.linalg.norm(whole, axis=0)
        left, singular, _ = np.linalg.svd(whole / np.where(size > 0.0, size, 1.0), full_matrices=False)
        self._basis = left[:, singular > 1e-9 * singular[0]]

    def strength(self, torques: Sequence[Array], rate_hz: float = FINE * RATE_HZ) -> tuple[float, Array]:
        """s, and the same by joint (n,), of torque (N, n) along each passage at some rate."""
        parts = [
            self._weigh(self._sample(each, rate_hz), moving) for each, moving in zip(torques, self._moving, strict=True)
        ]
        target = np.concatenate(parts).ravel()
        shown = (target - self._basis @ (self._basis.T @ target)).reshape(-1, self.robot.joint_count)
        by_joint = np.sqrt(np.sum(shown**2, axis=0))
        return float(np.linalg.norm(by_joint)), by_joint

    def foreseen(self, entry: Entry) -> float:
        """The s that an effect would have along passages without it.

        Raises
        ------
        ValueError
            where the torque of the effect takes a simulation
        """
        if sensory([entry]):
            return self.strength([_changed([entry], each) for each in self.passages], RATE_HZ)[0]
        return self.strength(self._torques(entry))[0]

    def is_plausible(self, entry: Entry) -> bool:
        """Whether an effect takes no more torque than all else does, at every joint."""
        if sensory([entry]):
            return True
        largest = np.max([np.abs(each.torque).max(axis=0) for each in self.passages], axis=0)
        return all(bool(np.all(np.abs(each).max(axis=0) <= largest)) for each in self._torques(entry))

    def _torques(self, entry: Entry) -> list[Array]:
        """Torque (N, n) of a physical effect along each passage."""
        (effect,) = physical([entry])
        torques = [law_torque(self.robot, effect, each) for each in self.passages]
        known = [each for each in torques if each is not None]
        if len(known) < len(torques):
            raise ValueError(f"{entry['effect']}: its torque is no law of the motion; give it one")
        return known

    def _sample(self, values: Array, rate_hz: float) -> Array:
        """What lies within the band, at the recorded rate and with white noise, without the ends."""
        recorded = RATE_HZ / self._reference.every
        cutoff = min(BAND_HZ, NYQUIST_SHARE * 0.5 * recorded)
        band = signal.butter(4, cutoff, fs=rate_hz, output="sos")
        rows = np.asarray(signal.sosfiltfilt(band, values, axis=0))[:: round(rate_hz / recorded)]
        correlation = self._reference.correlation
        if correlation:
            rows = (rows - correlation * np.roll(rows, 1, axis=0)) / np.sqrt(1.0 - correlation**2)
        return rows[self._inside]

    @property
    def _inside(self) -> slice:
        edge = round(EDGE_S * RATE_HZ / self._reference.every)
        return slice(edge, -edge)

    def _moves(self, velocity: Array) -> Array:
        """One where a joint moves, or where its friction at rest is known too, else zero; (N, n)."""
        rests = np.abs(velocity) < REST_SPEED
        dry = [(joint.friction_shape.k_v or 0.0) >= BREAKAWAY_SLOPE for joint in self.robot.joints]
        spread = 2 * round(REST_SPREAD_S * FINE * RATE_HZ) + 1
        held = ndimage.maximum_filter1d((rests & np.array(dry)).astype(np.float64), spread, axis=0)
        return 1.0 - held[:: FINE * self._reference.every][self._inside]

    def _weigh(self, rows: Array, moving: Array) -> Array:
        """Rows (N, n) or (N, n, p) in units of the noise."""
        weights = moving * self._scale
        return rows * (weights if rows.ndim == weights.ndim else weights[:, :, None])


@lru_cache(maxsize=2)
def sight_of(arm: str, motion_seed: int, reference: Reference) -> Sight:
    """What the training motions of a sound arm can show."""
    robot = arm_named(arm)
    train, _ = campaign(robot, motion_seed, reference.kind)
    return Sight(robot, [passage(robot, [], motion) for motion in train], noise_std(arm), reference)


def strength(
    robot: Robot, entries: Sequence[Entry], passages: Sequence[Passage], torque_std: ArrayLike
) -> tuple[float, Array]:
    """s, and the same by joint, (n,): the effects of some entries in the passages that they made."""
    sight = Sight(robot, passages, torque_std)
    missing = sight.strength([each.torque - _nominal_torque(robot, each) for each in passages])
    if not sensory(entries):
        return missing
    # The sensors' effects exist at the recorded rate only: what they change is added to the true torque there.
    rows = [(each.torque - _nominal_torque(robot, each))[::FINE] + _changed(entries, each) for each in passages]
    return sight.strength(rows, RATE_HZ)


def _changed(entries: Sequence[Entry], passage: Passage) -> Array:
    """What sensors add to the torque, at the recorded rate, (N, n)."""
    return sensed(entries, *passage.recorded)[1] - passage.recorded[1]


def _nominal_torque(robot: Robot, passage: Passage) -> Array:
    """Torque of rigid bodies and static friction, (N, n)."""
    acceleration = np.gradient(passage.velocity, 1.0 / (FINE * RATE_HZ), axis=0)
    torque = rigid_body_torque(build_model(robot), passage.position, passage.velocity, acceleration)
    if robot.model.friction is not None:
        shapes = [joint.friction_shape for joint in robot.joints]
        torque += static_friction_torque(passage.velocity, robot.model.friction, shapes)
    return torque


def _nominal_columns(robot: Robot, passage: Passage) -> Array:
    """Columns of the nominal model along a passage, (N, n, p)."""
    position, velocity = passage.position, passage.velocity
    acceleration = np.gradient(velocity, 1.0 / (FINE * RATE_HZ), axis=0)
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
    return np.concatenate([regressor, own], axis=2)
