"""What can be said of a CAN bus without moving anything: doctor, scan, and the frames of a run."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from emulated_can_bus import COUNTS_PER_TURN, GEAR, EmulatedBus
from emulated_data_sheet import sections, write_file
from tauscope_drivers import ControlMode, DriveLimits, DriverError
from tauscope_drivers.canopen.doctor import can_interfaces, examine, scan_bus
from tauscope_drivers.canopen.dry_run import plan_frames
from tauscope_drivers.drive_block import DriveJoint
from tauscope_drivers.inspection import PHASES, Finding, FrameRequest, Severity

LIMITS = DriveLimits(np.full(2, -1.0), np.full(2, 1.0), np.full(2, 2.0), np.full(2, 10.0))
JOINTS = [
    DriveJoint(
        f"joint{node}",
        {
            "node_id": node,
            "counts_per_turn": COUNTS_PER_TURN,
            "rated_torque_nm": 0.5,
            "interface": "slcan",
            "channel": "port",
        },
        gear_ratio=GEAR,
    )
    for node in (1, 2)
]


def test_sound_drives_have_nothing_to_be_mended(tmp_path: Path) -> None:
    path = Path(write_file(tmp_path, sections()))
    with EmulatedBus([path] * 3) as bus:
        findings = examine(bus.joints())
    assert {finding.severity for finding in findings} == {Severity.GOOD}
    assert sum("a per mille" in finding.detail for finding in findings) == 3
    assert "answered in" in findings[-1].detail


def test_without_its_file_a_drive_is_sound_as_far_as_reading_tells() -> None:
    with EmulatedBus() as bus:
        doubts = [finding for finding in examine(bus.joints()) if finding.severity is not Severity.GOOD]
    assert {finding.severity for finding in doubts} == {Severity.WARNING}
    assert {finding.remedy for finding in doubts} == {"name its file as drive.eds"}


def test_a_missing_drive_and_one_in_fault_are_told_with_a_remedy() -> None:
    with EmulatedBus() as bus:
        bus.drives[1].fail(0x4310)
        joints = bus.joints()
        joints[2] = replace(joints[2], drive={**joints[2].drive, "node_id": 9})
        failures = [finding for finding in examine(joints) if finding.severity is Severity.FAILURE]
    assert [finding.subject for finding in failures] == ["joint 2 (node 2)", "joint 3 (node 9)"]
    assert "0x4310" in failures[0].detail
    assert "check node number" in failures[1].remedy
    assert failures[1].detail.startswith("Device type (0x1000:00) cannot be read"), "the place is told once"


def test_doctor_and_scan_move_nothing_and_leave_every_state() -> None:
    with EmulatedBus() as bus:
        before = [drive.power.state for drive in bus.drives]
        examine(bus.joints())
        found = list(scan_bus("virtual", bus.channel))
        assert [drive.power.state for drive in bus.drives] == before
        assert bus.furthest == [0.0, 0.0, 0.0]
    assert [(device.address, device.model) for device in found] == [(n, "profile 402") for n in (1, 2, 3)]


def test_planned_frames_are_those_of_the_standard() -> None:
    """Bytes worked out by hand: expedited transfers, controlwords 6, 7, 15, and 50 · 65,536 counts a turn."""
    targets = np.array([[0.0, 0.0], [np.pi / 50.0, 0.0]])
    frames = list(plan_frames(JOINTS, FrameRequest(ControlMode.POSITION, LIMITS, 0.1, targets)))
    wires = [frame.wire for frame in frames]
    assert wires[0] == "000#8000"
    assert "601#2F60600008000000" in wires, "cyclic synchronous position"
    assert "601#2B5A600006000000" in wires, "quick stop, then hold"
    assert "602#2316100164007F00" in wires, "watch node 127 for 100 ms"
    assert not any(wire.startswith("601#") and "C260" in wire for wire in wires), "nobody knows the cycle"
    assert "601#2B72600090010000" in wires, "10 Nm are 400 per mille of 0.5 Nm behind the gear"
    enabling = [frame.wire for frame in frames if frame.phase == "enable" and frame.wire.startswith("201#")]
    assert enabling == ["201#060000000000", "201#070000000000", "201#0F0000000000"]
    cycle = [frame.wire for frame in frames if frame.phase == "cycle"]
    # half a motor turn
    assert cycle == ["201#0F0000000000", "202#0F0000000000", "080#", "201#0F0000800000", "202#0F0000000000", "080#"]
    assert frames[-3].wire == "201#020000800000"
    assert sorted({frame.phase for frame in frames}, key=PHASES.index) == list(PHASES)


def test_drives_are_told_the_cycle() -> None:
    frames = list(plan_frames(JOINTS, FrameRequest(ControlMode.POSITION, LIMITS, 0.1, np.zeros((1, 2)), 0.005)))
    assert "602#2FC2600105000000" in [frame.wire for frame in frames], "5 units, of a millisecond as delivered"


def test_a_dry_run_needs_the_rated_torque() -> None:
    joints = [replace(JOINTS[0], drive={key: v for key, v in JOINTS[0].drive.items() if key != "rated_torque_nm"})]
    limits = DriveLimits(*(np.full(1, value) for value in (-1.0, 1.0, 2.0, 10.0)))
    with pytest.raises(DriverError, match="rated_torque_nm"):
        list(plan_frames(joints, FrameRequest(ControlMode.POSITION, limits, 0.1, np.zeros((1, 1)))))


@pytest.mark.parametrize(
    ("flags", "severity", "words", "remedy"),
    [
        ("0x1", Severity.GOOD, "CAN interface, up", ""),
        ("0x0", Severity.WARNING, "CAN interface, down", "ip link set can7 up type can bitrate 1000000"),
    ],
)
def test_can_interfaces_of_the_machine(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, flags: str, severity: Severity, words: str, remedy: str
) -> None:
    for name, kind in (("can7", "280"), ("eth0", "1")):
        (tmp_path / name).mkdir()
        (tmp_path / name / "type").write_text(f"{kind}\n")
        (tmp_path / name / "flags").write_text(f"{flags}\n")
    monkeypatch.setattr("tauscope_drivers.canopen.doctor._NETWORK", tmp_path)
    assert can_interfaces() == [Finding(severity, "can7", words, remedy)]


def test_a_rated_torque_in_another_unit_is_told() -> None:
    with EmulatedBus([None]) as bus:
        bus.drives[0].dictionary.put(0x6076, 512_871)
        (joint,) = bus.joints()
        findings = examine([replace(joint, torque_limit=20.0)])
    (doubt,) = [finding for finding in findings if "rated torque" in finding.detail]
    assert doubt.severity is Severity.WARNING
    assert "is taken in µNm, 0.512871 Nm" in doubt.detail
    assert doubt.remedy == "state drive.rated_torque_nm to settle it"


def test_limits_are_checked_all_at_once() -> None:
    with EmulatedBus([None]) as bus:
        bus.drives[0].dictionary.put(0x6072, 0)
        (joint,) = bus.joints()
        findings = examine([replace(joint, position_range=(1.0, 2.0))])
    failures = [finding.detail for finding in findings if finding.severity is Severity.FAILURE]
    assert ["stands at 0.3, outside its limits 1 to 2" in failures[0], len(failures)] == [True, 2]
    assert failures[1] == "Max torque (0x6072:00) leaves no torque"
