"""What the arm is asked to do: random Fourier series, slow reversals, motions too narrow or too slow, or stepwise."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from concealed.generator.rates import HOLD_S, RATE_HZ
from concealed.generator.stepwise import jog, visit_points
from tauscope.robot import Joint, JointLimits, Robot
from tauscope.trajectory import Trajectory
from tauscope_sim.motion import FourierMotion, random_fourier_motion

Array = NDArray[np.float64]

STEPWISE = {"jogs": jog, "points": visit_points}
"""Motions with rest between the moves."""

SLOW_SPEED = 0.12
"""Speed limit of slow reversals [rad/s]."""


class Asked(Protocol):
    """What a drive is told, and which period of it each setpoint belongs to."""

    @property
    def name(self) -> str: ...

    @property
    def setpoints(self) -> Array: ...

    @property
    def period(self) -> Array: ...


@dataclass(frozen=True, eq=False)
class Motion:
    """A motion with rest before it.

    name : str
        of the recording
    series : FourierMotion
        one period
    periods : int
        how often
    """

    name: str
    series: FourierMotion
    periods: int

    @property
    def setpoints(self) -> Array:
        """Position at `RATE_HZ`, (N, n) [rad or m]."""
        count = round(self.series.period_s * RATE_HZ)
        period = self.series.evaluate(np.arange(count) / RATE_HZ).position
        rest = np.tile(period[:1], (round(HOLD_S * RATE_HZ), 1))
        return np.concatenate([rest, *[period] * self.periods])

    @property
    def period(self) -> Array:
        """Index of the period at every setpoint, NaN at rest, (N,)."""
        count = round(self.series.period_s * RATE_HZ)
        rest = np.full(round(HOLD_S * RATE_HZ), np.nan)
        return np.concatenate([rest, np.repeat(np.arange(self.periods, dtype=np.float64), count)])


@dataclass(frozen=True, eq=False)
class Planned:
    """A motion that somebody else has planned, with rest before it.

    name : str
        of the recording
    trajectory : Trajectory
        the motion
    """

    name: str
    trajectory: Trajectory

    @property
    def setpoints(self) -> Array:
        """Position at `RATE_HZ`, (N, n) [rad or m]."""
        position = self.trajectory.samples(RATE_HZ).position
        return np.concatenate([np.tile(position[:1], (round(HOLD_S * RATE_HZ), 1)), position])

    @property
    def period(self) -> Array:
        """No period is stated, (N,)."""
        return np.full(len(self.setpoints), np.nan)


def campaign(robot: Robot, seed: int, kind: str = "rich") -> tuple[Sequence[Asked], Sequence[Asked]]:
    """Training and held-out motions: a `fourier_campaign`, or two stepwise recordings and a third held out."""
    if kind not in STEPWISE:
        return fourier_campaign(robot, seed, kind)
    rng = np.random.default_rng([seed, 78])
    first, second, held_out = (STEPWISE[kind](name, robot.joints, rng) for name in ("train1", "train2", "held-out"))
    return [first, second], [held_out]


def fourier_campaign(
    robot: Robot, seed: int, kind: str = "rich", period_s: float = 8.0
) -> tuple[list[Motion], list[Motion]]:
    """Training and held-out motions.

    `rich`: two Fourier motions and slow reversals; `narrow` and `slow`: training that hides much, held out as for
    `rich`.
    """
    rng = np.random.default_rng([seed, 77])
    joints = {
        "rich": robot.joints,
        "narrow": [_limited(joint, 0.25, 0.5) for joint in robot.joints],
        "slow": [_limited(joint, 0.9, 0.25) for joint in robot.joints],
    }[kind]
    train = [Motion(f"train{k}", _fourier(joints, rng, period_s), 2) for k in (1, 2)]
    if kind == "rich":
        slow = [_limited(joint, 0.5, SLOW_SPEED) for joint in robot.joints]
        train.append(Motion("train3", _fourier(slow, rng, 1.5 * period_s), 1))
    return train, [Motion("held-out", _fourier(robot.joints, rng, period_s), 2)]


def _fourier(joints: list[Joint] | tuple[Joint, ...], rng: np.random.Generator, period_s: float) -> FourierMotion:
    return random_fourier_motion(joints, rng, period_s=period_s, limit_fraction=0.9)


def _limited(joint: Joint, reach: float, speed: float) -> Joint:
    """The joint with a narrower range, drawn about its middle by the motion itself, and a lower speed."""
    return replace(joint, limits=JointLimits((-reach, reach), speed, joint.limits.acceleration, joint.limits.torque))
