"""The ``drive`` blocks of an arm whose servos are on one serial bus: ``port`` and ``baud`` stand on the first joint."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

from tauscope_drivers.drive_block import DriveJoint, read_text, read_whole, require_distinct, require_known_keys
from tauscope_drivers.errors import DriverError

DEFAULT_BAUD = 1_000_000

_Servo = TypeVar("_Servo")


@dataclass(frozen=True)
class BusConfiguration(Generic[_Servo]):
    """The bus and the servos on it, in the order of the joints."""

    servos: tuple[_Servo, ...]
    port: str
    baud: int = DEFAULT_BAUD


def read_bus(
    joints: Sequence[DriveJoint],
    read_servo: Callable[[DriveJoint], _Servo],
    *,
    keys: Sequence[str],
    bauds: tuple[int, int],
    device: str,
) -> BusConfiguration[_Servo]:
    """Bus and servos of an arm. Raises DriverError ``refused``: names joint and key. `keys`: that of the ID first."""
    require_known_keys(joints, ("port", "baud"), keys)
    servos = tuple(read_servo(joint) for joint in joints)
    require_distinct(joints, keys[0])
    port = read_text(joints[0], "port", f"give the serial device, like {device}")
    return BusConfiguration(servos, port, read_whole(joints[0], "baud", DEFAULT_BAUD, least=bauds[0], most=bauds[1]))


def read_torque_constant(joint: DriveJoint) -> float | None:
    """Joint torque for one unit that is measured, None where not said [Nm or N]. Raises DriverError ``refused``."""
    constant = joint.torque_per_unit
    if constant is not None and (not math.isfinite(constant) or constant == 0.0):
        raise DriverError.refusal(f"joint {joint.name}: torque_constant = {constant}; give one that is not zero")
    return constant
