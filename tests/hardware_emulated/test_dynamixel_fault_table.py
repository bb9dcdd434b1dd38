"""Every fault of the kit in every phase of a run: how it ends, what is said, what is kept. The table in docs/ is this.

Run with ``TAUSCOPE_WRITE_DOCS=1`` to renew the table. The servos' time passes in step with the host's cycles, so that
the table is the same on every machine.
"""

import os
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from drivers import ArmState, ControlMode, DriveLimits, Setpoint, StopPolicy
from drivers.dynamixel import DynamixelArm
from hardware_emulated.campaign_arms import three_joints, write_robot
from hardware_emulated.stepped_clock import SteppedClock
from service.acquisition import RunOptions, RunRecord, RunState, run_trajectory
from service.acquisition.backends import Connection
from service.acquisition.dynamixel_bus import dynamixel_joints
from service.excitation import ExcitationOptions, Trajectory, design_excitation
from service.recording.journal_reading import read_journal
from service.robot import Robot, read_robot
from shared_data import REPOSITORY
from sim_backend.dynamixel_bus import DynamixelOrder
from sim_backend.dynamixel_bus.robot_servos import servos_of
from sim_backend.emulation import EmulatorProcess, FaultKind, InjectedFault

TABLE = REPOSITORY / "docs" / "reference" / "dynamixel-faults.md"
PHASES = ("connect", "enable", "ramp", "run", "stop")
SERVO = 2

FAULTS = {
    FaultKind.LOSE: (InjectedFault(FaultKind.LOSE, SERVO, count=2), "two answers are lost"),
    FaultKind.CORRUPT: (InjectedFault(FaultKind.CORRUPT, SERVO, count=2), "two answers arrive damaged"),
    FaultKind.LATE: (InjectedFault(FaultKind.LATE, SERVO, count=2, seconds=0.06), "two answers are 60 ms late"),
    FaultKind.DUPLICATE: (InjectedFault(FaultKind.DUPLICATE, SERVO, count=5), "five answers arrive twice"),
    FaultKind.SILENT: (InjectedFault(FaultKind.SILENT, SERVO, seconds=30.0), "the servo falls silent"),
    FaultKind.OVER_TEMPERATURE: (InjectedFault(FaultKind.OVER_TEMPERATURE, SERVO), "the servo is too hot"),
    FaultKind.OVERLOAD: (InjectedFault(FaultKind.OVERLOAD, SERVO), "the servo is overloaded"),
    FaultKind.ENCODER_JUMP: (
        InjectedFault(FaultKind.ENCODER_JUMP, SERVO, counts=80_000),
        "its encoder jumps by 0.5 rad",
    ),
    FaultKind.RESET: (InjectedFault(FaultKind.RESET, SERVO, seconds=0.3), "the servo restarts"),
    FaultKind.POWER_DIP: (InjectedFault(FaultKind.POWER_DIP, seconds=0.3), "the power of all dips"),
}


HARDWARE = (FaultKind.OVER_TEMPERATURE, FaultKind.OVERLOAD)
HARMLESS = (FaultKind.LOSE, FaultKind.CORRUPT, FaultKind.DUPLICATE)


class Disturbed(DynamixelArm):
    """The driver, with something that happens just before one of its calls."""

    phase = ""
    happen: Callable[[], None] = staticmethod(lambda: None)
    _ramp_cycles = 5
    _run_cycles = 120
    _cycle = 0

    def connect(self) -> ArmState:
        self._strike("connect")
        return super().connect()

    def enable(
        self,
        mode: ControlMode,
        limits: DriveLimits,
        stop_policy: StopPolicy,
        watchdog_s: float,
        cycle_s: float | None = None,
    ) -> ArmState:
        self._strike("enable")
        return super().enable(mode, limits, stop_policy, watchdog_s, cycle_s)

    def exchange(self, setpoint: Setpoint) -> ArmState:
        self._cycle += 1
        if self._cycle == self._ramp_cycles:
            self._strike("ramp")
        if self._cycle == self._run_cycles:
            self._strike("run")
        return super().exchange(setpoint)

    def stop(self, policy: StopPolicy) -> ArmState:
        self._strike("stop")
        return super().stop(policy)

    def _strike(self, phase: str) -> None:
        if phase == self.phase:
            self.phase = ""
            self.happen()


@dataclass
class Site:
    emulator: EmulatorProcess
    robot: Robot
    motion: Trajectory
    folder: Path


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory):
    folder = tmp_path_factory.mktemp("faults")
    robot = read_robot(write_robot(three_joints(), folder / "arm.json", str(folder / "port")))
    design = ExcitationOptions(period_s=2.0, periods=1, starts=1, slow_postures=0, closing_period=False)
    motion = design_excitation(robot, design).trajectory
    order = DynamixelOrder(
        servos=servos_of(robot),
        start=tuple((motion.start + 0.1).tolist()),
        port=str(folder / "port"),
        control=str(folder / "control"),
        robot=str(folder / "arm.json"),
        stepped=True,
    )
    with EmulatorProcess(order) as emulator:
        yield Site(emulator, robot, motion, folder)


