"""What the driver needs to know of each joint's servo, from the robot file's ``drive`` blocks.

On each joint ``{id: 3}`` and, where they differ from the defaults, the other keys of `ServoConfiguration`. All servos
are on one bus, and ``port`` and ``baud`` stand on the first joint: ``{id: 1, port: /dev/ttyUSB0, baud: 1000000}``.
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
    refusal,
    require_distinct,
    require_known_keys,
)
from tauscope_drivers.dynamixel.control_table import find_model_by_name
from tauscope_drivers.dynamixel.packets import HIGHEST_ID
from tauscope_drivers.errors import DriverError, DriverErrorKind

DEFAULT_BAUD = 1_000_000

_BUS_KEYS = ("port", "baud")
_SERVO_KEYS = ("id", "model", "direction", "reduction", "zero_count", "milliampere_per_unit", "current_limit_ma")
_LOWEST_BAUD, _HIGHEST_BAUD = 9_600, 10_500_000


@dataclass(frozen=True)
class ServoConfiguration:
    """One servo.

    `torque_per_milliampere`: joint torque for one milliampere; None: the driver tracks positions, but neither limits
        torque in newton metres nor commands it [Nm/mA or N/mA].
    `reduction`: turns of the horn per turn of the joint; radians of the horn per metre on prismatic joints.
    `zero_count`: count at which the joint stands at zero; None for the model's own.
    `milliampere_per_unit`: one unit of Present Current, in place of the model's [mA].
    `current_limit_ma`: most current that it is given, besides its own Current Limit [mA].
    """

    joint: str
    servo: int
    model: str | None = None
    direction: int = 1
    reduction: float = 1.0
    zero_count: int | None = None
    milliampere_per_unit: float | None = None
    current_limit_ma: float | None = None
    torque_per_milliampere: float | None = None


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
    require_distinct(joints, "id")
    port = read_text(first, "port", "give the serial device, like /dev/ttyUSB0")
    return BusConfiguration(
        servos, port, read_whole(first, "baud", DEFAULT_BAUD, least=_LOWEST_BAUD, most=_HIGHEST_BAUD)
    )


def _servo(joint: DriveJoint) -> ServoConfiguration:
    """The servo of a joint."""
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
        torque_per_milliampere=_torque_per_milliampere(joint),
    )


def _model(joint: DriveJoint) -> str | None:
    """The model that a robot file promises."""
    model = joint.drive.get("model")
    if model is None:
        return None
    if not isinstance(model, str):
        raise refusal(joint, "model", f"= {model!r}; write it as on the case, like XM430-W350")
    find_model_by_name(model)
    return model


def _torque_per_milliampere(joint: DriveJoint) -> float | None:
    """The constant that a robot file states."""
    constant = joint.torque_per_unit
    if constant is not None and (not math.isfinite(constant) or constant == 0.0):
        raise DriverError(
            DriverErrorKind.REFUSED, f"joint {joint.name}: torque_constant = {constant}; give one that is not zero"
        )
    return constant
