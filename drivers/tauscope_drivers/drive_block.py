"""Reading the ``drive`` blocks of a robot file's joints: what is missing, unknown or wrong is refused by name."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, dataclass
from typing import Any

from tauscope_drivers.errors import DriverError

_KEYS_OF_ANY_BUS = ("stop_policy",)


@dataclass(frozen=True)
class DriveJoint:
    """A joint as a driver sees it.

    `torque_per_unit`: joint torque for one unit that the drive measures, signed as the robot file's ``sign`` and
        ``torque_constant`` are; None where it does not say [Nm or N].
    `torque_limit`, `velocity_limit`: of the joint; None where the robot file states none [Nm or N, rad/s or m/s].
    `position_range`: lowest and highest; None where the robot file states none [rad or m].
    """

    name: str
    drive: Mapping[str, Any]
    _: KW_ONLY
    gear_ratio: float = 1.0  # motor turns per joint turn
    torque_per_unit: float | None = None
    torque_limit: float | None = None
    velocity_limit: float | None = None
    position_range: tuple[float, float] | None = None


def require_known_keys(joints: Sequence[DriveJoint], bus_keys: Sequence[str], own_keys: Sequence[str]) -> None:
    """Refuse unknown keys, and a joint that names another bus than the first. Raises DriverError ``refused``."""
    first = joints[0]
    known = sorted({*bus_keys, *own_keys, *_KEYS_OF_ANY_BUS})
    for joint in joints:
        for key in joint.drive:
            if key not in known:
                raise refusal(joint, key, f"is not known; known keys: {', '.join(known)}")
        for key in bus_keys:
            if joint.drive.get(key, first.drive.get(key)) != first.drive.get(key):
                raise refusal(joint, key, f"differs from that of {first.name}; all drives are on one bus")


def require_distinct(joints: Sequence[DriveJoint], key: str) -> None:
    """Refuse an address that is there twice. Raises DriverError ``refused``, which names the joint."""
    addresses = [joint.drive[key] for joint in joints]
    for joint, address in zip(joints, addresses, strict=True):
        if addresses.count(address) > 1:
            raise refusal(joint, key, f"= {address} is there twice; each drive has its own")


def read_whole(joint: DriveJoint, key: str, default: int | None, *, least: int, most: int) -> int:
    """A whole number, `default` where the key is missing. Raises DriverError ``refused``: none, or out of range."""
    value = joint.drive.get(key, default)
    if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
        raise refusal(joint, key, f"= {value!r}; give a whole number from {least} to {most}")
    return value


def read_direction(joint: DriveJoint) -> int:
    """Which way a drive turns: 1, or -1 against the joint. Raises DriverError ``refused`` where another number."""
    direction = read_whole(joint, "direction", 1, least=-1, most=1)
    if direction == 0:
        raise refusal(joint, "direction", "= 0; give 1 or -1")
    return direction


def read_positive(joint: DriveJoint, key: str) -> float | None:
    """A positive number; None where the key is missing. Raises DriverError ``refused`` where it is none."""
    value = joint.drive.get(key)
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value) or value <= 0:
        raise refusal(joint, key, f"= {value!r}; give a positive number")
    return float(value)


def read_text(joint: DriveJoint, key: str, what: str) -> str:
    """A text that has to be there. Raises DriverError ``refused`` where it is missing."""
    value = joint.drive.get(key)
    if not isinstance(value, str) or not value:
        raise refusal(joint, key, f"is missing; {what}")
    return value


def refusal(joint: DriveJoint, key: str, reason: str) -> DriverError:
    """Why a block is not usable."""
    return DriverError.refusal(f"joint {joint.name}: drive.{key} {reason}")