def run(site: Site, kind: FaultKind, phase: str) -> tuple[RunRecord, Path]:
    site.emulator.reset()
    arm = Disturbed(dynamixel_joints(site.robot), slack_s=0.1, clock=SteppedClock(site.emulator))
    arm.phase = phase
    arm.happen = lambda: site.emulator.inject(FAULTS[kind][0])
    folder = site.folder / f"{len(list(site.folder.iterdir()))}-{kind}-{phase}"
    options = RunOptions(rate_hz=100.0, watchdog_s=0.2)
    connect = lambda: Connection(arm, is_real_time=False)  # noqa: E731
    return run_trajectory(site.robot, site.motion, connect, folder, options, backend_name="dynamixel"), folder


@dataclass(frozen=True)
class Outcome:
    """What a fault came to: how the run ended, by what reason, what was said and what was kept."""

    end: str
    reason: str
    message: str
    kept: str

    @property
    def cell(self) -> str:
        return f"{self.end}{f': {self.reason}' if self.reason else ''}; {self.kept}"


def outcome(record: RunRecord) -> Outcome:
    message = (record.stop or "") if record.problem is None else record.problem.detail
    codes = re.findall(r"\(([a-z]+(?:-[a-z]+)*)\)", message)
    recording = record.recording
    if recording is None or not recording.files:
        kept = "nothing was recorded yet"
    else:
        kept = "recording marked partial" if recording.partial else "whole recording"
    return Outcome(record.state.value, codes[0] if codes else "", message, kept)


def table(outcomes: dict[FaultKind, dict[str, Outcome]]) -> str:
    lines = [
        "# Faults of a Dynamixel bus, phase by phase",
        "",
        "Made by `tests/hardware_emulated/test_dynamixel_fault_table.py` on three emulated servos; servo 2 has the",
        "fault just as the phase begins. `TAUSCOPE_WRITE_DOCS=1` renews it. What real servos do may differ where the",
        "emulator had to assume something: see the README on what only hardware can show.",
        "",
        f"| fault | {' | '.join(PHASES)} |",
        f"|---{'|---' * len(PHASES)}|",
    ]
    for kind, row in outcomes.items():
        lines.append(f"| {FAULTS[kind][1]} | {' | '.join(row[phase].cell for phase in PHASES)} |")
    lines += ["", "What is said where it happens while the arm moves:", ""]
    for kind, row in outcomes.items():
        said = (
            re.sub(r"\d+\.\d+", "…", row["run"].message) or "nothing; samples that were missed are marked and counted"
        )
        lines.append(f"- {FAULTS[kind][1]}: {said}")
    return "\n".join(lines) + "\n"


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_every_fault_in_every_phase(site: Site) -> None:
    outcomes: dict[FaultKind, dict[str, Outcome]] = {}
    for kind in FAULTS:
        outcomes[kind] = {}
        for phase in PHASES:
            record, folder = run(site, kind, phase)
            found = outcomes[kind][phase] = outcome(record)
            assert record.state in (RunState.FINISHED, RunState.FAILED), (kind, phase)
            assert "\n" not in found.message
            if record.state is RunState.FAILED:
                assert found.reason, found
                assert ";" in found.message, "what happened; what to do"
            if phase == "run":
                assert len(read_journal(folder / "journal.mcap").motion) > 0, "what was measured is kept"
                assert record.recording is not None
                assert record.recording.partial == (record.state is RunState.FAILED)
            if kind in HARDWARE:
                assert record.state is RunState.FAILED
                assert found.reason == kind.value
            if kind in HARMLESS:
                assert found == Outcome("finished", "", "", "whole recording")
    text = table(outcomes)
    if os.environ.get("TAUSCOPE_WRITE_DOCS"):
        TABLE.parent.mkdir(exist_ok=True)
        TABLE.write_text(text, encoding="utf-8")
    assert TABLE.read_text(encoding="utf-8") == text, "renew the table with TAUSCOPE_WRITE_DOCS=1 and read what changed"


QUICK = [(FaultKind.OVERLOAD, "run", "overload"), (FaultKind.SILENT, "stop", "silent"), (FaultKind.LOSE, "run", "")]


@pytest.mark.parametrize(("kind", "phase", "reason"), QUICK)
def test_some_faults_in_some_phases(site: Site, kind: FaultKind, phase: str, reason: str) -> None:
    found = outcome(run(site, kind, phase)[0])
    assert found.end == ("failed" if reason else "finished")
    assert found.reason == reason
