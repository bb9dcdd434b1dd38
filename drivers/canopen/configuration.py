"""What the driver needs to know of each joint's drive, from the robot file's ``drive`` blocks.

On each joint: ``{node_id: 3, counts_per_turn: 65536}`` and, where they differ from the defaults, the other keys of
`NodeConfiguration`. The bus is the same for all joints and stands on the first: ``interface`` and ``channel`` as
python-can takes them, ``bit_rate``.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from drivers.drive_block import (
    read_direction,
    read_positive,
    read_text,
    read_whole,
    refusal,
    require_distinct,
    require_known_keys,
)

_HIGHEST_NODE = 127
_BUS_KEYS = ("interface", "channel", "bit_rate", "serial_baud", "eds")
_NODE_KEYS = ("node_id", "counts_per_turn", "zero_count", "direction", "rated_torque_nm")


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
    require_known_keys(joints, _BUS_KEYS, _NODE_KEYS)
    nodes = tuple(_node(joint) for joint in joints)
    require_distinct(joints, "node_id")
    return BusConfiguration(
        nodes=nodes,
        interface=read_text(first, "interface", "name it as python-can does"),
        channel=read_text(first, "channel", "name it as python-can does"),
        bit_rate=read_whole(first, "bit_rate", 1_000_000, least=10_000, most=1_000_000),
        serial_baud=read_positive(first, "serial_baud"),
    )


def _node(joint: DriveJoint) -> NodeConfiguration:
    """The drive of a joint."""
    counts_per_turn = read_positive(joint, "counts_per_turn")
    if counts_per_turn is None:
        raise refusal(joint, "counts_per_turn", "is missing; give the position counts of a motor turn")
    return NodeConfiguration(
        node_id=read_whole(joint, "node_id", None, least=1, most=_HIGHEST_NODE),
        counts_per_turn=counts_per_turn,
        gear_ratio=joint.gear_ratio,
        zero_count=read_whole(joint, "zero_count", 0, least=-(2**31), most=2**31 - 1),
        direction=read_direction(joint),
        rated_torque_nm=read_positive(joint, "rated_torque_nm"),
    )
