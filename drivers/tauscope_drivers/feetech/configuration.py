"""The joints' servos, from the robot file's ``drive`` blocks.

On each joint ``{servo_id: 3}`` and, where they differ from the defaults, the other keys of `ServoConfiguration`. All
servos are on one bus; ``port`` and ``baud`` stand on the first joint.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from tauscope_drivers.drive_block import (
    DriveJoint,
    read_direction,
    read_positive,
    read_text,
    read_whole,
    require_distinct,
    require_known_keys,
)
from tauscope_drivers.errors import DriverError, DriverErrorKind
from tauscope_drivers.feetech.packets import HIGHEST_ID
from tauscope_drivers.feetech.registers import COUNTS_PER_TURN, MIDDLE_COUNT

ID_KEY = "servo_id"
"""Key by which a ``drive`` block speaks of this bus."""

DEFAULT_BAUD = 1_000_000

_BUS_KEYS = ("port", "baud")
_SERVO_KEYS = (ID_KEY, "direction", "reduction", "zero_count")
_LOWEST_BAUD, _HIGHEST_BAUD = 19_200, 1_000_000


@dataclass(frozen=True)
class ServoConfiguration:
    """One servo.

    `reduction`: turns of the horn per turn of the joint; radians of the horn per metre on prismatic joints.
    `zero_count`: count at which the joint stands at zero.
    `torque_per_permille`: joint torque for 1 ‰ of load; None: the data sheet's, at the present voltage [Nm or N].
    """

    joint: str
    servo: int
    direction: int = 1
    reduction: float = 1.0
    zero_count: int = MIDDLE_COUNT
    torque_per_permille: float | None = None


@dataclass(frozen=True)
class BusConfiguration:
    """The bus and the servos on it, in the order of the joints."""

    servos: tuple[ServoConfiguration, ...]
    port: str
    baud: int = DEFAULT_BAUD


def read_configuration(joints: Sequence[DriveJoint]) -> BusConfiguration:
    """Bus and servos of an arm.

    Raises DriverError ``refused`` where a key is missing, unknown or not usable; names the joint and the key.
    """
    first = joints[0]
    require_known_keys(joints, _BUS_KEYS, _SERVO_KEYS)
    servos = tuple(_servo(joint) for joint in joints)
    require_distinct(joints, ID_KEY)
    port = read_text(first, "port", "give the serial device, like /dev/ttyACM0")
    baud = read_whole(first, "baud", DEFAULT_BAUD, least=_LOWEST_BAUD, most=_HIGHEST_BAUD)
    return BusConfiguration(servos, port, baud)


def _servo(joint: DriveJoint) -> ServoConfiguration:
    constant = joint.torque_per_unit
    if constant is not None and (not math.isfinite(constant) or constant == 0.0):
        text = f"joint {joint.name}: torque_constant = {constant}; give one that is not zero"
        raise DriverError(DriverErrorKind.REFUSED, text)
    return ServoConfiguration(
        joint=joint.name,
        servo=read_whole(joint, ID_KEY, None, least=0, most=HIGHEST_ID),
        direction=read_direction(joint),
        reduction=read_positive(joint, "reduction") or 1.0,
        zero_count=read_whole(joint, "zero_count", MIDDLE_COUNT, least=0, most=COUNTS_PER_TURN - 1),
        torque_per_permille=constant,
    )
