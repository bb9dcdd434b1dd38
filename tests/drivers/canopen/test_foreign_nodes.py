"""Our driver against nodes of durand: their SDOs, process data, network management and heartbeats are not ours.

Only the power states and the motion of a drive, which durand leaves to its user, are written here.
"""

import struct
from collections.abc import Iterator
from pathlib import Path
from uuid import uuid4

import can
import numpy as np
import pytest

from patience import eventually
from tauscope_drivers import ControlMode, DriveLimits, Setpoint, StopPolicy
from tauscope_drivers.canopen.arm import CanopenArm
from tauscope_drivers.canopen.doctor import scan_bus
from tauscope_drivers.drive_block import DriveJoint
from tauscope_sim.driver import VirtualClock

durand = pytest.importorskip("durand")

U8, U16, U32 = (durand.DatatypeEnum[f"UNSIGNED{bits}"] for bits in (8, 16, 32))
I8, I16, I32 = (durand.DatatypeEnum[f"INTEGER{bits}"] for bits in (8, 16, 32))
COUNTS, GEAR = 4096, 10.0
START = (2000, -3000)
LIMITS = DriveLimits(*(np.full(2, value) for value in (-5.0, 5.0, 4.0, 8.0)))

_OBJECTS = {
    0x6007: (I16, 1), 0x603F: (U16, 0), 0x6040: (U16, 0), 0x6041: (U16, 0x0240), 0x605A: (I16, 2), 0x605E: (I16, 2),
    0x6060: (I8, 0), 0x6061: (I8, 0), 0x6064: (I32, 0), 0x606C: (I32, 0), 0x6071: (I16, 0), 0x6072: (U16, 2000),
    0x6076: (U32, 1000), 0x6077: (I16, 0), 0x607A: (I32, 9_999_999), 0x6502: (U32, 1 << 7 | 1 << 9),
}  # fmt: skip
_AFTER = {(0x0240, 6): 0x0221, (0x0221, 7): 0x0223, (0x0223, 15): 0x1227, (0x1227, 2): 0x0207, (0x0207, 15): 0x1227}
"""Statusword before, controlword, statusword after."""


class ForeignDrive:
    """A durand node with the objects of a drive; its joint follows its target at once."""

    def __init__(self, bus: can.BusABC, node_id: int, start: int) -> None:
        self.network = durand.CANBusNetwork(bus)
        self.node = durand.MinimalNode(self.network, node_id)
        self.objects = self.node.object_dictionary
        self.targets: list[int] = []
        for index, (kind, value) in _OBJECTS.items():
            self.objects[index] = durand.Variable(kind, "rw", value)
        for index, kind, count in ((0x1016, U32, 1), (0x607D, I32, 2)):
            self.objects[index] = durand.Array(durand.Variable(kind, "rw", 0), length=count)
        self.objects.write(0x6064, 0, start)
        self.objects.write(0x1000, 0, 0x00020192)
        self.objects.write(0x1008, 0, b"foreign drive")
        self.objects.update_callbacks[0x6040, 0].add(self._take_controlword)
        self.objects.update_callbacks[0x607A, 0].add(self._take_target)

    def read(self, index: int) -> int:
        return self.objects.read(index, 0)

    def close(self) -> None:
        self.network.stop()

    def _take_controlword(self, word: int) -> None:
        status = 0x0240 if word == 0 else _AFTER.get((self.read(0x6041), word), self.read(0x6041))
        self.objects.write(0x6041, 0, status)

    def _take_target(self, target: int) -> None:
        self.targets.append(target)
        if self.read(0x6041) == 0x1227:
            self.objects.write(0x6064, 0, target)


@pytest.fixture
def channel() -> str:
    return f"{uuid4().hex}-1"  # BLF takes the digits at its end for its number, of 16 bits


@pytest.fixture
def drives(channel: str) -> Iterator[list[ForeignDrive]]:
    buses = [can.Bus(interface="virtual", channel=channel) for _ in START]
    found = [ForeignDrive(bus, number, start) for bus, number, start in zip(buses, (4, 9), START, strict=True)]
    yield found
    for drive, bus in zip(found, buses, strict=True):
        drive.close()
        bus.shutdown()


def joints_on(channel: str) -> list[DriveJoint]:
    bus = {"interface": "virtual", "channel": channel}
    blocks = [{"node_id": 4, "counts_per_turn": COUNTS, **bus}, {"node_id": 9, "counts_per_turn": COUNTS}]
    return [DriveJoint(f"joint{number}", block, gear_ratio=GEAR) for number, block in enumerate(blocks, 1)]


@pytest.fixture
def arm(channel: str, drives: list[ForeignDrive]) -> Iterator[CanopenArm]:
    assert drives
    one = CanopenArm(joints_on(channel), patience_s=0.1)
    yield one
    one.disconnect()


def test_foreign_drives_are_found_and_read(channel: str, drives: list[ForeignDrive], arm: CanopenArm) -> None:
    assert drives
    found = [(device.address, device.model) for device in scan_bus("virtual", channel)]
    assert found == [(4, "foreign drive (profile 402)"), (9, "foreign drive (profile 402)")]
    state = arm.connect()
    np.testing.assert_allclose(state.position, np.array(START) * 2.0 * np.pi / (COUNTS * GEAR))


