"""Looks at a CAN bus and the drives on it, moves nothing, writes nothing, and says what to do about what it finds."""

import time
from collections.abc import Iterator, Sequence
from contextlib import closing
from pathlib import Path

import numpy as np

from tauscope_drivers.backend import ControlMode, DriveLimits
from tauscope_drivers.canopen import objects
from tauscope_drivers.canopen.bus import CanBus
from tauscope_drivers.canopen.commissioning import find_missing, read_mapping, require_plan
from tauscope_drivers.canopen.configuration import BusConfiguration, read_configuration
from tauscope_drivers.canopen.data_sheet.device_file import DeviceFile, settings_of
from tauscope_drivers.canopen.node import DriveNode
from tauscope_drivers.canopen.objects import DOUBTFUL, TARGETS
from tauscope_drivers.canopen.process_data import decode_mapping, largest_rate_hz
from tauscope_drivers.canopen.session import cycle_load
from tauscope_drivers.canopen.state_machine import POWERED
from tauscope_drivers.drive_block import DriveJoint
from tauscope_drivers.errors import DriverError
from tauscope_drivers.inspection import Finding, FoundDevice, Severity, failure
from tauscope_drivers.limits import require_sensible, stated_limits

MEASURED_READS = 50  # reads by which the round trip is measured

_NETWORK = Path("/sys/class/net")
_CAN_DEVICE_TYPE = "280"


def can_interfaces() -> list[Finding]:
    """Every CAN interface that this system's network knows, and whether it is up."""
    found: list[Finding] = []
    for interface in sorted(_NETWORK.glob("*")):
        if _read(interface / "type") != _CAN_DEVICE_TYPE:
            continue
        name = interface.name
        if int(_read(interface / "flags") or "0", 16) & 1:
            found.append(Finding(Severity.GOOD, name, "CAN interface, up"))
        else:
            remedy = f"ip link set {name} up type can bitrate 1000000"
            found.append(Finding(Severity.WARNING, name, "CAN interface, down", remedy))
    return found


def examine(joints: Sequence[DriveJoint]) -> list[Finding]:
    """Bus, and every drive that the robot file names. Raises DriverError ``refused``: a ``drive`` block is invalid."""
    configuration = read_configuration(joints)
    subject = f"{configuration.interface} {configuration.channel}"
    try:
        with closing(CanBus(configuration)) as bus:
            opened = Finding(Severity.GOOD, subject, f"open, {configuration.bit_rate / 1e3:g} kbit/s")
            return [opened, *_examine_drives(bus, configuration, joints, subject)]
    except DriverError as error:
        return [failure(subject, str(error))]


def _examine_drives(
    bus: CanBus, configuration: BusConfiguration, joints: Sequence[DriveJoint], subject: str
) -> list[Finding]:
    findings: list[Finding] = []
    sound: list[DriveNode] = []
    for joint, wanted in enumerate(configuration.nodes, 1):
        node = DriveNode.on_bus(bus, wanted, joint)
        try:
            findings += _examine_drive(node, joints[joint - 1])
        except DriverError as error:
            findings.append(failure(node.place, str(error), f"node {wanted.node_id}"))
            continue
        sound.append(node)
    if len(sound) == len(configuration.nodes):
        findings.append(_loop_rate(configuration, sound, subject))
    return findings


def _examine_drive(node: DriveNode, joint: DriveJoint) -> list[Finding]:
    modes = node.identify()
    dictionary = node.dictionary
    name = dictionary.read_text(objects.DEVICE_NAME) or "a drive without a name"
    version = dictionary.read_text(objects.SOFTWARE_VERSION) or "unknown"
    torque = abs(node.units.torque_per_permille)
    findings = [Finding(Severity.GOOD, node.place, f"{name}, firmware {version}, {torque:.4g} Nm a per mille")]
    if node.configuration.device_file is not None:
        findings += _examine_file(node.configuration.device_file, node.place)
    missing = [str(mode) for mode in TARGETS if mode not in modes]
    if missing:
        detail = f"has no cyclic synchronous {' and '.join(missing)} mode (0x6502)"
        severity = Severity.FAILURE if len(missing) == len(TARGETS) else Severity.WARNING
        findings.append(Finding(severity, node.place, detail, "run the arm in the other mode, or update its firmware"))
    node.read_now()
    findings += [Finding(Severity.FAILURE, node.place, fault.detail, fault.remedy) for fault in node.faults()]
    if node.state in POWERED:
        remedy = "none where it holds the arm; else support the arm and switch it off"
        findings.append(Finding(Severity.WARNING, node.place, f"is under power: {node.state}", remedy))
    findings += [_remark(node.place, remark) for remark in node.remarks]
    findings += rehearse(node, joint)
    return findings


