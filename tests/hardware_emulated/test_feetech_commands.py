"""``tauscope doctor``, ``bus scan``, ``run``, ``run --dry-run`` and ``release`` on emulated STS3215 servos."""

import json
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from emulator_process import EmulatorProcess
from feetech_bus import FeetechOrder, ServoSpecification
from hardware_emulated.campaign_arms import three_joints
from hardware_emulated.commands import Tauscope, write_short_motion
from tauscope.recording import read_recording
from tauscope.recording.recording import EffortKind
from tauscope_drivers.feetech.packets import FeetechParser
from tauscope_drivers.inspection import PHASES

pytestmark = pytest.mark.realtime

TORQUE_PER_PERMILLE = 0.15
PATIENT = ("--watchdog-s", "0.4", "--missed", "20", "--lost-s", "0.3", "--least-kept", "0.5")
"""A run that a busy machine makes as well."""


def write_feetech_robot(arm: dict[str, Any], path: Path, port: str) -> Path:
    """The arm with a servo at every joint."""
    joints = [
        {**joint, "torque_constant": TORQUE_PER_PERMILLE, "drive": {"servo_id": number}}
        for number, joint in enumerate(arm["joints"], 1)
    ]
    joints[0]["drive"]["port"] = port
    path.write_text(json.dumps({**arm, "joints": joints}), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("commands")
    path = write_feetech_robot(three_joints(), folder / "arm.json", str(folder / "port"))
    write_short_motion(path, folder / "motion.json")
    return folder


@pytest.fixture(scope="module")
def servos(folder: Path) -> Iterator[EmulatorProcess]:
    order = FeetechOrder(
        servos=tuple(ServoSpecification(number, torque_per_permille=TORQUE_PER_PERMILLE) for number in (1, 2, 3)),
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
    assert sum("STS3215, firmware 3.10, P 32, D 32, I 0" in line for line in lines) == 3
    assert sum("Return Delay Time 500 µs" in line for line in lines) == 3
    assert any("times a second" in line for line in lines)
    assert not any(line.startswith("failure") for line in lines)


def test_doctor_names_what_is_wrong_and_what_to_do(tauscope: Tauscope, folder: Path, emulator: EmulatorProcess) -> None:
    emulator.put(3, "mode", 1)
    status, out, err = tauscope("doctor", folder / "arm.json")
    assert status == 1
    (failure,) = [line for line in out.splitlines() if line.startswith("failure")]
    assert "joint3" in failure
    assert "set it to 0 with Feetech's FD" in failure
    assert len(err.splitlines()) == 1
    assert emulator.get(3, "mode") == 1, "nothing was written"


def test_scan_shows_who_is_there(tauscope: Tauscope, emulator: EmulatorProcess) -> None:
    status, out, err = tauscope("bus", "scan", "feetech", emulator.order.port, "--bit-rate", "1000000")
    assert status == 0, err
    assert sum("STS3215" in line and "1000000" in line for line in out.splitlines()) == 3


def test_scan_of_an_empty_bus_fails(tauscope: Tauscope, emulator: EmulatorProcess) -> None:
    status, _, err = tauscope("bus", "scan", "feetech", emulator.order.port, "--bit-rate", "57600")
    assert status == 1
    assert "nobody answers" in err
    assert "protocol 2.0" in err


@pytest.mark.parametrize("options", [(), ("--backend", "feetech")])
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
        assert list(FeetechParser().feed(bytes.fromhex(wire))) == [bytes.fromhex(wire)]
    first, last = [meaning for phase, _, meaning in rows if phase == "enable" and "servo 1)" in meaning]
    assert "Torque Limit :=" in first
    assert "Torque Enable := 1" in last


def test_run_moves_the_servos_and_an_arm_that_holds_is_let_go(
    tauscope: Tauscope, folder: Path, emulator: EmulatorProcess, tmp_path: Path
) -> None:
    out = tmp_path / "recording.csv"
    arguments = ("--backend", "feetech", "--trajectory", folder / "motion.json", "--rate", "50", "--out", out)
    status, printed, err = tauscope("run", folder / "arm.json", *arguments, *PATIENT)
    assert status == 0, err
    recording = read_recording(out)
    assert recording.effort_kind is EffortKind.CURRENT
    samples = recording.samples()
    assert samples.reference is not None
    assert np.nanmax(np.abs(samples.reference - samples.position)) < 0.2
    assert samples.voltage is not None
    assert np.nanmin(samples.voltage) == np.nanmax(samples.voltage) == pytest.approx(7.4)
    assert all(emulator.state["enabled"]), "it holds"
    assert "The arm is under power where it stopped" in printed
    assert "no watchdog" in printed
    status, printed, err = tauscope("release", folder / "arm.json", "--supported")
    assert status == 0, err
    assert "no drive is under power" in printed
    assert not any(emulator.state["enabled"])


def test_torque_mode_is_refused(tauscope: Tauscope, folder: Path, emulator: EmulatorProcess) -> None:
    arguments = ("--backend", "feetech", "--trajectory", folder / "motion.json", "--mode", "torque")
    status, _, err = tauscope("run", folder / "arm.json", *arguments, "--out", folder / "never.csv")
    assert status == 1
    assert "mode torque" in err or "torque_off" in err
    assert not any(emulator.state["enabled"])


def test_run_beyond_the_bus_is_refused(tauscope: Tauscope, folder: Path, emulator: EmulatorProcess) -> None:
    arguments = ("--backend", "feetech", "--trajectory", folder / "motion.json", "--rate", "2000")
    status, _, err = tauscope("run", folder / "arm.json", *arguments, "--out", folder / "never.csv")
    assert status == 1
    assert "bus allows" in err
    assert not any(emulator.state["enabled"])


def test_adapters_of_several_buses_are_listed_once(tauscope: Tauscope, monkeypatch: pytest.MonkeyPatch) -> None:
    adapter = SimpleNamespace(device="/dev/ttyNONE", description="USB serial")
    monkeypatch.setattr("tauscope_drivers.serial_port.comports", lambda: [adapter])
    _, out, _ = tauscope("doctor")
    assert sum("/dev/ttyNONE" in line for line in out.splitlines()) == 1
