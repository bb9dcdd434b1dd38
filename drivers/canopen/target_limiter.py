"""Limits that drives in cyclic synchronous position mode leave to the host: range, speed, acceleration of targets."""

import numpy as np
from numpy.typing import NDArray

from drivers.backend import DriveLimits
from drivers.limits import SPEED_MARGIN
from drivers.state import Setpoint

Array = NDArray[np.float64]

_SLACK_S = 0.002
_LONGEST_STEP_S = 0.05
_ACCELERATION_S = 0.1
"""Time in which a joint that has to catch up reaches its speed limit."""

_FASTEST = 1e3
"""Where there is no speed limit [rad/s or m/s]."""

_ARRIVED = 1e-6
_EARLY, _LATE = 0.5, 1.9
"""A target that comes so many cycles after the one before is the next; a host that is later skips whole cycles."""


class TargetLimiter:
    """Keeps targets within the limits: range, speed since the target before, torque.

    Targets that move within the limits are passed on as they are. One that leaps is approached with the speed limit at
    most, and with bounded acceleration, so that the joint does not run past it. It is approached in whole cycles: a
    drive interpolates over the cycle that it was told, however late a target comes, and a step as long as the target
    was late would be a leap to it.
    """

    def __init__(self, limits: DriveLimits, position: Array, cycle_s: float) -> None:
        """Begin where the arm stands, at rest.

        Parameters
        ----------
        limits : DriveLimits
            of the joints
        position : (n,) float64
            where the arm stands [rad or m]
        cycle_s : float
            time between two targets [s]
        """
        self._limits = limits
        self._position = position.copy()
        self._velocity = np.zeros_like(position)
        self._behind = np.zeros(len(position), dtype=np.bool_)
        self._cycle_s = cycle_s
        self._grid_ns: int | None = None

    def limited(self, setpoint: Setpoint, now_ns: int) -> Setpoint:
        """The targets that may be sent now.

        Parameters
        ----------
        setpoint : Setpoint
            finite targets
        now_ns : int
            present instant [ns]
        """
        limits = self._limits
        step_s = min(self._cycles_until(now_ns) * self._cycle_s, _LONGEST_STEP_S)
        wanted = np.clip(setpoint.position, limits.position_low, limits.position_high)
        reach = SPEED_MARGIN * limits.velocity * (max(step_s, self._cycle_s) + _SLACK_S)
        self._behind |= np.abs(wanted - self._position) > reach
        position = np.where(self._behind, self._approached(wanted, step_s), wanted)
        self._behind &= np.abs(wanted - position) > _ARRIVED
        if step_s > 0.0:
            self._velocity = (position - self._position) / step_s
        self._position = position
        return Setpoint(position, np.clip(setpoint.torque, -limits.torque, limits.torque))

    def _cycles_until(self, now_ns: int) -> int:
        """How many cycles there are since the target before: one, more where some were skipped, none after a late one.

        The grid of cycles is that of the targets that came early: late is what a busy machine makes of them.
        """
        period_ns = self._cycle_s * 1e9
        if self._grid_ns is None:
            self._grid_ns = now_ns
            return 1
        waited = (now_ns - self._grid_ns) / period_ns
        cycles = 1 if _EARLY < waited < _LATE else round(waited)
        self._grid_ns = min(self._grid_ns + round(cycles * period_ns), now_ns)
        return cycles

    def _approached(self, wanted: Array, step_s: float) -> Array:
        """One step towards targets that are far, at a speed that can still be taken back in time."""
        if step_s == 0.0:
            return self._position
        gap = wanted - self._position
        fastest = np.minimum(self._limits.velocity, _FASTEST)
        change = fastest / _ACCELERATION_S * step_s
        # from here on one change less in every cycle just covers the gap
        stopping = 0.5 * change * (np.sqrt(1.0 + 8.0 * np.abs(gap) / (change * step_s)) - 1.0)
        speed = np.minimum(stopping, fastest)
        velocity = np.clip(np.copysign(speed, gap), self._velocity - change, self._velocity + change)
        moved = velocity * step_s
        return self._position + np.where(np.sign(moved) == np.sign(gap), np.clip(moved, -abs(gap), abs(gap)), moved)
