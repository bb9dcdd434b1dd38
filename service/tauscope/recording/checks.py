"""What is in a recording, and what about it an engineer should look at before trusting it."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tauscope.errors import RecordingError
from tauscope.recording.examination import find_implausible, find_missing_effort, mend_recording
from tauscope.recording.measures import Gaps, JointMeasures, StepMeasures, measure_gaps, measure_rows
from tauscope.recording.reading import read_recording
from tauscope.recording.recording import EffortKind, Recording
from tauscope.recording.units import SI, Reading
from tauscope.robot.messages import Finding, Severity, listed
from tauscope.robot.robot import Robot

_MEANINGFUL_STEP = 1e-4


@dataclass(frozen=True)
class Periods:
    """Repeats of the excitation."""

    count: int
    shortest: int
    longest: int


@dataclass(frozen=True)
class RecordingReport:
    """What `check_recording` found.

    `duration_s`: from the first to the last sample [s].
    `rate_hz`: 1 / median step [Hz].
    """

    name: str
    samples: int
    duration_s: float
    rate_hz: float
    steps: StepMeasures
    gaps: Gaps
    effort_kind: EffortKind
    columns: tuple[str, ...]
    ignored_columns: tuple[str, ...]
    missed: dict[str, int]
    periods: Periods | None
    joints: tuple[JointMeasures, ...]
    findings: tuple[Finding, ...]

    def require_usable(self) -> None:
        """Refuse a recording that no other verb accepts.

        Raises RecordingError where a column can hardly be in its unit, or a joint has no effort.
        """
        for finding in self.findings:
            if finding.severity is Severity.ERROR:
                raise RecordingError(f"{self.name}: column {finding.where}: {finding.text}")


def check_recording(
    path: str | Path, joint_count: int | None = None, robot: Robot | None = None, reading: Reading = SI
) -> RecordingReport:
    """Read a recording and report what it holds, in memory that does not grow with its length.

    Raises RecordingError where the file cannot be read or breaks a rule.

    `joint_count`: joints that the recording must have; None where any number is welcome.
    """
    reading = reading.for_robot(robot)
    joints = None if robot is None else [joint.name for joint in robot.joints]
    recording = read_recording(path, joint_count, joints, reading)
    return report_recording(recording, robot, trust_units=reading.trust_units)


def report_recording(recording: Recording, robot: Robot | None = None, *, trust_units: bool = False) -> RecordingReport:
    """Report what a recording holds; what no other verb accepts is among the findings, as an error."""
    measures = measure_rows(recording)
    gaps = measure_gaps(recording, measures)
    runs = measures.period_lengths
    findings = [*_about_units(recording, robot, trust_units=trust_units), *_about_samples(recording, robot)]
    findings += [*_about_columns(recording), *_about_clock(gaps), *_about_missed(measures.missed)]
    for joint, measure in enumerate(measures.joints, 1):
        findings += _about_position(f"q{joint}", measure)
        if recording.effort_kind is EffortKind.COMMAND:  # a target may rest
            continue
        findings += _about_effort(f"{recording.effort_kind}{joint}", measure, len(recording))
    return RecordingReport(
        name=recording.name,
        samples=len(recording),
        duration_s=measures.duration,
        rate_hz=1.0 / measures.steps.median,
        steps=measures.steps,
        gaps=gaps,
        effort_kind=recording.effort_kind,
        columns=recording.table.names,
        ignored_columns=recording.ignored_columns,
        missed=measures.missed,
        periods=Periods(len(runs), min(runs), max(runs)) if runs else None,
        joints=measures.joints,
        findings=tuple(sorted(findings, key=lambda finding: list(Severity).index(finding.severity))),
    )


def _about_units(recording: Recording, robot: Robot | None, *, trust_units: bool) -> Iterator[Finding]:
    """Columns that can hardly be in their unit, and efforts that were not recorded."""
    missing, doubt = find_missing_effort(recording), find_implausible(recording, robot)
    if missing is not None:
        yield _locate(Severity.ERROR, missing)
    if doubt is not None:
        trusted = (Severity.WARNING, "") if trust_units else (Severity.ERROR, ", or go on with --trust-units")
        yield _locate(trusted[0], doubt + trusted[1])


def _about_samples(recording: Recording, robot: Robot | None) -> Iterator[Finding]:
    """Samples that are none, masked or repaired before anything is estimated."""
    for note in mend_recording(recording, robot).notes:
        yield _locate(Severity.WARNING, note.text)


def _locate(severity: Severity, text: str) -> Finding:
    """A finding from a text that begins with its column."""
    where, found, rest = text.partition(": ")
    place = where.removeprefix("columns ").removeprefix("column ")
    return Finding(severity, place, rest) if found and place != where else Finding(severity, "t", text)


def _about_columns(recording: Recording) -> Iterator[Finding]:
    """Columns that are there for nothing."""
    currents = [f"i{joint}" for joint in range(1, recording.joint_count + 1)]
    passed_over = [name for name in recording.ignored_columns if name in currents]
    others = [name for name in recording.ignored_columns if name not in currents]
    if passed_over:
        yield Finding(Severity.INFO, ", ".join(passed_over), "currents are not read where torques are there")
    if others:
        yield Finding(Severity.INFO, listed(others), "not read: no column of this name is known")


def _about_clock(gaps: Gaps) -> Iterator[Finding]:
    """Samples that the logger lost."""
    if gaps.count:
        places = "1 gap" if gaps.count == 1 else f"{gaps.count} gaps"
        longest = f"the longest, {gaps.longest:.4g} s, begins at t = {gaps.longest_at:.6g} s"
        yield Finding(Severity.WARNING, "t", f"{places} in the clock; {longest}")


def _about_missed(missed: dict[str, int]) -> Iterator[Finding]:
    """Samples marked as missed."""
    for name, count in missed.items():
        if name != "period":
            yield Finding(
                Severity.INFO, name, "1 sample missed (NaN)" if count == 1 else f"{count} samples missed (NaN)"
            )


def _about_position(q: str, measure: JointMeasures) -> Iterator[Finding]:
    """One joint's position channel: absent or stuck, and its encoder."""
    low, high = measure.position
    if np.isnan(low):
        yield Finding(Severity.WARNING, q, "no sample at all")
    elif low == high:
        yield Finding(Severity.WARNING, q, "never changes: the joint stood still or its encoder was not read")
    if measure.position_step is not None and measure.position_step > _MEANINGFUL_STEP:
        yield Finding(Severity.INFO, q, f"moves in steps of {measure.position_step:.3g} (encoder resolution)")


def _about_effort(effort: str, measure: JointMeasures, samples: int) -> Iterator[Finding]:
    """One joint's effort channel: stuck or clipped."""
    low, high = measure.effort
    if low == high:
        level = "is zero throughout" if low == 0 else f"never changes from {low:.6g}"
        yield Finding(Severity.WARNING, effort, f"{level}: was it recorded?")
    for level, count in measure.clipped:
        share = 100 * count / samples
        yield Finding(Severity.WARNING, effort, f"stays at exactly {level:.6g} for {share:.2g} % of the time: clipped")
