"""Runs that something happens to: before which call it does, what they come to, and the table of all of that."""

import os
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from drivers import ArmState, Backend, Capabilities, ControlMode, DriveLimits, Setpoint, StopPolicy
from drivers.clock import Clock
from service.acquisition import RunOptions, RunRecord, RunState, run_trajectory
from service.acquisition.backends import Connection
from service.excitation import Trajectory
from service.recording.journal_reading import read_journal
from service.robot import Robot
from sim_backend.emulation import EmulatorProcess, FaultKind

PHASES = ("connect", "enable", "ramp", "run", "stop")
HARDWARE = (FaultKind.OVER_TEMPERATURE, FaultKind.OVERLOAD)
HARMLESS = (FaultKind.LOSE, FaultKind.CORRUPT, FaultKind.DUPLICATE)

_RAMP_CYCLES = 5
_RUN_CYCLES = 120


class Disturbed:
    """A backend, with something that happens just before one of its calls."""

    def __init__(self, backend: Backend, phase: str, happen: Callable[[], object]) -> None:
        self._backend, self._phase, self._happen = backend, phase, happen
        self._cycle = 0

    @property
    def capabilities(self) -> Capabilities:
        return self._backend.capabilities

    @property
    def clock(self) -> Clock:
        return self._backend.clock

    def connect(self) -> ArmState:
        self._strike("connect")
        return self._backend.connect()

    def acknowledge_faults(self) -> ArmState:
        return self._backend.acknowledge_faults()

    def enable(
        self,
        mode: ControlMode,
        limits: DriveLimits,
        stop_policy: StopPolicy,
        watchdog_s: float,
        cycle_s: float | None = None,
    ) -> ArmState:
        self._strike("enable")
        return self._backend.enable(mode, limits, stop_policy, watchdog_s, cycle_s)

    def exchange(self, setpoint: Setpoint) -> ArmState:
        self._cycle += 1
        if self._cycle == _RAMP_CYCLES:
            self._strike("ramp")
        if self._cycle == _RUN_CYCLES:
            self._strike("run")
        return self._backend.exchange(setpoint)

    def stop(self, policy: StopPolicy) -> ArmState:
        self._strike("stop")
        return self._backend.stop(policy)

    def disconnect(self) -> None:
        self._backend.disconnect()

    def _strike(self, phase: str) -> None:
        if phase == self._phase:
            self._phase = ""
            self._happen()


@dataclass
class Site:
    """An emulated arm, a motion for it, and a folder for runs."""

    emulator: EmulatorProcess
    robot: Robot
    motion: Trajectory
    folder: Path

    def run(self, arm: Backend, name: str, backend_name: str) -> tuple[RunRecord, Path]:
        """A run in the emulator's own time."""
        folder = self.folder / f"{len(list(self.folder.iterdir()))}-{name}"
        options = RunOptions(rate_hz=100.0, watchdog_s=0.2)
        connect = lambda: Connection(arm, is_real_time=False)  # noqa: E731
        return run_trajectory(self.robot, self.motion, connect, folder, options, backend_name=backend_name), folder


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
    """What a run came to."""
    message = (record.stop or "") if record.problem is None else record.problem.detail
    codes = re.findall(r"\(([a-z]+(?:-[a-z]+)*)\)", message)
    recording = record.recording
    if recording is None or not recording.files:
        kept = "nothing was recorded yet"
    else:
        kept = "recording marked partial" if recording.partial else "whole recording"
    return Outcome(record.state.value, codes[0] if codes else "", message, kept)


def require_definite(kind: FaultKind, phase: str, record: RunRecord, folder: Path) -> Outcome:
    """Whatever happened when: a definite state, one line with the next step, and what was measured is kept."""
    found = outcome(record)
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
    return found


def require_documented(table: Path, text: str) -> None:
    """The table in docs/ is this one; ``TAUSCOPE_WRITE_DOCS=1`` renews it."""
    if os.environ.get("TAUSCOPE_WRITE_DOCS"):
        table.parent.mkdir(exist_ok=True)
        table.write_text(text, encoding="utf-8")
    assert table.read_text(encoding="utf-8") == text, "renew the table with TAUSCOPE_WRITE_DOCS=1 and read what changed"


def table_lines(outcomes: dict[str, dict[str, Outcome]]) -> list[str]:
    """A row a fault, a column a phase, and what is said where it happens while the arm moves."""
    lines = [f"| fault | {' | '.join(PHASES)} |", f"|---{'|---' * len(PHASES)}|"]
    for name, row in outcomes.items():
        lines.append(f"| {name} | {' | '.join(row[phase].cell for phase in PHASES)} |")
    lines += ["", "What is said where it happens while the arm moves:", ""]
    for name, row in outcomes.items():
        said = re.sub(r"-?\d+\.\d+", "…", row["run"].message)
        lines.append(f"- {name}: {said or 'nothing; samples that were missed are marked and counted'}")
    return lines
