"""What the driver needs to know of each joint's servo, from the robot file's ``drive`` blocks.

On each joint ``{id: 3}`` and, where they differ from the defaults, the other keys of `ServoConfiguration`. All servos
are on one bus, and ``port`` and ``baud`` stand on the first joint: ``{id: 1, port: /dev/ttyUSB0, baud: 1000000}``.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from drivers.dynamixel.control_table import find_model_by_name
from drivers.dynamixel.packets import HIGHEST_ID
from drivers.errors import DriverError, DriverErrorKind

DEFAULT_BAUD = 1_000_000

_BUS_KEYS = ("port", "baud")
_SERVO_KEYS = ("id", "model", "direction", "reduction", "zero_count", "milliampere_per_unit", "current_limit_ma")
_SHARED_KEYS = ("stop_policy",)
_LOWEST_BAUD, _HIGHEST_BAUD = 9_600, 10_500_000


@dataclass(frozen=True)
class DynamixelJoint:
    """A joint as the driver sees it.

    name : str
        of the joint
    drive : mapping
        its ``drive`` block
    torque_per_milliampere : float or None
        joint torque for one milliampere, signed as the robot file's ``sign`` and ``torque_constant`` are; None where
        it does not say: then positions can be tracked, but torque neither limited in newton metres nor commanded
        [Nm/mA or N/mA]
    """

    name: str
    drive: Mapping[str, Any]
    torque_per_milliampere: float | None = None


@dataclass(frozen=True)
class ServoConfiguration:
    """One servo.

    joint : str
        name of its joint
    servo : int
        ID, key ``id``
    model : str or None
        as printed on its case; where it is given, another model is refused
    direction : int
        -1 where it turns against the joint, else 1
    reduction : float
        turns of the horn per turn of the joint; radians of the horn per metre on prismatic joints
    zero_count : int or None
        count at which the joint stands at zero; None for the model's own
    milliampere_per_unit : float or None
        one unit of Present Current, in place of the model's [mA]
    current_limit_ma : float or None
        most current that it is given, besides its own Current Limit [mA]
    torque_per_milliampere : float or None
        see `DynamixelJoint`
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
    """The bus and the servos on it, in the order of the joints.

    servos : tuple of ServoConfiguration
        one a joint
    port : str
        path of the serial device
    baud : int
        [bit/s]
    """

    servos: tuple[ServoConfiguration, ...]
    port: str
    baud: int = DEFAULT_BAUD


def read_configuration(joints: Sequence[DynamixelJoint]) -> BusConfiguration:
    """Bus and servos of an arm.

    Parameters
    ----------
    joints : sequence of DynamixelJoint
        base first, at least one

    Raises
    ------
    DriverError
        ``refused``: a key is missing, unknown or not usable; names the joint and the key
    """
    first = joints[0]
    known = {*_BUS_KEYS, *_SERVO_KEYS, *_SHARED_KEYS}
    for joint in joints:
        for key in joint.drive:
            if key not in known:
                raise _refusal(joint, key, f"is not known; known keys: {', '.join(sorted(known))}")
        for key in _BUS_KEYS:
            if joint is not first and joint.drive.get(key, first.drive.get(key)) != first.drive.get(key):
                raise _refusal(joint, key, f"differs from that of {first.name}; all servos are on one bus")
    servos = tuple(_servo(joint) for joint in joints)
    for joint, servo in zip(joints, servos, strict=True):
        if sum(other.servo == servo.servo for other in servos) > 1:
            raise _refusal(joint, "id", f"= {servo.servo} is there twice; each servo has its own")
    port = first.drive.get("port")
    if not isinstance(port, str) or not port:
        raise _refusal(first, "port", "is missing; give the serial device, like /dev/ttyUSB0")
    baud = _whole(first, "baud", DEFAULT_BAUD, least=_LOWEST_BAUD, most=_HIGHEST_BAUD)
    return BusConfiguration(servos, port, baud)


def _servo(joint: DynamixelJoint) -> ServoConfiguration:
    """The servo of a joint."""
    model = joint.drive.get("model")
    if model is not None:
        if not isinstance(model, str):
            raise _refusal(joint, "model", f"= {model!r}; write it as on the case, like XM430-W350")
        find_model_by_name(model)
    direction = _whole(joint, "direction", 1, least=-1, most=1)
    if direction == 0:
        raise _refusal(joint, "direction", "= 0; give 1 or -1")
    zero = joint.drive.get("zero_count")
    constant = joint.torque_per_milliampere
    if constant is not None and (not math.isfinite(constant) or constant == 0.0):
        raise DriverError(
            DriverErrorKind.REFUSED, f"joint {joint.name}: torque_constant = {constant}; give one that is not zero"
        )
    return ServoConfiguration(
        joint=joint.name,
        servo=_whole(joint, "id", None, least=0, most=HIGHEST_ID),
        model=model,
        direction=direction,
        reduction=_positive(joint, "reduction") or 1.0,
        zero_count=None if zero is None else _whole(joint, "zero_count", None, least=-(2**31), most=2**31 - 1),
        milliampere_per_unit=_positive(joint, "milliampere_per_unit"),
        current_limit_ma=_positive(joint, "current_limit_ma"),
        torque_per_milliampere=constant,
    )


def _whole(joint: DynamixelJoint, key: str, default: int | None, *, least: int, most: int) -> int:
    value = joint.drive.get(key, default)
    if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
        raise _refusal(joint, key, f"= {value!r}; give a whole number from {least} to {most}")
    return value


def _positive(joint: DynamixelJoint, key: str) -> float | None:
    value = joint.drive.get(key)
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value) or value <= 0:
        raise _refusal(joint, key, f"= {value!r}; give a positive number")
    return float(value)


def _refusal(joint: DynamixelJoint, key: str, reason: str) -> DriverError:
    return DriverError(DriverErrorKind.REFUSED, f"joint {joint.name}: drive.{key} {reason}")
