"""The frames that a run would send, without a bus: ``identifier#payload``, as can-utils write them."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from typing_extensions import override

from tauscope_drivers.backend import ControlMode, StopPolicy
from tauscope_drivers.canopen import bus, objects
from tauscope_drivers.canopen.commissioning import commission_drive, write_settings
from tauscope_drivers.canopen.configuration import NodeConfiguration, read_configuration, require_targets
from tauscope_drivers.canopen.data_sheet.needs import needs_guarding, pdo_slots, present_objects
from tauscope_drivers.canopen.node import DriveNode
from tauscope_drivers.canopen.objects import DriveObject, select_modes
from tauscope_drivers.canopen.sdo import NodeDictionary
from tauscope_drivers.canopen.state_machine import DriveState, Goal, next_controlword
from tauscope_drivers.canopen.units import drive_units
from tauscope_drivers.drive_block import DriveJoint
from tauscope_drivers.errors import DriverError
from tauscope_drivers.inspection import FrameRequest, PlannedFrame
from tauscope_drivers.limits import require_sensible

_TO_POWER = (DriveState.SWITCH_ON_DISABLED, DriveState.READY, DriveState.SWITCHED_ON)
_DOWNLOAD, _LONG_DOWNLOAD, _UPLOAD = 0x23, 0x21, 0x40
_ALL_MODES = 0xFFFF
_AS_DELIVERED = {
    objects.LARGEST_TORQUE: b"\xff\xff",
    objects.INTERPOLATION_VALUE: b"\x01",
    objects.INTERPOLATION_EXPONENT: b"\xfd",  # milliseconds
}


class _PlannedDictionary(NodeDictionary):
    """A node's object dictionary without a bus: keeps what is written and turns it into frames."""

    def __init__(self, configuration: NodeConfiguration, label: str) -> None:
        self.frames: list[PlannedFrame] = []
        self.node_id = configuration.node_id
        self._label = label
        self._data = dict(_AS_DELIVERED)
        self.guarded: set[int] = set()

    @override
    def read_data(self, entry: DriveObject) -> bytes:
        self._add(f"{entry}?", bytes([_UPLOAD]) + _place(entry) + bytes(4))
        return self._data.get(entry, b"")

    @override
    def send_data(self, entry: DriveObject, data: bytes, text: str) -> None:
        self._data[entry] = data
        if len(data) > 4:
            payload = bytes([_LONG_DOWNLOAD]) + _place(entry) + len(data).to_bytes(4, "little")
            self._add(f"{entry} := {text}, {len(data)} bytes in segments", payload)
            return
        command = _DOWNLOAD | (4 - len(data)) << 2
        self._add(f"{entry} := {text}", bytes([command]) + _place(entry) + data.ljust(4, b"\0"))

    def subscribe(self, identifier: int, handler: bus.FrameHandler) -> None:
        """Nobody answers."""

    def ask_guard(self, node_id: int) -> bool:
        self.frames.append(
            PlannedFrame("enable", f"{self._label}: guarded, alive?", f"{bus.HEARTBEAT_ID + node_id:03X}#R")
        )
        return True

    def _add(self, meaning: str, payload: bytes) -> None:
        self.frames.append(_frame("enable", f"{self._label}: {meaning}", 0x600 + self.node_id, payload))


def plan_frames(joints: Sequence[DriveJoint], request: FrameRequest) -> Iterator[PlannedFrame]:
    """Frames of a connection, of enabling, of some cycles and of a stop; a heartbeat is shown once.

    Raises DriverError ``refused``. `joints`: base first; each ``drive`` block has to state ``rated_torque_nm``.
    """
    mode, limits, targets, cycle_s = request.mode, request.limits, request.targets, request.cycle_s
    configuration = read_configuration(joints)
    require_targets(configuration, mode)
    nodes = [_plan_node(number, wanted) for number, wanted in enumerate(configuration.nodes, 1)]
    require_sensible(limits, targets[0], [node.place for node, _ in nodes])
    yield _frame("connect", "all nodes: pre-operational", bus.NMT_ID, bytes([bus.NMT_PRE_OPERATIONAL, 0]))
    for node, _ in nodes:
        write_settings(node)
    for node, dictionary in nodes:
        commission_drive(node, mode, limits, StopPolicy.HOLD, request.watchdog_s, cycle_s)
        yield from dictionary.frames
    yield _frame("enable", "master: alive", bus.HEARTBEAT_ID + bus.MASTER_NODE, bytes([0x05]))
    yield _frame("enable", "all nodes: operational", bus.NMT_ID, bytes([bus.NMT_START, 0]))
    for state in _TO_POWER:
        word = next_controlword(state, Goal.OPERATION_ENABLED)
        yield from _cycle([node for node, _ in nodes], mode, "enable", word, targets[0])
    word = next_controlword(DriveState.OPERATION_ENABLED, Goal.OPERATION_ENABLED)
    for position in targets:
        yield from _cycle([node for node, _ in nodes], mode, "cycle", word, position)
    word = next_controlword(DriveState.OPERATION_ENABLED, Goal.QUICK_STOP)
    yield from _cycle([node for node, _ in nodes], mode, "stop", word, targets[-1])


def _plan_node(joint: int, configuration: NodeConfiguration) -> tuple[DriveNode, _PlannedDictionary]:
    """A drive that nobody has asked, in the units that the robot file states."""
    label = f"joint {joint} (node {configuration.node_id})"
    if configuration.rated_torque_nm is None:
        raise DriverError.refusal(
            f"{label}: only the drive knows its rated torque (0x6076); state drive.rated_torque_nm for a dry run"
        )
    dictionary = _PlannedDictionary(configuration, label)
    bus_too: Any = dictionary
    node = DriveNode(configuration, joint, dictionary, bus=bus_too)
    node.units = drive_units(configuration, configuration.rated_torque_nm)
    node.mode_numbers = select_modes(_ALL_MODES)
    if configuration.device_file is not None:
        node.is_guarded = needs_guarding(configuration.device_file)
        node.present, node.slots = present_objects(configuration.device_file), pdo_slots(configuration.device_file)
        supported = configuration.device_file.objects[objects.SUPPORTED_MODES.index, 0].default
        node.mode_numbers = select_modes(supported or _ALL_MODES)
    return node, dictionary


def _cycle(
    nodes: Sequence[DriveNode], mode: ControlMode, phase: str, word: int, position: NDArray[np.float64]
) -> Iterator[PlannedFrame]:
    for node, place in zip(nodes, position, strict=True):
        what = f"{place:.4f}" if mode is ControlMode.POSITION else "0"
        for identifier, payload in node.targets(mode, word, float(place), 0.0):
            yield _frame(phase, f"{node.place}: controlword 0x{word:04X}, target {mode} {what}", identifier, payload)
    yield _frame(phase, "all nodes: SYNC", bus.SYNC_ID, b"")


def _place(entry: DriveObject) -> bytes:
    return entry.index.to_bytes(2, "little") + bytes([entry.subindex])


def _frame(phase: str, meaning: str, identifier: int, payload: bytes) -> PlannedFrame:
    return PlannedFrame(phase, meaning, f"{identifier:03X}#{payload.hex().upper()}")
