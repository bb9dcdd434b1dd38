"""``tauscope doctor``, ``bus scan``, ``run`` and ``run --dry-run`` on emulated drives behind a serial CAN adapter."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from emulator_process import EmulatorProcess
from hardware_emulated.campaign_arms import three_joints
from hardware_emulated.canopen_robot import write_canopen_arm
from hardware_emulated.commands import Tauscope, write_short_motion
from tauscope.recording import read_recording
from tauscope.recording.recording import EffortKind
from tauscope_drivers.inspection import PHASES
from tauscope_sim.canopen_bus.emulator import CanOrder
from tauscope_sim.emulation import FaultKind, InjectedFault

pytestmark = pytest.mark.realtime


FRAME = re.compile(r"[0-7][0-9A-F]{2}#([0-9A-F]{2}){0,8}")
"""As can-utils write a frame."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("commands")
    path = write_canopen_arm(three_joints(), folder / "arm.json", folder / "port")
    write_short_motion(path, folder / "motion.json")
    return folder


@pytest.fixture(scope="module")
def drives(folder: Path) -> Iterator[EmulatorProcess]:
    order = CanOrder(
        robot=str(folder / "arm.json"),
        start=(0.1, 0.1, 0.1),
        port=str(folder / "port"),
        control=str(folder / "control"),
        rated_torque_mnm=(1000, 1000, 800),
    )
    with EmulatorProcess(order) as emulator:
        yield emulator


@pytest.fixture
def emulator(drives: EmulatorProcess) -> EmulatorProcess:
    drives.reset()
    return drives


def test_doctor_finds_a_sound_arm_sound(tauscope: Tauscope, folder: Path, emulator: EmulatorProcess) -> None:
    status, out, err = tauscope("doctor", folder / "arm.json")
    assert status == 0, err
    lines = out.splitlines()
    assert sum("Nm a per mille" in line for line in lines) == 3
    (rate,) = [line for line in lines if "a question is answered in" in line]
    told = re.search(r"answered in ([0-9.]+) ms; a whole cycle gets ([0-9]+) Hz", rate)
    assert told is not None
    assert float(told[1]) > 0.0
    assert int(told[2]) == 696, "by hand: 80 % of 1 Mbit/s for SYNC of 55 bits and three times 115 + 135 + 115"
    assert not any(line.startswith("failure") for line in lines)
    assert emulator.get(1, (0x1017, 0)) == 0, "nothing was written"


def test_doctor_names_what_is_wrong_and_what_to_do(tauscope: Tauscope, folder: Path, emulator: EmulatorProcess) -> None:
    emulator.inject(InjectedFault(FaultKind.OVERLOAD, 3), InjectedFault(FaultKind.SILENT, 2, seconds=30.0))
    status, out, err = tauscope("doctor", folder / "arm.json", "--backend", "canopen")
    assert status == 1
    silent, overload = [line for line in out.splitlines() if line.startswith("failure")]
    assert silent.count("node 2") == 1, "its place is told once"
    assert "check node number, power and wiring" in silent
    assert "node 3" in overload
    assert "motor blocked, error code 0x7121" in overload
    assert "free the joint" in overload
    assert len(err.splitlines()) == 1


def test_scan_shows_who_is_there(tauscope: Tauscope, folder: Path, emulator: EmulatorProcess) -> None:
    status, out, err = tauscope("bus", "scan", "canopen", f"slcan:{emulator.order.port}", "--bit-rate", "1000000")
    assert status == 0, err
    assert sum("profile 402" in line for line in out.splitlines()) == 3


@pytest.mark.parametrize("options", [(), ("--mode", "torque")])
def test_dry_run_shows_frames_and_needs_no_port(tauscope: Tauscope, folder: Path, options: tuple[str, ...]) -> None:
    arm = write_canopen_arm(three_joints(), folder / "dry.json", folder / "nowhere", rated_torque_nm=1.0)
    status, out, err = tauscope("run", arm, "--dry-run", "--trajectory", folder / "motion.json", *options)
    assert status == 0, err
    rows = [line.split(" | ") for line in out.splitlines()]
    phases = [phase for phase, _, _ in rows]
    assert phases == sorted(phases, key=PHASES.index)
    assert set(phases) == set(PHASES)
    assert all(FRAME.fullmatch(wire) for _, wire, _ in rows)


def test_run_moves_the_drives_and_records_torque(
    tauscope: Tauscope, folder: Path, emulator: EmulatorProcess, tmp_path: Path
) -> None:
    out = tmp_path / "recording.csv"
    arguments = (
        "--backend",
        "canopen",
        "--trajectory",
        folder / "motion.json",
        "--rate",
        "50",
        "--out",
        out,
        "--least-kept",
        "0.5",
    )
    status, _, err = tauscope("run", folder / "arm.json", *arguments)
    assert status == 0, err
    recording = read_recording(out)
    assert recording.effort_kind is EffortKind.TORQUE
    assert recording.joint_count == 3
    assert emulator.state["state"] == ["QUICK_STOP_ACTIVE"] * 3, "it holds"
    status, out_text, err = tauscope("release", folder / "arm.json", "--supported")
    assert status == 0, err
    assert "no drive is under power" in out_text
    assert emulator.state["state"] == ["SWITCH_ON_DISABLED"] * 3


def test_run_beyond_the_bus_is_refused(tauscope: Tauscope, folder: Path, emulator: EmulatorProcess) -> None:
    arguments = ("--backend", "canopen", "--trajectory", folder / "motion.json", "--rate", "2000")
    status, _, err = tauscope("run", folder / "arm.json", *arguments, "--out", folder / "never.csv")
    assert status == 1
    assert "bus allows (the frames of 3 drives take 1.15 ms of each cycle at 1000 kbit/s" in err
    assert emulator.state["state"] == ["SWITCH_ON_DISABLED"] * 3
