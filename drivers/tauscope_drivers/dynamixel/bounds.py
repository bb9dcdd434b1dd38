"""What is let through to the servos: targets as goals in their units, never beyond the limits."""

from collections.abc import Sequence
from dataclasses import dataclass

from tauscope_drivers.backend import ControlMode
from tauscope_drivers.dynamixel.servo import JointServo
from tauscope_drivers.state import Setpoint


@dataclass(frozen=True)
class Bounds:
    """Ranges of the goals, in units of the servos, one a joint.

    low, high : tuple of int
        of Goal Position [counts]
    current : tuple of int
        of Goal Current, either sign [units]
    velocity : tuple of int
        of Profile Velocity, 0 for none [units]
    """

    low: tuple[int, ...]
    high: tuple[int, ...]
    current: tuple[int, ...]
    velocity: tuple[int, ...]


def goals_of(
    servos: Sequence[JointServo], mode: ControlMode, bounds: Bounds, setpoint: Setpoint
) -> tuple[str, list[int]]:
    """Item and values of a setpoint. Positions and torques beyond the bounds are brought back to them."""
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
