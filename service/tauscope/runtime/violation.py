"""What a guard objects to: which rule, which joint, by how much."""

from dataclasses import dataclass
from enum import StrEnum

from tauscope.errors import AcquisitionError


class Rule(StrEnum):
    """What a command and a state have to satisfy."""

    NOT_FINITE = "not-finite"
    """every target is a number"""
    POSITION = "position"
    """targets lie within the position limits, and the arm no further outside than the margin"""
    VELOCITY = "velocity"
    """targets and arm move no faster than the velocity limit"""
    TORQUE = "torque"
    """no more torque is commanded than the torque limit"""
    FOLLOWING = "following-error"
    """the arm is where it was sent"""
    BRAKING = "braking-distance"
    """the arm can come to rest before its position limit"""
    TEMPERATURE = "temperature"
    """no motor is too hot"""
    STALE = "stale-state"
    """every joint has answered lately"""
    TIME = "time"
    """time runs forward"""
    LATE = "late"
    """the loop is no later than the device's watchdog allows"""
    FAULT = "fault"
    """no drive reports a fault"""
    NOT_ENABLED = "not-enabled"
    """every drive is under power"""


@dataclass(frozen=True)
class Violation:
    """One objection.

    joint : str or None
        name of the joint; None where it concerns the whole arm
    value : float or None
        what was found, in the rule's unit; None where it is no number
    """

    rule: Rule
    joint: str | None
    value: float | None
    limit: float | None
    detail: str

    def __str__(self) -> str:
        """One line for a message."""
        return f"{self.detail} ({self.rule})"


class GuardViolationError(AcquisitionError):
    """The guard let a command not pass: nothing was sent, and the arm is to be stopped."""

    def __init__(self, violation: Violation) -> None:
        super().__init__(str(violation))
        self.violation = violation
