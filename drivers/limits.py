"""Limits that drives on a bus do not keep by themselves: what is refused, what is held back, what is a runaway."""

import time

import numpy as np
from numpy.typing import NDArray

from drivers.backend import DriveLimits
from drivers.errors import DriverError, DriverErrorKind, Fault
from drivers.state import Setpoint

Array = NDArray[np.float64]

ENABLE_MARGIN = 0.05
"""How far outside its range a joint may stand when it is enabled: as far as a stop can carry it [rad or m]."""

CATCH_S = 0.05
"""Time that stopping a joint takes: it is stopped where it would be by then."""

SPEED_MARGIN = 1.1
"""Measured speed, and that of targets, may be this many times the limit."""

_SHORTEST_CYCLE_S, _LONGEST_CYCLE_S = 0.002, 0.05
_ACCELERATION_S = 0.1
"""Time in which a joint that has to catch up reaches its speed limit."""

_FASTEST = 1e3
"""Where there is no speed limit [rad/s or m/s]."""

_ARRIVED = 1e-6

PERSISTENCE = 2
"""Cycles in a row after which a speed counts: one noisy reading is no runaway."""

_REMEDY = "the arm was stopped; correct the commanded torque, then acknowledge"


def require_sensible(limits: DriveLimits, position: Array) -> None:
    """Refuse limits that leave no motion, are no numbers, or are those of another place.

    Parameters
    ----------
    limits : DriveLimits
        of the joints
    position : (n,) float64
        where the arm stands [rad or m]

    Raises
    ------
    DriverError
        ``refused``: names the joint and the limit
    """
    joint_count = len(position)
    for name in ("position_low", "position_high", "velocity", "torque"):
        if np.shape(getattr(limits, name)) != (joint_count,):
            raise _senseless(None, f"limits.{name} is not one number for each of {joint_count} joints")
    for joint in range(joint_count):
        low, high = float(limits.position_low[joint]), float(limits.position_high[joint])
        if not low < high:
            raise _senseless(joint, f"position limits {low:g} to {high:g} leave no motion")
        if not low - ENABLE_MARGIN <= position[joint] <= high + ENABLE_MARGIN:
            raise DriverError(
                DriverErrorKind.REFUSED,
                f"joint {joint + 1} stands at {position[joint]:.4g}, outside its limits {low:g} to {high:g}; "
                "move it into its range by hand, or widen the limits",
            )
        for name in ("velocity", "torque"):
            value = float(getattr(limits, name)[joint])
            if not value > 0.0:
                raise _senseless(joint, f"a {name} limit of {value:g} leaves no motion")


def require_finite(setpoint: Setpoint, joint_count: int) -> None:
    """Refuse targets that are missing or no numbers.

    Parameters
    ----------
    setpoint : Setpoint
        targets
    joint_count : int
        number of joints n

    Raises
    ------
    DriverError
        ``refused``
    """
    for targets in (setpoint.position, setpoint.torque):
        if np.shape(targets) != (joint_count,) or not np.isfinite(targets).all():
            raise DriverError(
                DriverErrorKind.REFUSED, "a target is missing or not a finite number; nothing was sent to the drives"
            )


class TargetLimiter:
    """Keeps targets within the limits: range, speed since the target before, torque.

    Targets that move within the limits are passed on as they are. One that leaps is approached with the speed limit at
    most, and with bounded acceleration, so that the joint does not run past it.
    """

    def __init__(self, limits: DriveLimits, position: Array) -> None:
        """Begin where the arm stands, at rest.

        Parameters
        ----------
        limits : DriveLimits
            of the joints
        position : (n,) float64
            where the arm stands [rad or m]
        """
        self._limits = limits
        self._position = position.copy()
        self._velocity = np.zeros_like(position)
        self._behind = np.zeros(len(position), dtype=np.bool_)
        self._since_ns = time.monotonic_ns()

    def limited(self, setpoint: Setpoint) -> Setpoint:
        """The targets that may be sent now.

        Parameters
        ----------
        setpoint : Setpoint
            finite targets
        """
        limits, now_ns = self._limits, time.monotonic_ns()
        elapsed_s = min(max((now_ns - self._since_ns) * 1e-9, _SHORTEST_CYCLE_S), _LONGEST_CYCLE_S)
        self._since_ns = now_ns
        wanted = np.clip(setpoint.position, limits.position_low, limits.position_high)
        reach = SPEED_MARGIN * limits.velocity * (elapsed_s + _SHORTEST_CYCLE_S)
        self._behind |= np.abs(wanted - self._position) > reach
        position = np.where(self._behind, self._approached(wanted, elapsed_s), wanted)
        self._behind &= np.abs(wanted - position) > _ARRIVED
        self._velocity = (position - self._position) / elapsed_s
        self._position = position
        return Setpoint(position, np.clip(setpoint.torque, -limits.torque, limits.torque))

    def _approached(self, wanted: Array, elapsed_s: float) -> Array:
        """One cycle towards targets that are far, at a speed that can still be taken back in time."""
        gap = wanted - self._position
        fastest = np.minimum(self._limits.velocity, _FASTEST)
        change = fastest / _ACCELERATION_S * elapsed_s
        # from here on one change less in every cycle just covers the gap
        stopping = 0.5 * change * (np.sqrt(1.0 + 8.0 * np.abs(gap) / (change * elapsed_s)) - 1.0)
        speed = np.minimum(stopping, fastest)
        velocity = np.clip(np.copysign(speed, gap), self._velocity - change, self._velocity + change)
        moved = velocity * elapsed_s
        return self._position + np.where(np.sign(moved) == np.sign(gap), np.clip(moved, -abs(gap), abs(gap)), moved)


class RunawayWatch:
    """Looks at every reading of an arm that is given torque."""

    def __init__(self, limits: DriveLimits) -> None:
        """Begin with a sound arm.

        Parameters
        ----------
        limits : DriveLimits
            of the joints
        """
        self._limits = limits
        self._fast = np.zeros(len(limits.velocity), dtype=np.int64)

    def look(self, position: Array, velocity: Array) -> Fault | None:
        """The first joint that leaves its limits; NaN leaves none.

        Parameters
        ----------
        position : (n,) float64
            [rad or m]
        velocity : (n,) float64
            [rad/s or m/s]
        """
        limits = self._limits
        with np.errstate(invalid="ignore"):
            ahead = position + CATCH_S * velocity
            low = (ahead < limits.position_low) & (velocity <= 0.0)
            high = (ahead > limits.position_high) & (velocity >= 0.0)
            fast = np.abs(velocity) > SPEED_MARGIN * limits.velocity
        self._fast = np.where(fast, self._fast + 1, 0)
        for joint in np.flatnonzero(low | high):
            end = limits.position_low[joint] if low[joint] else limits.position_high[joint]
            detail = f"at {position[joint]:.4g} and moving towards its limit {end:.4g}"
            return Fault("position-limit", int(joint) + 1, detail, _REMEDY)
        for joint in np.flatnonzero(self._fast >= PERSISTENCE):
            detail = f"moves at {velocity[joint]:.4g}, its limit is {limits.velocity[joint]:.4g}"
            return Fault("over-speed", int(joint) + 1, detail, _REMEDY)
        return None


def _senseless(joint: int | None, what: str) -> DriverError:
    place = "" if joint is None else f"joint {joint + 1}: "
    return DriverError(DriverErrorKind.REFUSED, f"{place}{what}; correct them")