def _remark(place: str, remark: str) -> Finding:
    """What a drive does not have, and the substitute: a warning where an operator has to try it."""
    if "is taken in" in remark:
        return Finding(Severity.WARNING, place, remark, "state drive.rated_torque_nm to settle it")
    if any(str(entry) in remark for entry in DOUBTFUL):
        detail, _, effect = remark.partition(": ")
        return Finding(Severity.WARNING, place, detail, effect)
    return Finding(Severity.GOOD, place, remark)


def _examine_file(file: DeviceFile, place: str) -> list[Finding]:
    """What the EDS or DCF file is good for; that it describes the drive on the bus has been made sure of."""
    stated = (("vendor", file.vendor), ("product", file.product), ("revision", file.revision))
    identity = ", ".join(f"{name} 0x{number:X}" for name, number in stated if number is not None)
    describes = f"{file.name} describes all that the driver needs; {identity or 'it states no identity'}"
    findings = [Finding(Severity.GOOD, place, describes)]
    settings = settings_of(file)
    if settings.written:
        given = ", ".join(f"{one.entry} = {one.text}" for one in settings.written)
        findings.append(Finding(Severity.GOOD, place, f"{file.name} gives it, before each run: {given}"))
    for reason, described in settings.left_out.items():
        subindices: dict[int, list[str]] = {}
        for one in described:
            subindices.setdefault(one.index, []).append(f"{one.subindex:02X}")
        places = ", ".join(f"0x{index:04X}:{'/'.join(found)}" for index, found in subindices.items())
        detail = f"{file.name} has values that are not written ({reason}): {places}"
        findings.append(Finding(Severity.GOOD, place, detail))
    return findings


def _loop_rate(configuration: BusConfiguration, nodes: Sequence[DriveNode], subject: str) -> Finding:
    begin_ns = time.monotonic_ns()
    for read in range(MEASURED_READS):
        nodes[read % len(nodes)].dictionary.read(objects.STATUSWORD)
    round_trip_ms = (time.monotonic_ns() - begin_ns) * 1e-6 / MEASURED_READS
    possible = largest_rate_hz(*cycle_load(configuration))
    detail = f"a question is answered in {round_trip_ms:.2f} ms; a whole cycle gets {possible:.0f} Hz at most"
    return Finding(Severity.GOOD, subject, detail)


def _read(path: Path) -> str:
    try:
        return path.read_text(encoding="ascii").strip()
    except OSError:
        return ""


# tried one after the other where the interface sets the rate [bit/s]
USUAL_BIT_RATES = (1_000_000, 500_000, 250_000, 125_000)
LISTENING_S = 0.3  # time in which all nodes answer
_FIXED_RATE = ("socketcan", "socketcand", "virtual", "udp_multicast")  # interfaces whose rate is set elsewhere

_NODES = range(1, 128)
_UPLOAD = 0x40
_PACING_S = 0.0005


def scan_bus(interface: str, channel: str, bit_rates: Sequence[int] | None = None) -> Iterator[FoundDevice]:
    """Every node that answers, one bit rate after the other: at a wrong one this disturbs a bus that is in use.

    Raises DriverError ``cannot-connect``. `bit_rates`: to try [bit/s]; None: the usual ones, or the interface's own.
    """
    if bit_rates is None:
        bit_rates = USUAL_BIT_RATES[:1] if interface in _FIXED_RATE else USUAL_BIT_RATES
    for bit_rate in bit_rates:
        with closing(CanBus(BusConfiguration((), interface, channel, bit_rate))) as bus:
            for node, device_type in sorted(_answers(bus).items()):
                dictionary = bus.add_node(node)
                name, version = map(dictionary.read_text, (objects.DEVICE_NAME, objects.SOFTWARE_VERSION))
                profile = f"profile {device_type & 0xFFFF}"
                yield FoundDevice(node, bit_rate, f"{name} ({profile})" if name else profile, version)


