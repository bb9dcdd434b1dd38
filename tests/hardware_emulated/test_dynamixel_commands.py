"""``tauscope doctor``, ``bus scan``, ``run`` and ``run --dry-run`` on emulated servos."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from emulator_process import EmulatorProcess
from hardware_emulated.campaign_arms import three_joints, write_robot
from hardware_emulated.commands import Tauscope, write_short_motion
from hardware_emulated.robot_servos import servos_of
from tauscope.recording import read_recording
from tauscope.recording.recording import EffortKind
from tauscope.robot import read_robot
from tauscope_drivers.dynamixel.packets import DynamixelParser
from tauscope_drivers.inspection import PHASES
from tauscope_sim.dynamixel_bus import DynamixelOrder
from tauscope_sim.emulation import FaultKind, InjectedFault

pytestmark = pytest.mark.realtime

PATIENT = ("--watchdog-s", "0.4", "--missed", "20", "--lost-s", "0.3", "--least-kept", "0.5")
"""A run that a busy machine makes as well."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("commands")
    path = write_robot(three_joints(), folder / "arm.json", str(folder / "port"))
    write_short_motion(path, folder / "motion.json")
    return folder


@pytest.fixture(scope="module")
def servos(folder: Path) -> Iterator[EmulatorProcess]:
    order = DynamixelOrder(
        servos=servos_of(read_robot(folder / "arm.json")),
        start=(0.1, 0.1, 0.1),
        port=str(folder / "port"),
        control=str(folder / "control"),
    )
    with EmulatorProcess(order) as emulator:
        yield emulator


@pytest.fixture
def emulator(servos: EmulatorProcess) -> EmulatorProcess:
    servos.reset()
    return servos


def test_doctor_finds_a_sound_arm_sound(tauscope: Tauscope, folder: Path, emulator: EmulatorProcess) -> None:
    status, out, err = tauscope("doctor", folder / "arm.json")
    assert status == 0, err
    lines = out.splitlines()
    assert sum("PH54-200-S500" in line and "firmware 52" in line for line in lines) == 3
    assert any("times a second" in line for line in lines)
    assert not any(line.startswith("failure") for line in lines)
    assert emulator.get(1, "Return Delay Time") == 250, "nothing was written"


def test_doctor_names_what_is_wrong_and_what_to_do(tauscope: Tauscope, folder: Path, emulator: EmulatorProcess) -> None:
    emulator.inject(InjectedFault(FaultKind.OVERLOAD, 3))
    status, out, err = tauscope("doctor", folder / "arm.json", "--backend", "dynamixel")
    assert status == 1
    (failure,) = [line for line in out.splitlines() if line.startswith("failure")]
    assert "joint3" in failure
    assert "overload" in failure
    assert "support the arm" in failure
    assert len(err.splitlines()) == 1
    assert "joint3" in err


def test_doctor_without_an_arm_looks_at_adapters(tauscope: Tauscope) -> None:
    status, out, err = tauscope("doctor", "--backend", "dynamixel")
    assert out.strip()
    assert status == (1 if "failure:" in out else 0), err


def test_doctor_of_an_arm_without_drives_says_so(tauscope: Tauscope, tmp_path: Path) -> None:
    bare = tmp_path / "bare.yaml"
    bare.write_text("name: bare\nkinematics: {dh: [{theta: 0, d: 0, a: 1, alpha: 0}]}\njoints: [{name: j}]\n")
    status, _, err = tauscope("doctor", bare)
    assert status == 1
    assert "drive block" in err


def test_scan_shows_who_is_there(tauscope: Tauscope, folder: Path, emulator: EmulatorProcess) -> None:
    status, out, err = tauscope("bus", "scan", "dynamixel", emulator.order.port, "--bit-rate", "1000000")
    assert status == 0, err
    assert sum("PH54-200-S500" in line and "1000000" in line for line in out.splitlines()) == 3


def test_scan_of_an_empty_bus_fails(tauscope: Tauscope, emulator: EmulatorProcess) -> None:
    status, _, err = tauscope("bus", "scan", "dynamixel", emulator.order.port, "--bit-rate", "57600")
    assert status == 1
    assert "nobody answers" in err
    assert "Feetech" in err
    assert len(err.splitlines()) == 1


@pytest.mark.parametrize("options", [(), ("--backend", "dynamixel"), ("--mode", "torque")])
def test_dry_run_shows_frames_and_needs_no_port(tauscope: Tauscope, folder: Path, options: tuple[str, ...]) -> None:
    status, out, err = tauscope(
        "run", folder / "arm.json", "--dry-run", "--trajectory", folder / "motion.json", *options
    )
    assert status == 0, err
    rows = [line.split(" | ") for line in out.splitlines()]
    phases = [phase for phase, _, _ in rows]
    assert phases == sorted(phases, key=PHASES.index)
    assert set(phases) == set(PHASES)
    for _, wire, _ in rows:
        assert list(DynamixelParser().feed(bytes.fromhex(wire))) == [bytes.fromhex(wire)]
    order = [meaning for phase, _, meaning in rows if phase == "enable" and "servo 1," in meaning]
    assert "Bus Watchdog := 5" in order[-2]
    assert "Torque Enable := 1" in order[-1]


def test_run_moves_the_servos_and_records_current(
    tauscope: Tauscope, folder: Path, emulator: EmulatorProcess, tmp_path: Path
) -> None:
    out = tmp_path / "recording.csv"
    arguments = (
        "--backend",
        "dynamixel",
        "--trajectory",
        folder / "motion.json",
        "--rate",
        "50",
        "--out",
        out,
        *PATIENT,
    )
    status, _, err = tauscope("run", folder / "arm.json", *arguments)
    assert status == 0, err
    recording = read_recording(out)
    assert recording.effort_kind is EffortKind.CURRENT
    assert recording.joint_count == 3
    assert all(emulator.state["enabled"]), "it holds"
    assert not any(emulator.state["latched"])


def test_run_beyond_the_bus_is_refused(tauscope: Tauscope, folder: Path, emulator: EmulatorProcess) -> None:
    arguments = ("--backend", "dynamixel", "--trajectory", folder / "motion.json", "--rate", "2000")
    status, _, err = tauscope("run", folder / "arm.json", *arguments, "--out", folder / "never.csv")
    assert status == 1
    assert "bus allows" in err
    assert "the adapter's latency timer of 1 ms takes" in err or "the wire at 1e+06 baud takes" in err
    assert not any(emulator.state["enabled"])


def test_an_arm_that_holds_after_a_run_is_let_go_and_has_its_settings_back(
    tauscope: Tauscope, folder: Path, emulator: EmulatorProcess
) -> None:
    motion, out = folder / "motion.json", folder / "held.csv"
    status, out_text, err = tauscope(
        "run",
        folder / "arm.json",
        "--backend",
        "dynamixel",
        "--trajectory",
        motion,
        "--out",
        out,
        "--rate",
        "50",
        *PATIENT,
    )
    assert status == 0, err
    assert "The arm is under power where it stopped" in out_text
    assert "Return Delay Time 0 in place of 250" in out_text
    assert all(emulator.state["enabled"])
    status, _, err = tauscope("release", folder / "arm.json")
    assert status == 1, "nobody stated that it is supported"
    assert "--supported" in err
    assert all(emulator.state["enabled"])
    status, out_text, err = tauscope("release", folder / "arm.json", "--supported")
    assert status == 0, err
    assert "no drive is under power" in out_text
    assert not any(emulator.state["enabled"])
    assert [emulator.get(servo, "Return Delay Time") for servo in (1, 2, 3)] == [250] * 3
