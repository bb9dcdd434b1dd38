"""What people record first: one joint after the other, or point to point, with rest between the moves."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from concealed.generator.rates import HOLD_S, RATE_HZ
from tauscope.robot import Joint

Array = NDArray[np.float64]

DWELL_S = (0.3, 1.2)
"""Shortest and longest rest between two moves [s]."""

SPEED = (0.2, 0.6)
"""Of the limit of speed."""

ACCELERATION = (0.3, 0.8)
"""Of the limit of acceleration."""

POINTS = 9
"""Targets of one recording of point-to-point motion."""


@dataclass(frozen=True, eq=False)
class Stepwise:
    """A motion from point to point.

    name : str
        of the recording
    setpoints : (N, n) float64
        position at `RATE_HZ` [rad or m]
    """

    name: str
    setpoints: Array

    @property
    def period(self) -> Array:
        """No period is stated, (N,)."""
        return np.full(len(self.setpoints), np.nan)


def jog(name: str, joints: Sequence[Joint], rng: np.random.Generator) -> Stepwise:
    """Every joint to one side, to the other, and back, while the others stand still."""
    home = np.array([0.3 * _reach(joint) * rng.uniform(-1.0, 1.0) for joint in joints])
    parts = [_rest(home, HOLD_S)]
    for number, joint in enumerate(joints):
        room = _reach(joint) - abs(home[number])
        side = float(rng.choice([-1.0, 1.0]))
        offsets = [side * rng.uniform(0.4, 0.9) * room, -side * rng.uniform(0.4, 0.9) * room, 0.0]
        for offset in offsets:
            target = home.copy()
            target[number] += offset
            parts += _move(parts[-1][-1], target, joints, rng)
    return Stepwise(name, np.concatenate(parts))


def visit_points(name: str, joints: Sequence[Joint], rng: np.random.Generator) -> Stepwise:
    """All joints at once to one point after the other; they start and stop together."""
    reach = np.array([_reach(joint) for joint in joints])
    parts = [_rest(0.3 * reach * rng.uniform(-1.0, 1.0, len(reach)), HOLD_S)]
    for _ in range(POINTS):
        parts += _move(parts[-1][-1], 0.9 * reach * rng.uniform(-1.0, 1.0, len(reach)), joints, rng)
    return Stepwise(name, np.concatenate(parts))


def trapezoid(duration_share: Array, ramp: float) -> Array:
    """Way of a trapezoidal profile of speed, from 0 to 1.

    Parameters
    ----------
    duration_share : (N,) float64
        time over the duration of the move, 0 to 1
    ramp : float
        part of the duration in which speed rises, and in which it falls; up to 0.5
    """
    t = duration_share
    rise, fall = 0.5 * t**2 / ramp, 1.0 - ramp - 0.5 * (1.0 - t) ** 2 / ramp
    return np.where(t < ramp, rise, np.where(t <= 1.0 - ramp, t - 0.5 * ramp, fall)) / (1.0 - ramp)


def _move(begin: Array, target: Array, joints: Sequence[Joint], rng: np.random.Generator) -> list[Array]:
    """One move and the rest after it, as quick as the slowest joint allows."""
    way = np.abs(target - begin)
    speed = np.array([(joint.limits.velocity or 1.0) for joint in joints]) * rng.uniform(*SPEED)
    acceleration = np.array([(joint.limits.acceleration or 3.0) for joint in joints]) * rng.uniform(*ACCELERATION)
    times = way / speed + speed / acceleration
    short = way < speed**2 / acceleration
    times[short] = 2.0 * np.sqrt(way[short] / acceleration[short])
    slowest = int(np.argmax(times * (way > 0.0)))
    duration = times[slowest]
    ramp = 0.5 if short[slowest] else float(speed[slowest] / acceleration[slowest] / duration)
    count = max(int(np.ceil(duration * RATE_HZ)), 1)
    share = np.minimum(np.arange(1, count + 1) / (duration * RATE_HZ), 1.0)
    moving = begin + np.multiply.outer(trapezoid(share, ramp), target - begin)
    return [moving, _rest(target, float(rng.uniform(*DWELL_S)))]


def _rest(place: Array, duration_s: float) -> Array:
    return np.tile(place, (round(duration_s * RATE_HZ), 1))


def _reach(joint: Joint) -> float:
    """Part of the joint's range about its middle, which all arms here have at zero [rad or m]."""
    low, high = joint.limits.position or (-1.0, 1.0)
    return min(0.4 * (high - low), 1.5)
