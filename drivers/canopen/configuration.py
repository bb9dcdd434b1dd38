"""What the driver needs to know of each joint's drive, from the robot file's ``drive`` blocks.

On each joint: ``{node_id: 3, counts_per_turn: 65536}`` and, where they differ from the defaults, the other keys of
`NodeConfiguration`. The bus is the same for all joints and stands on the first: ``interface`` and ``channel`` as
python-can takes them, ``bit_rate``.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from drivers.errors import DriverError, DriverErrorKind

_HIGHEST_NODE = 127
_BUS_KEYS = ("interface", "channel", "bit_rate", "serial_baud", "eds")
_NODE_KEYS = ("node_id", "counts_per_turn", "zero_count", "direction", "rated_torque_nm")
_SHARED_KEYS = ("stop_policy",)


@dataclass(frozen=True)
class DriveJoint:
    """A joint as the driver sees it.

    name : str
        of the joint
    gear_ratio : float
        motor turns per joint turn; per metre of travel over 2π on a prismatic joint
    drive : mapping
        its ``drive`` block
    """

    name: str
    gear_ratio: float
    drive: Mapping[str, Any]


@dataclass(frozen=True)
class NodeConfiguration:
    """One drive.

    node_id : int
        1 to 127
    counts_per_turn : float
        position counts a motor turn
    gear_ratio : float
        motor turns per joint turn
    zero_count : int
        count at which the joint stands at zero
    direction : int
        -1 where the drive counts against the joint, else 1
    rated_torque_nm : float or None
        at the motor shaft, in place of what the drive states (0x6076): makers scale it differently [Nm]
    """

    node_id: int
    counts_per_turn: float
    gear_ratio: float
    zero_count: int = 0
    direction: int = 1
    rated_torque_nm: float | None = None


@dataclass(frozen=True)
class BusConfiguration:
    """The bus and the drives on it, in the order of the joints.

    nodes : tuple of NodeConfiguration
        one a joint
    interface : str
        python-can's name: ``socketcan``, ``slcan``, ``pcan``, ``socketcand``, ``virtual`` …
    channel : str
        ``can0``, ``/dev/ttyACM0`` …
    bit_rate : int
        [bit/s]
    serial_baud : float or None
        of an adapter on a true serial line [bit/s]
    """

    nodes: tuple[NodeConfiguration, ...]
    interface: str
    channel: str
    bit_rate: int = 1_000_000
    serial_baud: float | None = None


def read_configuration(joints: Sequence[DriveJoint]) -> BusConfiguration:
    """Bus and drives of an arm.

    Parameters
    ----------
    joints : sequence of DriveJoint
        base first

    Raises
    ------
    DriverError
        ``refused``: a key is missing, unknown or not usable; names the joint and the key
    """
    first = joints[0]
    known = {*_BUS_KEYS, *_NODE_KEYS, *_SHARED_KEYS}
    for joint in joints:
        for key in joint.drive:
            if key not in known:
                raise _refusal(joint, key, f"is not known; known keys: {', '.join(sorted(known))}")
        for key in _BUS_KEYS:
            if joint is not first and joint.drive.get(key, first.drive.get(key)) != first.drive.get(key):
                raise _refusal(joint, key, f"differs from that of {first.name}; all drives are on one bus")
    nodes = tuple(_node(joint) for joint in joints)
    for joint, node in zip(joints, nodes, strict=True):
        if sum(other.node_id == node.node_id for other in nodes) > 1:
            raise _refusal(joint, "node_id", f"= {node.node_id} is there twice; each drive has its own")
    baud = first.drive.get("serial_baud")
    return BusConfiguration(
        nodes=nodes,
        interface=_text(first, "interface"),
        channel=_text(first, "channel"),
        bit_rate=_whole(first, "bit_rate", 1_000_000, least=10_000, most=1_000_000),
        serial_baud=None if baud is None else _positive(first, "serial_baud", baud),
    )


def _node(joint: DriveJoint) -> NodeConfiguration:
    """The drive of a joint."""
    rated = joint.drive.get("rated_torque_nm")
    direction = _whole(joint, "direction", 1, least=-1, most=1)
    if direction == 0:
        raise _refusal(joint, "direction", "= 0; give 1 or -1")
    return NodeConfiguration(
        node_id=_whole(joint, "node_id", None, least=1, most=_HIGHEST_NODE),
        counts_per_turn=_positive(joint, "counts_per_turn", joint.drive.get("counts_per_turn")),
        gear_ratio=joint.gear_ratio,
        zero_count=_whole(joint, "zero_count", 0, least=-(2**31), most=2**31 - 1),
        direction=direction,
        rated_torque_nm=None if rated is None else _positive(joint, "rated_torque_nm", rated),
    )


def _text(joint: DriveJoint, key: str) -> str:
    value = joint.drive.get(key)
    if not isinstance(value, str) or not value:
        raise _refusal(joint, key, "is missing; name it as python-can does")
    return value


def _whole(joint: DriveJoint, key: str, default: int | None, *, least: int, most: int) -> int:
    value = joint.drive.get(key, default)
    if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
        raise _refusal(joint, key, f"= {value!r}; give a whole number from {least} to {most}")
    return value


def _positive(joint: DriveJoint, key: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value) or value <= 0:
        raise _refusal(joint, key, f"= {value!r}; give a positive number")
    return float(value)


def _refusal(joint: DriveJoint, key: str, reason: str) -> DriverError:
    return DriverError(DriverErrorKind.REFUSED, f"joint {joint.name}: drive.{key} {reason}")
