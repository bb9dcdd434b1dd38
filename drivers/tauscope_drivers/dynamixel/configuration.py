"""The joints' servos, from the robot file's ``drive`` blocks: ``{id: 3}`` and where they differ other keys."""

from collections.abc import Sequence
from dataclasses import dataclass

from tauscope_drivers.drive_block import DriveJoint, read_direction, read_positive, read_whole, refusal
from tauscope_drivers.dynamixel.control_table import find_model_by_name
from tauscope_drivers.dynamixel.packets import HIGHEST_ID
from tauscope_drivers.serial_servos.configuration import BusConfiguration, read_bus, read_torque_constant

_KEYS = ("id", "model", "direction", "reduction", "zero_count", "milliampere_per_unit", "current_limit_ma")


@dataclass(frozen=True)
class ServoConfiguration:
    """One servo. `torque_per_milliampere`: None: torque is neither limited nor commanded [Nm/mA or N/mA]."""

    joint: str
    servo: int
    model: str | None = None
    direction: int = 1
    reduction: float = 1.0  # turns of the horn per turn of the joint; radians of the horn per metre on prismatic joints
    zero_count: int | None = None  # count at which the joint stands at zero; None for the model's own
    milliampere_per_unit: float | None = None  # one unit of Present Current, in place of the model's [mA]
    current_limit_ma: float | None = None  # most current that it is given, besides its own Current Limit [mA]
    torque_per_milliampere: float | None = None


def read_configuration(joints: Sequence[DriveJoint]) -> BusConfiguration[ServoConfiguration]:
    """Bus and servos of an arm; see `read_bus`."""
    return read_bus(joints, _read_servo, keys=_KEYS, bauds=(9_600, 10_500_000), device="/dev/ttyUSB0")


def _read_servo(joint: DriveJoint) -> ServoConfiguration:
    zero = joint.drive.get("zero_count")
    return ServoConfiguration(
        joint=joint.name,
        servo=read_whole(joint, "id", None, least=0, most=HIGHEST_ID),
        model=_model(joint),
        direction=read_direction(joint),
        reduction=read_positive(joint, "reduction") or 1.0,
        zero_count=None if zero is None else read_whole(joint, "zero_count", None, least=-(2**31), most=2**31 - 1),
        milliampere_per_unit=read_positive(joint, "milliampere_per_unit"),
        current_limit_ma=read_positive(joint, "current_limit_ma"),
        torque_per_milliampere=read_torque_constant(joint),
    )


def _model(joint: DriveJoint) -> str | None:
    model = joint.drive.get("model")
    if model is None:
        return None
    if not isinstance(model, str):
        raise refusal(joint, "model", f"= {model!r}; write it as on the case, like XM430-W350")
    find_model_by_name(model)
    return model
