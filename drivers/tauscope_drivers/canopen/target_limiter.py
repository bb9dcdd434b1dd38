"""Limits that drives in cyclic synchronous position mode leave to the host: range, speed, acceleration of targets."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tauscope_drivers.backend import DriveLimits
from tauscope_drivers.clock import CycleGrid
from tauscope_drivers.limits import SPEED_MARGIN
from tauscope_drivers.state import Array, Setpoint

# how much farther than its cycle's way a target may lie, in ways of a cycle: plans and their instants are rounded
_SLACK = 0.4
_ACCELERATION_S = 0.1  # time in which a joint that has to catch up reaches its speed limit
_FASTEST = 1e3  # where there is no speed limit [rad/s or m/s]

_ARRIVED = 1e-6


@dataclass(frozen=True, eq=False)
class _Reached:
    """What a cycle has come to. `position`, `velocity`: (n,), targets sent, and how fast a drive in time goes there."""

    position: Array
    velocity: Array
    begin: Array  # (n,), where drives were by then
    wanted: Array  # (n,), targets asked for
    behind: NDArray[np.bool_]  # (n,), joints that are still on their way to them

    def after(self, part: float) -> Array:
        """Where drives are when so much of the cycle over which they interpolate has passed."""
        return self.position if part >= 1.0 else self.begin + max(0.0, part) * (self.position - self.begin)


class TargetLimiter:
    """Keeps targets within the limits: range, speed since the target before, torque.

    Targets that move within the limits are passed on as they are. One that leaps is approached with the speed limit at
    most, and with bounded acceleration, so that the joint does not run past it. So are all after a host has skipped
    cycles: a drive interpolates over the cycle that it was told, however late a target comes, and the way of several
    would be a leap to it. Nor may a target in time follow upon a late one as if that had been in time: the drive is not
    there yet, and has what is left of that way before it as well.
    """

    def __init__(self, limits: DriveLimits, position: Array, cycle_s: float) -> None:
        """Begin where the arm stands, at rest. `position`: (n,), where the arm stands [rad or m]."""
        self._limits = limits
        rest, not_behind = np.zeros_like(position), np.zeros(len(position), dtype=np.bool_)
        self._before = self._reached = _Reached(position.copy(), rest, position.copy(), position.copy(), not_behind)
        self._sent_ns = 0
        self._cycle_s = cycle_s
        self._grid = CycleGrid(cycle_s)

    def limited(self, setpoint: Setpoint, now_ns: int) -> Setpoint:
        """The targets that may be sent now."""
        limits = self._limits
        cycles = self._grid.cycles_until(now_ns)
        if cycles > 0:
            self._before = replace(self._reached, behind=self._reached.behind | (cycles > 1))
        wanted = np.clip(setpoint.position, limits.position_low, limits.position_high)
        place = self._reached.after(1e-9 * (now_ns - self._sent_ns) / self._cycle_s)
        self._reached, self._sent_ns = self._step(self._before, place, wanted), now_ns
        return Setpoint(self._reached.position, np.clip(setpoint.torque, -limits.torque, limits.torque))

    def _step(self, before: _Reached, place: Array, wanted: Array) -> _Reached:
        """Where the joints are sent in a cycle, on their way to where they are wanted; `place` is where they are."""
        way = np.minimum(self._limits.velocity, _FASTEST) * self._cycle_s
        reach = SPEED_MARGIN * (1.0 + _SLACK) * way
        behind = before.behind | (np.abs(wanted - before.position) > reach) | (np.abs(wanted - place) > reach)
        position = np.where(behind, self._approach(before, wanted), wanted)
        velocity = (position - before.position) / self._cycle_s
        is_too_far = behind & (np.abs(position - place) > way)
        position = np.where(is_too_far, place + np.copysign(way, position - place), position)
        return _Reached(position, velocity, place, wanted, behind & (np.abs(wanted - position) > _ARRIVED))

    def _approach(self, before: _Reached, wanted: Array) -> Array:
        """One step towards targets that are far, no faster beside them than can still be taken back in time."""
        gap = wanted - before.position
        fastest = np.minimum(self._limits.velocity, _FASTEST)
        change = fastest / _ACCELERATION_S * self._cycle_s
        # from here on one change less in every cycle just covers the gap
        stopping = 0.5 * change * (np.sqrt(1.0 + 8.0 * np.abs(gap) / (change * self._cycle_s)) - 1.0)
        moving = (wanted - before.wanted) / self._cycle_s
        velocity = np.clip(moving + np.copysign(stopping, gap), -fastest, fastest)
        moved = np.clip(velocity, before.velocity - change, before.velocity + change) * self._cycle_s
        return before.position + np.where(np.sign(moved) == np.sign(gap), np.clip(moved, -abs(gap), abs(gap)), moved)
