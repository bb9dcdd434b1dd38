"""What is let through to the servos: targets as goals in their units, never beyond the limits, never not finite."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drivers.backend import ControlMode, DriveLimits
from drivers.dynamixel.servo import JointServo
from drivers.errors import DriverError, DriverErrorKind
from drivers.state import Setpoint


@dataclass(frozen=True)
class Bounds:
    """Ranges of the goals, in units of the servos, one a joint.

    low, high : tuple of int
        of Goal Position [counts]
    current : tuple of int
        of Goal Current, either sign [units]
    """

    low: tuple[int, ...]
    high: tuple[int, ...]
    current: tuple[int, ...]


def require_sensible(servos: Sequence[JointServo], limits: DriveLimits) -> None:
    """Refuse limits that leave no motion, or that are no numbers.

    Parameters
    ----------
    servos : sequence of JointServo
        in the order of the joints
    limits : DriveLimits
        of the joints

    Raises
    ------
    DriverError
        ``refused``: names the joint and the limit
    """
    for joint, servo in enumerate(servos):
        low, high = float(limits.position_low[joint]), float(limits.position_high[joint])
        if not low < high:
            raise _senseless(servo, f"position limits {low:g} to {high:g}")
        for name, values in (("velocity", limits.velocity), ("torque", limits.torque)):
            if not float(values[joint]) > 0.0:
                raise _senseless(servo, f"{name} limit {float(values[joint]):g}")


def _senseless(servo: JointServo, what: str) -> DriverError:
    return DriverError(DriverErrorKind.REFUSED, f"{servo.label}: {what} leave no motion; correct them")


def goals_of(
    servos: Sequence[JointServo], mode: ControlMode, bounds: Bounds, setpoint: Setpoint
) -> tuple[str, list[int | None]]:
    """Item and values of a setpoint. Positions and torques beyond the bounds are brought back to them.

    Parameters
    ----------
    servos : sequence of JointServo
        in the order of the joints
    mode : ControlMode
        who closes the loop
    bounds : Bounds
        of the goals
    setpoint : Setpoint
        targets

    Raises
    ------
    DriverError
        ``refused``: a target is missing or not finite
    """
    for targets in (setpoint.position, setpoint.torque):
        if targets.shape != (len(servos),) or not np.all(np.isfinite(targets)):
            raise DriverError(DriverErrorKind.REFUSED, "a target is missing or not finite; nothing was sent")
    values = (setpoint.position if mode is ControlMode.POSITION else setpoint.torque).tolist()
    if mode is ControlMode.POSITION:
        return "Goal Position", [
            min(max(servo.units.counts(value), low), high)
            for servo, value, low, high in zip(servos, values, bounds.low, bounds.high, strict=True)
        ]
    return "Goal Current", [
        min(max(servo.units.current_units(value), -cap), cap)
        for servo, value, cap in zip(servos, values, bounds.current, strict=True)
    ]
