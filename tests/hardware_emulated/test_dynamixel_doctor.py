"""Doctor, scan and dry run."""

from pathlib import Path

import numpy as np
import pytest

from hardware_emulated.servo_bench import SLACK_S, Bench, bench, limits
from tauscope_drivers import ControlMode, DriverError
from tauscope_drivers.drive_block import DriveJoint
from tauscope_drivers.dynamixel.doctor import examine, scan_bus
from tauscope_drivers.dynamixel.dry_run import plan_frames
from tauscope_drivers.dynamixel.packets import DynamixelParser
from tauscope_drivers.inspection import PHASES, FoundDevice, FrameRequest, Severity
from tauscope_sim.dynamixel_bus import ServoSpecification
from tauscope_sim.emulation import FaultKind, InjectedFault


def joints(one: Bench, torque_constant: float | None = 0.01) -> list[DriveJoint]:
    return [
        DriveJoint(f"joint{number}", drive, torque_per_unit=torque_constant)
        for number, drive in enumerate(one.drives, 1)
    ]


def test_sound_arm_has_no_failures(tmp_path: Path) -> None:
    with bench(tmp_path) as one:
        findings = examine(joints(one), slack_s=SLACK_S)
        assert not [finding for finding in findings if finding.severity is Severity.FAILURE]
        text = " | ".join(f"{finding.subject}: {finding.detail}" for finding in findings)
        assert "locked for this program" in text
        assert "XM430-W350" in text
        assert "firmware 52" in text
        assert "2.69 mA a unit (ROBOTIS Dynamixel2Arduino" in text
        assert "times a second" in text
        # It only looks: return delay and torque are as they were.
        assert one.emulator.get(1, "Return Delay Time") == 250
        assert not any(one.emulator.state["enabled"])


def test_every_finding_comes_with_a_remedy(tmp_path: Path) -> None:
    servos = (
        ServoSpecification(1, firmware=40, registers={"Drive Mode": 4, "Torque Enable": 1, "Bus Watchdog": -1}),
        ServoSpecification(2, registers={"Current Limit": 0}),
        ServoSpecification(3, model_number=1060),
    )
    with bench(tmp_path, servos) as one:
        one.emulator.inject(InjectedFault(FaultKind.OVERLOAD, 2))
        asked = [*joints(one, None), DriveJoint("joint4", {"id": 9})]
        findings = examine(asked, slack_s=SLACK_S)
    troubles = [finding for finding in findings if finding.severity is not Severity.GOOD]
    assert all(finding.remedy for finding in troubles)
    text = " | ".join(f"{finding.subject}: {finding.detail}" for finding in troubles)
    for expected in (
        "firmware 40 is old",
        "Return Delay Time 500 µs",
        "Drive Mode 4",
        "is under torque",
        "heard no instruction",
        "Current Limit is 0",
        "overload",
        "does not measure current",
        "joint joint4 (servo 9): does not answer",
        "no torque constant",
    ):
        assert expected in text


def test_port_that_is_missing_or_held_is_a_finding(tmp_path: Path) -> None:
    (finding,) = examine([DriveJoint("joint1", {"id": 1, "port": str(tmp_path / "none")})])
    assert (finding.severity, finding.detail) == (Severity.FAILURE, f"port {tmp_path / 'none'} is not there")
    with bench(tmp_path) as one:
        one.arm().connect()
        (finding,) = examine(joints(one))
        assert "is held by process" in finding.detail
        assert "end that program" in finding.remedy


def test_scan_finds_servos_at_their_baud_rate(tmp_path: Path) -> None:
    servos = (ServoSpecification(1, baud=3_000_000), ServoSpecification(7, model_number=2020, baud=3_000_000))
    with bench(tmp_path, servos) as one:
        found = list(scan_bus(one.emulator.order.port, [1_000_000, 3_000_000], slack_s=SLACK_S))
    assert found == [FoundDevice(1, 3_000_000, "XM430-W350", "52"), FoundDevice(7, 3_000_000, "PH54-200-S500", "52")]


@pytest.mark.parametrize("baud", [57_600, 4_500_000])
def test_slow_and_fast_rates_work(tmp_path: Path, baud: int) -> None:
    with bench(tmp_path, (ServoSpecification(1, baud=baud),)) as one:
        assert one.arm().connect().fresh.all()


@pytest.mark.parametrize("mode", list(ControlMode))
def test_dry_run_plans_what_a_run_sends(tmp_path: Path, mode: ControlMode) -> None:
    named = [
        DriveJoint(f"joint{n}", {"id": n, "port": "/dev/none", "model": "XM430-W350"}, torque_per_unit=0.01)
        for n in (1, 2, 3)
    ]
    planned = list(plan_frames(named, FrameRequest(mode, limits(3), 0.1, np.zeros((2, 3)))))
    assert [frame.phase for frame in planned] == sorted((frame.phase for frame in planned), key=PHASES.index)
    for frame in planned:
        raw = bytes.fromhex(frame.wire)
        assert list(DynamixelParser().feed(raw)) == [raw]
    enabling = [frame.meaning for frame in planned if frame.phase == "enable" and "(servo 1," in frame.meaning]
    assert "Torque Enable := 1" in enabling[-1]
    assert any("Bus Watchdog := 5" in meaning for meaning in enabling)


def test_dry_run_needs_the_models() -> None:
    unnamed = [DriveJoint("j", {"id": 1, "port": "p"})]
    with pytest.raises(DriverError, match=r"drive\.model is missing"):
        list(plan_frames(unnamed, FrameRequest(ControlMode.POSITION, limits(1), 0.1, np.zeros((1, 1)))))
