"""``tauscope doctor``, ``bus scan``, ``run``, ``run --dry-run`` and ``release`` on emulated servos."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from emulator_process import EmulatorProcess
from hardware_emulated.campaign_arms import three_joints
from hardware_emulated.commands import Tauscope, write_short_motion
from hardware_emulated.servo_kinds import DYNAMIXEL, FEETECH, ServoKind
from tauscope.recording import read_recording
from tauscope.recording.recording import EffortKind
from tauscope.robot import read_robot
from tauscope_drivers.inspection import PHASES
from tauscope_sim.emulation import FaultKind, InjectedFault

pytestmark = pytest.mark.realtime

PATIENT = ("--watchdog-s", "0.4", "--missed", "20", "--lost-s", "0.3", "--least-kept", "0.5")
"""A run that a busy machine makes as well."""

RETURN_DELAY = {"dynamixel": "Return Delay Time", "feetech": "return_delay"}


@dataclass
class Site:
    kind: ServoKind
    folder: Path
    emulator: EmulatorProcess

    @property
    def robot(self) -> Path:
        return self.folder / "arm.json"

    @property
    def run(self) -> tuple[str | Path, ...]:
        return "--backend", self.kind.name, "--trajectory", self.folder / "motion.json"

    @property
    def return_delays(self) -> list[int]:
        return [self.emulator.get(servo, RETURN_DELAY[self.kind.name]) for servo in (1, 2, 3)]


@pytest.fixture(scope="module", params=[DYNAMIXEL, FEETECH], ids=lambda kind: kind.name)
def servos(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    kind, folder = request.param, tmp_path_factory.mktemp("commands")
    path = kind.write_robot(three_joints(), folder / "arm.json", str(folder / "port"))
    write_short_motion(path, folder / "motion.json")
    with EmulatorProcess(kind.order(read_robot(path), (0.1, 0.1, 0.1), folder)) as emulator:
        yield Site(kind, folder, emulator)


@pytest.fixture
def site(servos: Site) -> Site:
    servos.emulator.reset()
    return servos


SOUND = {"dynamixel": ("PH54-200-S500", "firmware 52"), "feetech": ("STS3215, firmware 3.10, P 32, D 32, I 0",)}


def test_doctor_finds_a_sound_arm_sound(tauscope: Tauscope, site: Site) -> None:
    status, out, err = tauscope("doctor", site.robot)
    assert status == 0, err
    lines = out.splitlines()
    assert sum(all(words in line for words in SOUND[site.kind.name]) for line in lines) == 3
    assert sum("Return Delay Time 500 µs" in line for line in lines) == 3
    assert any("times a second" in line for line in lines)
    assert not any(line.startswith("failure") for line in lines)
    assert site.return_delays == [250] * 3, "nothing was written"


def test_doctor_names_what_is_wrong_and_what_to_do(tauscope: Tauscope, site: Site) -> None:
    site.emulator.inject(InjectedFault(FaultKind.OVERLOAD, 3))
    status, out, err = tauscope("doctor", site.robot, "--backend", site.kind.name)
    assert status == 1
    (failure,) = [line for line in out.splitlines() if line.startswith("failure")]
    assert "joint3" in failure
    assert "overload" in failure
    assert ("support the arm" if site.kind is DYNAMIXEL else "let go of the arm") in failure
    assert len(err.splitlines()) == 1
    assert "joint3" in err


def test_doctor_names_a_mode_that_it_does_not_change(tauscope: Tauscope, site: Site) -> None:
    if site.kind is DYNAMIXEL:
        pytest.skip("its driver sets the mode")
    site.emulator.put(3, "mode", 1)
    status, out, _ = tauscope("doctor", site.robot)
    assert status == 1
    (failure,) = [line for line in out.splitlines() if line.startswith("failure")]
    assert "set it to 0 with Feetech's FD" in failure
    assert site.emulator.get(3, "mode") == 1, "nothing was written"


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


def test_scan_shows_who_is_there(tauscope: Tauscope, site: Site) -> None:
    status, out, err = tauscope("bus", "scan", site.kind.name, site.emulator.order.port, "--bit-rate", "1000000")
    assert status == 0, err
    model = "PH54-200-S500" if site.kind is DYNAMIXEL else "STS3215"
    assert sum(model in line and "1000000" in line for line in out.splitlines()) == 3


def test_scan_of_an_empty_bus_fails_and_names_who_else_may_be_there(tauscope: Tauscope, site: Site) -> None:
    status, _, err = tauscope("bus", "scan", site.kind.name, site.emulator.order.port, "--bit-rate", "57600")
    assert status == 1
    assert "nobody answers" in err
    assert ("bus scan feetech" if site.kind is DYNAMIXEL else "protocol 2.0 answer to tauscope bus scan dyn") in err
    assert len(err.splitlines()) == 1


@pytest.mark.parametrize("options", ["", "--backend", "--mode"])
def test_dry_run_shows_frames_and_needs_no_port(tauscope: Tauscope, site: Site, options: str) -> None:
    chosen = {"": (), "--backend": ("--backend", site.kind.name), "--mode": ("--mode", "torque")}[options]
    if options == "--mode" and site.kind is FEETECH:
        pytest.skip("no torque mode")
    trajectory = ("--trajectory", site.folder / "motion.json")
    status, out, err = tauscope("run", site.robot, "--dry-run", *trajectory, *chosen)
    assert status == 0, err
    rows = [line.split(" | ") for line in out.splitlines()]
    phases = [phase for phase, _, _ in rows]
    assert phases == sorted(phases, key=PHASES.index)
    assert set(phases) == set(PHASES)
    for _, wire, _ in rows:
        assert list(site.kind.make_parser().feed(bytes.fromhex(wire))) == [bytes.fromhex(wire)]
    *_, before, last = [meaning for phase, _, meaning in rows if phase == "enable" and "(servo 1" in meaning]
    assert ("Bus Watchdog := 5" if site.kind is DYNAMIXEL else "Torque Limit :=") in before
    assert "Torque Enable := 1" in last


def test_run_moves_the_servos_and_an_arm_that_holds_is_let_go(tauscope: Tauscope, site: Site, tmp_path: Path) -> None:
    out = tmp_path / "recording.csv"
    status, printed, err = tauscope("run", site.robot, *site.run, "--rate", "50", "--out", out, *PATIENT)
    assert status == 0, err
    recording = read_recording(out)
    assert recording.effort_kind is EffortKind.CURRENT
    assert recording.joint_count == 3
    samples = recording.samples()
    if site.kind is FEETECH:
        assert samples.reference is not None
        assert np.nanmax(np.abs(samples.reference - samples.position)) < 0.2
        assert samples.voltage is not None
        assert np.nanmin(samples.voltage) == np.nanmax(samples.voltage) == pytest.approx(7.4)
    assert all(site.emulator.state["enabled"]), "it holds"
    assert not any(site.emulator.state["latched"])
    assert "The arm is under power where it stopped" in printed
    assert ("Return Delay Time 0 in place of 250" if site.kind is DYNAMIXEL else "no watchdog") in printed
    status, _, err = tauscope("release", site.robot)
    assert status == 1, "nobody stated that it is supported"
    assert "--supported" in err
    assert all(site.emulator.state["enabled"])
    status, printed, err = tauscope("release", site.robot, "--supported")
    assert status == 0, err
    assert "no drive is under power" in printed
    assert not any(site.emulator.state["enabled"])
    assert site.return_delays == [250] * 3


def test_torque_mode_is_refused_where_there_is_none(tauscope: Tauscope, site: Site) -> None:
    if site.kind is DYNAMIXEL:
        pytest.skip("they have a torque mode")
    status, _, err = tauscope("run", site.robot, *site.run, "--mode", "torque", "--out", site.folder / "never.csv")
    assert status == 1
    assert "mode torque" in err or "torque_off" in err
    assert not any(site.emulator.state["enabled"])


def test_run_beyond_the_bus_is_refused(tauscope: Tauscope, site: Site) -> None:
    status, _, err = tauscope("run", site.robot, *site.run, "--rate", "2000", "--out", site.folder / "never.csv")
    assert status == 1
    assert "bus allows" in err
    assert any(
        words in err for words in ("latency timer of 1 ms takes", "the wire at 1e+06 baud takes", "a Return Delay")
    )
    assert not any(site.emulator.state["enabled"])


def test_adapters_of_several_buses_are_listed_once(tauscope: Tauscope, monkeypatch: pytest.MonkeyPatch) -> None:
    adapter = SimpleNamespace(device="/dev/ttyNONE", description="USB serial")
    monkeypatch.setattr("tauscope_drivers.serial_port.comports", lambda: [adapter])
    _, out, _ = tauscope("doctor")
    assert sum("/dev/ttyNONE" in line for line in out.splitlines()) == 1
