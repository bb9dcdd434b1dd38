"""What the driver needs to know of each joint's drive, from the robot file's ``drive`` blocks.

On each joint: ``{node_id: 3, counts_per_turn: 65536}`` and, where they differ from the defaults, the other keys of
`NodeConfiguration`; ``eds`` is the path of the drive's EDS or DCF file. The bus is the same for all joints and stands
on the first: ``interface`` and ``channel`` as python-can takes them, ``bit_rate``, and ``options`` for what the
interface takes besides.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tauscope_drivers import drive_block
from tauscope_drivers.backend import ControlMode
from tauscope_drivers.canopen import objects
from tauscope_drivers.canopen.data_sheet import needs
from tauscope_drivers.canopen.data_sheet.device_file import DataSheetError, DeviceFile, read_device_file, settings_of
from tauscope_drivers.canopen.interfaces import OWN_OPTIONS
from tauscope_drivers.canopen.objects import describe_absent
from tauscope_drivers.errors import DriverError
from tauscope_drivers.inspection import Finding, Severity, failure

_HIGHEST_NODE = 127
_BUS_KEYS = ("interface", "channel", "bit_rate", "serial_baud", "options")
_NODE_KEYS = ("node_id", "counts_per_turn", "zero_count", "direction", "rated_torque_nm", "eds")


@dataclass(frozen=True)
class NodeConfiguration:
    """One drive. `rated_torque_nm`: at the motor shaft, in place of 0x6076, which makers scale differently [Nm]."""

    node_id: int
    counts_per_turn: float
    gear_ratio: float
    zero_count: int = 0
    direction: int = 1
    rated_torque_nm: float | None = None
    device_file: DeviceFile | None = None
    torque_limit: float | None = None  # of the joint; None where there is none [Nm or N]


@dataclass(frozen=True)
class BusConfiguration:
    """The bus and the drives on it, in the order of the joints."""

    nodes: tuple[NodeConfiguration, ...]
    interface: str
    channel: str
    bit_rate: int = 1_000_000
    serial_baud: float | None = None  # of an adapter on a true serial line [bit/s]
    options: Mapping[str, Any] = field(default_factory=dict)


def read_configuration(joints: Sequence[drive_block.DriveJoint]) -> BusConfiguration:
    """Bus and drives of an arm. Raises DriverError ``refused``: names joint and key, or what an EDS or DCF lacks."""
    first = joints[0]
    drive_block.require_known_keys(joints, _BUS_KEYS, _NODE_KEYS)
    nodes = tuple(read_node(joint) for joint in joints)
    drive_block.require_distinct(joints, "node_id")
    return BusConfiguration(
        nodes=nodes,
        interface=drive_block.read_text(first, "interface", "name it as python-can does"),
        channel=drive_block.read_text(first, "channel", "name it as python-can does"),
        bit_rate=drive_block.read_whole(first, "bit_rate", 1_000_000, least=10_000, most=1_000_000),
        serial_baud=drive_block.read_positive(first, "serial_baud"),
        options=_options(first),
    )


def require_targets(configuration: BusConfiguration, mode: ControlMode) -> None:
    """Refuse a mode whose targets a drive's EDS or DCF lacks. Raises DriverError ``refused``: joint and object."""
    for joint, node in enumerate(configuration.nodes, 1):
        if node.device_file is None:
            continue
        try:
            needs.refuse(needs.find_target_flaws(node.device_file, mode))
        except DataSheetError as error:
            text = f"joint {joint} (node {node.node_id}): {node.device_file.name}: {error}"
            raise DriverError.refusal(text) from error


