"""Every fault of the kit in every phase of a run on one bus: what each comes to, and the table of that in docs/."""

import os
import re
import textwrap
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from hardware_emulated.fault_runs import PHASES, Disturbed, Site
from shared_data import REPOSITORY
from tauscope.recording.journal_reading import read_journal
from tauscope.runtime.record import RunRecord
from tauscope.runtime.states import RunState
from tauscope_drivers import Backend
from tauscope_sim.emulation import FaultKind, InjectedFault

DEVICE = 2
"""Number of the device that has the fault."""

HARDWARE = (FaultKind.OVER_TEMPERATURE, FaultKind.OVERLOAD)
HARMLESS = (FaultKind.LOSE, FaultKind.CORRUPT, FaultKind.DUPLICATE)

_WIDTH = 108


@dataclass(frozen=True)
class FaultTable:
    """The table of one bus."""

    bus: str
    """as the command line calls it"""
    title: str
    arm_of: Callable[[Site], Backend]
    """a new backend on a site"""
    devices: str
    """what is emulated"""
    device: str
    """what one of them is called"""
    half_radian: int
    """counts of its encoder"""
    names: Mapping[FaultKind, str]
    """faults that the bus has, in words"""
    absent: frozenset[FaultKind] = frozenset()
    """faults that it cannot have"""

    def run(self, site: Site, kind: FaultKind, phase: str) -> tuple[RunRecord, Path]:
        """A run with a fault at the beginning of a phase, with devices as delivered."""
        site.emulator.reset()
        fault = kit(self.half_radian)[kind]
        disturbed = Disturbed(self.arm_of(site), phase, lambda: site.emulator.inject(fault))
        return site.run(disturbed, f"{kind}-{phase}", self.bus)

    def require_end(self, site: Site, kind: FaultKind, phase: str, reason: str) -> None:
        """The run fails for a reason, or is finished where there is none."""
        found = outcome(self.run(site, kind, phase)[0])
        assert found.end == ("failed" if reason else "finished")
        assert found.reason == reason

    def require_documented(self, site: Site) -> None:
        """Whatever happens when is definite, and as docs/ has it; ``TAUSCOPE_WRITE_DOCS=1`` renews that."""
        assert {*self.names, *self.absent} == {*FaultKind}, "no fault of the kit is left out"
        outcomes = {
            name: {phase: require_definite(kind, phase, *self.run(site, kind, phase)) for phase in PHASES}
            for kind, name in self.names.items()
        }
        text = "\n".join([f"# {self.title}", "", *self._introduction, "", *_table_lines(outcomes)]) + "\n"
        table = REPOSITORY / "docs" / "reference" / f"{self.bus}-faults.md"
        if os.environ.get("TAUSCOPE_WRITE_DOCS"):
            table.write_text(text, encoding="utf-8")
        assert table.read_text(encoding="utf-8") == text, (
            "renew the table with TAUSCOPE_WRITE_DOCS=1 and read what changed"
        )

    @property
    def _introduction(self) -> list[str]:
        text = (
            f"Made by `tests/hardware_emulated/test_{self.bus}_fault_table.py` on three emulated {self.devices}; "
            f"{self.device} {DEVICE} has the fault just as the phase begins. `TAUSCOPE_WRITE_DOCS=1` renews it. What "
            f"real {self.devices.split()[-1]} do may differ where the emulator had to assume something: see "
            "[what only real hardware can show](../hardware-limits.md)."
        )
        return textwrap.wrap(text, _WIDTH, break_on_hyphens=False)


def kit(half_radian: int) -> dict[FaultKind, InjectedFault]:
    """One fault of every kind, with the device's counts for half a radian."""
    faults = (
        InjectedFault(FaultKind.LOSE, DEVICE, count=2),
        InjectedFault(FaultKind.CORRUPT, DEVICE, count=2),
        InjectedFault(FaultKind.LATE, DEVICE, count=2, seconds=0.06),
        InjectedFault(FaultKind.DUPLICATE, DEVICE, count=5),
        InjectedFault(FaultKind.SILENT, DEVICE, seconds=30.0),
        InjectedFault(FaultKind.BUS_OFF, DEVICE, seconds=0.3),
        InjectedFault(FaultKind.OVER_TEMPERATURE, DEVICE),
        InjectedFault(FaultKind.OVERLOAD, DEVICE),
        InjectedFault(FaultKind.ENCODER_JUMP, DEVICE, counts=half_radian),
        InjectedFault(FaultKind.RESET, DEVICE, seconds=0.3),
        InjectedFault(FaultKind.POWER_DIP, seconds=0.3),
    )
    return {fault.kind: fault for fault in faults}


@dataclass(frozen=True)
class Outcome:
    """What a fault came to: how the run ended, by what reason, what was said, what was kept and what that lacks."""

    end: str
    reason: str
    message: str
    kept: str
    missed: tuple[int, ...] = ()

    @property
    def cell(self) -> str:
        return f"{self.end}{f': {self.reason}' if self.reason else ''}; {self.kept}"

    @property
    def said(self) -> str:
        """What is said, without its figures; where nothing is, what is missing from the recording."""
        if self.message:
            return re.sub(r"-?\d+\.\d+", "…", self.message)
        missing = [f"{count} of joint {joint}" for joint, count in enumerate(self.missed, 1) if count]
        if not missing:
            return "nothing; no sample is missing"
        return f"nothing; samples missing, marked and counted: {', '.join(missing)}"


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
    if phase == "run" and record.state is RunState.FINISHED:
        found = replace(found, missed=missed_samples(record, folder))
    if kind in HARMLESS:
        assert replace(found, missed=()) == Outcome("finished", "", "", "whole recording")
    return found


def missed_samples(record: RunRecord, folder: Path) -> tuple[int, ...]:
    """How many samples of each joint a recording lacks, all of which the run has counted."""
    assert record.timing is not None
    rows = read_journal(folder / "journal.mcap").rows
    missed = np.isnan(rows["position"]).sum(axis=0) + record.timing.cycles - len(rows)
    for joint, stale in zip(missed, record.timing.stale_samples, strict=True):
        # the last reading is judged by nobody any more
        assert joint - 1 <= stale <= joint
    return tuple(int(joint) for joint in missed)


def _table_lines(outcomes: dict[str, dict[str, Outcome]]) -> list[str]:
    """A row a fault, a column a phase, and what is said where it happens while the arm moves."""
    lines = [f"| fault | {' | '.join(PHASES)} |", f"|---{'|---' * len(PHASES)}|"]
    for name, row in outcomes.items():
        lines.append(f"| {name} | {' | '.join(row[phase].cell for phase in PHASES)} |")
    lines += ["", "What is said where it happens while the arm moves:", ""]
    lines += [f"- {name}: {row['run'].said}" for name, row in outcomes.items()]
    return lines
