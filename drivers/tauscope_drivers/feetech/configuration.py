"""The joints' servos, from the robot file's ``drive`` blocks: ``{servo_id: 3}`` and where they differ other keys."""

from collections.abc import Sequence
from dataclasses import dataclass

from tauscope_drivers.drive_block import DriveJoint, read_direction, read_positive, read_whole
from tauscope_drivers.feetech.packets import HIGHEST_ID
from tauscope_drivers.feetech.registers import COUNTS_PER_TURN, MIDDLE_COUNT
from tauscope_drivers.serial_servos.configuration import BusConfiguration, read_bus, read_torque_constant

_KEYS = ("servo_id", "direction", "reduction", "zero_count")


@dataclass(frozen=True)
class ServoConfiguration:
    """One servo. `torque_per_permille`: joint torque for 1 ‰ of load; None: by the data sheet [Nm or N]."""

    joint: str
    servo: int
    direction: int = 1
    reduction: float = 1.0  # turns of the horn per turn of the joint; radians of the horn per metre on prismatic joints
    zero_count: int = MIDDLE_COUNT  # count at which the joint stands at zero
    torque_per_permille: float | None = None


def read_configuration(joints: Sequence[DriveJoint]) -> BusConfiguration[ServoConfiguration]:
    """Bus and servos of an arm; see `read_bus`."""
    return read_bus(joints, _read_servo, keys=_KEYS, bauds=(19_200, 1_000_000), device="/dev/ttyACM0")


def _read_servo(joint: DriveJoint) -> ServoConfiguration:
    return ServoConfiguration(
        joint=joint.name,
        servo=read_whole(joint, "servo_id", None, least=0, most=HIGHEST_ID),
        direction=read_direction(joint),
        reduction=read_positive(joint, "reduction") or 1.0,
        zero_count=read_whole(joint, "zero_count", MIDDLE_COUNT, least=0, most=COUNTS_PER_TURN - 1),
        torque_per_permille=read_torque_constant(joint),
    )