def read_node(joint: drive_block.DriveJoint) -> NodeConfiguration:
    """The drive of a joint. Raises DriverError ``refused`` as `read_configuration`."""
    counts_per_turn = drive_block.read_positive(joint, "counts_per_turn")
    if counts_per_turn is None:
        raise drive_block.refusal(joint, "counts_per_turn", "is missing; give the position counts of a motor turn")
    node_id = drive_block.read_whole(joint, "node_id", None, least=1, most=_HIGHEST_NODE)
    rated_torque_nm = drive_block.read_positive(joint, "rated_torque_nm")
    return NodeConfiguration(
        node_id=node_id,
        counts_per_turn=counts_per_turn,
        gear_ratio=joint.gear_ratio,
        zero_count=drive_block.read_whole(joint, "zero_count", 0, least=-(2**31), most=2**31 - 1),
        direction=drive_block.read_direction(joint),
        rated_torque_nm=rated_torque_nm,
        device_file=_device_file(joint, node_id, reads_rated_torque=rated_torque_nm is None),
        torque_limit=joint.torque_limit,
    )


def _options(joint: drive_block.DriveJoint) -> Mapping[str, Any]:
    options = joint.drive.get("options", {})
    if not isinstance(options, Mapping) or not all(isinstance(value, str | int | float) for value in options.values()):
        raise drive_block.refusal(
            joint, "options", f"= {options!r}; give what python-can takes, as in {{host: 192.168.1.5}}"
        )
    for name in options:
        if name in OWN_OPTIONS:
            raise drive_block.refusal(joint, f"options.{name}", "has a key of its own: interface, channel, bit_rate")
    return dict(options)


def _device_file(joint: drive_block.DriveJoint, node_id: int, *, reads_rated_torque: bool) -> DeviceFile | None:
    """The EDS or DCF file of a joint's drive, which describes one that the driver can use; None where none is given."""
    path = joint.drive.get("eds")
    if path is None:
        return None
    if not isinstance(path, str) or not path:
        raise drive_block.refusal(joint, "eds", f"= {path!r}; give the path of the drive's EDS or DCF file")
    try:
        file = read_device_file(Path(path), node_id)
        if file.node_id not in (None, node_id):
            raise DataSheetError(
                f"is made for node {file.node_id}; correct drive.node_id, or give the file of this node"
            )
        needs.refuse(needs.find_flaws(file, reads_rated_torque=reads_rated_torque))
        settings_of(file)
    except DataSheetError as error:
        raise drive_block.refusal(joint, "eds", f"= {path!r}: {error}") from error
    return file


def check_blocks(joints: Sequence[drive_block.DriveJoint]) -> list[Finding]:
    """Flaws of every joint at once; of usable drives, the absent objects and their substitutes."""
    findings: list[Finding] = []
    without: list[str] = []
    for joint in joints:
        place = f"joint {joint.name}"
        try:
            node = read_node(joint)
        except DriverError as error:
            findings.append(failure(place, str(error)))
            continue
        findings += _describe_file(place, node)
        without += [joint.name] if node.device_file is None else []
    if without:
        remedy = "name it as drive.eds: then its objects and mappings are known before a run"
        findings.append(Finding(Severity.WARNING, f"joint {', '.join(without)}", "no EDS or DCF file", remedy))
    if any(finding.severity is Severity.FAILURE for finding in findings):
        return findings
    try:
        read_configuration(joints)
    except DriverError as error:
        findings.append(failure("canopen", str(error)))
    return findings


def _describe_file(place: str, node: NodeConfiguration) -> list[Finding]:
    file = node.device_file
    if file is None:
        return []
    absent = [objects.GUARDED] if needs.needs_guarding(file) else []
    absent += describe_absent(needs.present_objects(file))
    doubts: list[Finding] = []
    if node.rated_torque_nm is None and not needs.states_rated_torque(file):
        detail = f"{file.name} has no {objects.RATED_TORQUE}: torque in ‰ of it means nothing, and a run is refused"
        doubts.append(Finding(Severity.WARNING, place, detail, "state drive.rated_torque_nm"))
    usable = Finding(Severity.GOOD, place, f"{file.name} describes all that the driver needs")
    return [usable, *doubts, *(Finding(Severity.GOOD, place, f"{file.name} {line}") for line in absent)]
