"""Limits that drives on a bus do not keep by themselves: what is refused, what is held back, what is a runaway."""

from collections.abc import Sequence

import numpy as np

from tauscope_drivers.backend import DriveLimits
from tauscope_drivers.drive_block import DriveJoint
from tauscope_drivers.errors import DriverError, Fault
from tauscope_drivers.state import Array, Setpoint

# how far outside its range a joint may stand when it is enabled: as far as a stop can carry it [rad or m]
ENABLE_MARGIN = 0.05
CATCH_S = 0.05  # time that stopping a joint takes, a change of mode included: it is stopped where it would be by then
SPEED_MARGIN = 1.1  # measured speed, and that of targets, may be this many times the limit
TORQUE_MARGIN = 1.1  # measured torque may be this many times the limit: a drive estimates it from its current
PERSISTENCE = 2  # cycles in a row after which a speed or a torque counts: one noisy reading is no runaway

_TORQUE_REMEDY = "the arm was stopped; look for an obstacle or slow the motion down, then acknowledge"
_REMEDY = "the arm was stopped; correct the commanded torque, then acknowledge"


def stated_limits(joints: Sequence[DriveJoint]) -> DriveLimits:
    """Limits that a robot file states; infinite where it states none."""
    ranges = [joint.position_range or (-np.inf, np.inf) for joint in joints]
    return DriveLimits(
        position_low=np.array([low for low, _ in ranges]),
        position_high=np.array([high for _, high in ranges]),
        velocity=np.array([joint.velocity_limit or np.inf for joint in joints]),
        torque=np.array([joint.torque_limit or np.inf for joint in joints]),
    )


def require_sensible(limits: DriveLimits, position: Array, labels: Sequence[str]) -> None:
    """Refuse limits that leave no motion from `position`, (n,) [rad or m]. Raises DriverError ``refused``."""
    joint_count = len(position)
    for name in ("position_low", "position_high", "velocity", "torque"):
        if np.shape(getattr(limits, name)) != (joint_count,):
            raise _senseless(f"limits.{name} is not one number for each of {joint_count} joints")
    for joint, label in enumerate(labels):
        low, high = float(limits.position_low[joint]), float(limits.position_high[joint])
        if not low < high:
            raise _senseless(f"{label}: position limits {low:g} to {high:g} leave no motion")
        if not low - ENABLE_MARGIN <= position[joint] <= high + ENABLE_MARGIN:
            raise DriverError.refusal(
                f"{label} stands at {position[joint]:.4g}, outside its limits {low:g} to {high:g}; "
                "move it into its range by hand, or widen the limits"
            )
        for name in ("velocity", "torque"):
            value = float(getattr(limits, name)[joint])
            if not value > 0.0:
                raise _senseless(f"{label}: a {name} limit of {value:g} leaves no motion")


def require_finite(setpoint: Setpoint, joint_count: int) -> None:
    """Refuse targets that are missing or no numbers. Raises DriverError: ``refused``."""
    for targets in (setpoint.position, setpoint.torque):
        if np.shape(targets) != (joint_count,) or not np.isfinite(targets).all():
            raise DriverError.refusal("a target is missing or not a finite number; nothing was sent to the drives")


class RunawayWatch:
    """Looks at every reading of an arm that is given torque."""

    def __init__(self, limits: DriveLimits) -> None:
        self._limits = limits
        self._fast = np.zeros(len(limits.velocity), dtype=np.int64)

    def look(self, position: Array, velocity: Array) -> Fault | None:
        """The first joint that leaves its limits; not NaN. `position`, `velocity`: (n,) [rad or m, and per s]."""
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


class TorqueWatch:
    """Looks at the measured torque of joints whose drives have no torque limit of their own."""

    def __init__(self, torque: Array) -> None:
        """Begin with a sound arm. `torque`: (n,), largest; infinite where the drive limits it itself [Nm or N]."""
        self._torque = torque
        self._over = np.zeros(len(torque), dtype=np.int64)

    def look(self, effort: Array) -> Fault | None:
        """The first joint beyond its limit for `PERSISTENCE` cycles; NaN is none. `effort`: (n,) [Nm or N]."""
        with np.errstate(invalid="ignore"):
            over = np.abs(effort) > TORQUE_MARGIN * self._torque
        self._over = np.where(over, self._over + 1, 0)
        for joint in np.flatnonzero(self._over >= PERSISTENCE):
            detail = f"torque of {effort[joint]:.4g}, its limit is {self._torque[joint]:.4g}"
            return Fault("over-torque", int(joint) + 1, detail, _TORQUE_REMEDY)
        return None


def _senseless(what: str) -> DriverError:
    return DriverError.refusal(f"{what}; correct them")