def test_foreign_drives_are_enabled_where_they_stand_moved_and_stopped(
    drives: list[ForeignDrive], arm: CanopenArm
) -> None:
    arm.connect()
    state = arm.enable(ControlMode.POSITION, LIMITS, StopPolicy.HOLD, 1.0)
    assert state.enabled.all()
    assert [drive.read(0x6064) for drive in drives] == list(START), "the target left over is far away"
    assert [drive.read(0x6060) for drive in drives] == [8, 8]
    place = state.position
    for _ in range(60):
        place = place + 0.002
        state = arm.exchange(Setpoint(place, np.zeros(2)))
        arm.clock.wait_until_ns(state.time_ns + 5_000_000)
    count = 2.0 * np.pi / (COUNTS * GEAR)
    moved = [drive.read(0x6064) * count for drive in drives]
    np.testing.assert_allclose(moved, place, atol=count)
    np.testing.assert_allclose(state.position[state.fresh], place[state.fresh], atol=0.01)
    arm.stop(StopPolicy.HOLD)
    assert eventually(lambda: [drive.read(0x6041) for drive in drives] == [0x0207, 0x0207])


CYCLES, CYCLE_S, STEP = 40, 0.005, 0.002
"""Of a run that is logged: how many, how long [s], and how far each of them goes [rad]."""

LENGTHS = {
    0x000: {2}, 0x080: {0, 8}, 0x180: {8}, 0x200: {6}, 0x280: {6}, 0x580: {8}, 0x600: {8}, 0x700: {1},
}  # fmt: skip
"""Bytes that a service of CANopen has: network management, SYNC or emergency, process data, SDOs, heartbeat."""


def logged_run(channel: str, joints: list[DriveJoint], log_file: Path) -> list[can.Message]:
    """A run from connecting to stopping, by python-can's own log of it; no cycle is late."""
    arm = CanopenArm(joints, patience_s=0.5, clock=VirtualClock(0, lambda _: None))
    with can.Bus(interface="virtual", channel=channel) as listener:
        arm.connect()
        state = arm.enable(ControlMode.POSITION, LIMITS, StopPolicy.HOLD, 1.0, CYCLE_S)
        place = state.position
        for _ in range(CYCLES):
            place = place + STEP
            arm.clock.wait_until_ns(state.time_ns + round(CYCLE_S * 1e9))
            state = arm.exchange(Setpoint(place, np.zeros(2)))
        arm.stop(StopPolicy.HOLD)
        arm.disconnect()
        with can.Logger(str(log_file)) as log:
            while (message := listener.recv(0.0)) is not None:
                log(message)
    return list(can.LogReader(str(log_file)))


@pytest.mark.parametrize("form", ["asc", *(pytest.param(form, marks=pytest.mark.slow) for form in ("log", "blf"))])
def test_a_run_decodes_cleanly_by_python_cans_own_log(
    channel: str, drives: list[ForeignDrive], tmp_path: Path, form: str
) -> None:
    """Every frame is one that CANopen knows, and what they hold is the run: by struct alone, not by our decoders."""
    messages = logged_run(channel, joints_on(channel), tmp_path / f"run.{form}")
    for message in messages:
        assert message.dlc in LENGTHS[message.arbitration_id & 0x780], message
        assert not message.is_error_frame
        assert not message.is_extended_id
    by_identifier = {
        identifier: [bytes(message.data) for message in messages if message.arbitration_id == identifier]
        for identifier in {message.arbitration_id for message in messages}
    }
    assert not any(data[0] == 0x80 for node in (4, 9) for data in by_identifier[0x600 + node]), "the master aborts none"
    assert by_identifier[0x000] == [b"\x80\x00", b"\x01\x00"], "pre-operational, then started"
    assert set(by_identifier[0x700 + 127]) == {b"\x05"}, "the master's heartbeat"
    count = 2.0 * np.pi / (COUNTS * GEAR)
    for node, start, drive in zip((4, 9), START, drives, strict=True):
        orders = [struct.unpack("<Hi", data) for data in by_identifier[0x200 + node]]
        moved = [target for word, target in orders if word == 0x0F and target != start]
        np.testing.assert_allclose(moved, start + np.arange(1, CYCLES + 1) * STEP / count, atol=1.0)
        elsewhere = {target for word, target in orders if word != 0x0F} - {start, *moved}
        assert not elsewhere, "without power its target is where the joint is"
        states = [struct.unpack("<Hhi", data) for data in by_identifier[0x180 + node]]
        assert {word for word, _, _ in states} <= {0x0240, 0x0221, 0x0223, 0x1227, 0x0207}
        assert drive.read(0x6064) == moved[-1]
    # one target for each node, then SYNC
    cycle = [one.arbitration_id for one in messages if one.arbitration_id in (0x204, 0x209, 0x080)]
    assert cycle == [0x204, 0x209, 0x080] * (len(cycle) // 3)