def _answers(bus: CanBus) -> dict[int, int]:
    found: dict[int, int] = {}

    def take(identifier: int, data: bytes) -> None:
        if len(data) == 8 and data[1:4] == bytes([0x00, 0x10, 0x00]) and data[0] & 0xE0 == _UPLOAD:
            found[identifier - 0x580] = int.from_bytes(data[4:8], "little")

    for node in _NODES:
        bus.subscribe(0x580 + node, take)
    for node in _NODES:
        bus.send(0x600 + node, bytes([_UPLOAD, 0x00, 0x10, 0, 0, 0, 0, 0]))
        bus.receive(time.monotonic_ns() + round(_PACING_S * 1e9))
    deadline = time.monotonic_ns() + round(LISTENING_S * 1e9)
    while time.monotonic_ns() < deadline:
        bus.receive(deadline)
    return found


def rehearse(node: DriveNode, joint: DriveJoint) -> list[Finding]:
    """What would keep a run with the limits of the robot file from starting. `node`: identified and read."""
    findings: list[Finding] = []
    checks = (_examine_settings, _examine_place, _examine_torque, _examine_mapping, _examine_abort, _examine_guarding)
    for check in checks:
        try:
            findings += check(node, stated_limits([joint]))
        except DriverError as error:
            findings.append(failure(node.place, str(error), f"node {node.configuration.node_id}"))
    return findings


def _examine_settings(node: DriveNode, _: DriveLimits) -> list[Finding]:
    """Values of its DCF file: it has their objects, and no power while one is missing."""
    if node.configuration.device_file is not None:
        find_missing(node, node.configuration.device_file)
    return []


def _examine_place(node: DriveNode, limits: DriveLimits) -> list[Finding]:
    place = node.units.position(node.dictionary.read(objects.POSITION_ACTUAL))
    require_sensible(limits, np.array([place]), [node.place])
    return []


def _examine_torque(node: DriveNode, limits: DriveLimits) -> list[Finding]:
    if not node.has(objects.LARGEST_TORQUE):
        return []
    cap = node.dictionary.read(objects.LARGEST_TORQUE)
    if np.isfinite(limits.torque[0]):
        cap = min(cap, node.units.torque_cap(float(limits.torque[0])))
    if cap > 0:
        return []
    remedy = "raise it with the maker's tool, and check limits.torque and rated_torque_nm"
    return [Finding(Severity.FAILURE, node.place, f"{objects.LARGEST_TORQUE} leaves no torque", remedy)]


def _examine_mapping(node: DriveNode, _: DriveLimits) -> list[Finding]:
    """Whether its PDOs hold all that is needed, or can be mapped so."""
    if ControlMode.POSITION not in node.mode_numbers:
        return []
    plan = require_plan(node, ControlMode.POSITION)
    if node.configuration.device_file is not None:
        for pdo in (pdo for pdo in (*plan.received, *plan.sent) if pdo.is_fixed):
            held = decode_mapping(read_mapping(node, pdo.direction.parameters(pdo.number, 0)))
            if held != pdo.layout.objects:
                detail = f"its PDO {pdo.number + 1} is not mapped as its EDS or DCF file states"
                return [Finding(Severity.FAILURE, node.place, detail, "give the file of this drive")]
        return []
    detail = "has no EDS or DCF file: whether its objects and PDOs can be written shows only when a run writes them"
    return [Finding(Severity.WARNING, node.place, detail, "name its file as drive.eds")]


def _examine_abort(node: DriveNode, _: DriveLimits) -> list[Finding]:
    """A drive does something when its master is silent."""
    if node.has(objects.ABORT_CONNECTION) or node.dictionary.read_optional(objects.ABORT_CONNECTION) != 0:
        return []
    detail = f"{objects.ABORT_CONNECTION} is 0 and read-only: it goes on when the host is gone"
    return [Finding(Severity.FAILURE, node.place, detail, "set it to 1, 2 or 3 with the maker's tool")]


def _examine_guarding(node: DriveNode, _: DriveLimits) -> list[Finding]:
    """Remote frames reach a drive that is guarded; one that counts already, or produces heartbeats, is not asked."""
    read = node.dictionary.read_optional
    beats = read(objects.PRODUCER_HEARTBEAT)
    if not node.is_guarded or all(map(read, objects.GUARDING)):
        return []
    if beats and not node.has(objects.PRODUCER_HEARTBEAT):
        detail = f"{objects.PRODUCER_HEARTBEAT} is {beats} ms and read-only: such a drive is not guarded"
        return [Finding(Severity.FAILURE, node.place, detail, "set it to 0 with the maker's tool")]
    if not beats:
        node.require_guarding()
    return []
