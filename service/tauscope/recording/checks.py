"""What is in a recording, and what about it an engineer should look at before trusting it."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from dataclasses import field as dataclass_field
from pathlib import Path
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, PlainSerializer

from tauscope.errors import RecordingError
from tauscope.number_text import counted
from tauscope.recording.examination.examine import find_missing_effort, mend_recording
from tauscope.recording.examination.plausibility import find_implausible
from tauscope.recording.reading import read_recording
from tauscope.recording.recording import Array, EffortKind, Recording, Samples
from tauscope.recording.units import SI, Reading
from tauscope.robot.messages import Finding, Severity, listed
from tauscope.robot.robot import Robot
from tauscope.strict_model import entry

_ROWS_AT_ONCE = 2**15
_KEPT_STEPS = 10**6
_GAP_FACTOR = 1.9
_WRAP_TOLERANCE = 0.5
_STEP_SAMPLES = 30
_CLIPPED_RUN = 5
_CLIPPED_SHARE = 0.005
_CLIPPED_SAMPLES = 10
# A number; NaN, which JSON does not know, is null there: nothing was measured.
Measured = Annotated[float, PlainSerializer(lambda value: None if math.isnan(value) else value, float | None)]


@entry
class StepMeasures:
    """Steps of the clock [s]; the percentiles are those of at most a million evenly chosen steps."""

    minimum: float = Field(description="shortest")
    percentile_1: float = Field(description="1 % are shorter")
    median: float = Field(description="half are shorter")
    percentile_99: float = Field(description="99 % are shorter")
    maximum: float = Field(description="longest")


@entry
class JointMeasures:
    """One joint's channels."""

    position: tuple[Measured, Measured] = Field(description="least and greatest value [rad or m]; null without samples")
    effort: tuple[Measured, Measured] = Field(description="least and greatest value [Nm, N or drive units]")
    position_step: float | None = Field(description="step in multiples of which the position moves [rad or m]")
    wraps: int = Field(description="jumps of the position by about 2π")
    first_wrap: float | None = Field(description="time of the first of them [s]")
    clipped: tuple[tuple[float, int], ...] = Field(description="levels at which the effort stays, and samples there")


@entry
class Gaps:
    """Steps of the clock beyond 1.9 medians: one lost sample of a regular clock is one."""

    count: int = Field(description="how many")
    longest: float = Field(description="the longest [s]; 0 without gaps")
    longest_at: float | None = Field(description="time at which it begins [s]")


@dataclass(frozen=True)
class RowMeasures:
    """All figures but the gaps."""

    duration: float  # from the first to the last sample [s]
    steps: StepMeasures
    missed: dict[str, int]
    period_lengths: tuple[int, ...]
    joints: tuple[JointMeasures, ...]


@dataclass
class _Running:
    """Figures that grow from block to block."""

    least: Array
    greatest: Array
    missed: NDArray[np.int64]
    wraps: NDArray[np.int64]
    first_wrap: Array
    steps: list[Array] = dataclass_field(default_factory=list)
    shortest_step: float = np.inf
    longest_step: float = 0.0
    period_lengths: list[int] = dataclass_field(default_factory=list)
    period: float = np.nan


def measure_rows(recording: Recording) -> RowMeasures:
    """Take every figure that needs no other figure first, and then the clipped samples."""
    n, columns = recording.joint_count, len(recording.table.names)
    least, greatest, missed = np.full(columns, np.inf), np.full(columns, -np.inf), np.zeros(columns, dtype=np.int64)
    running = _Running(least, greatest, missed, np.zeros(n, dtype=np.int64), np.full(n, np.nan))
    stride = max(1, -(-len(recording) // _KEPT_STEPS))
    for start in range(0, len(recording), _ROWS_AT_ONCE):
        # One sample more than the block, so that the steps between blocks are seen too.
        samples = recording.samples(max(start - 1, 0), start + _ROWS_AT_ONCE)
        block = recording.table.rows(start, min(start + _ROWS_AT_ONCE, len(recording)))
        running.missed += np.isnan(block).sum(axis=0)
        running.least = np.fmin(running.least, np.fmin.reduce(block, axis=0))
        running.greatest = np.fmax(running.greatest, np.fmax.reduce(block, axis=0))
        _measure_steps(running, samples, stride)
        if samples.period is not None:
            _measure_periods(running, samples.period if start == 0 else samples.period[1:])
    least, greatest = (np.where(np.isinf(values), np.nan, values) for values in (running.least, running.greatest))
    clipped = _find_clipped(recording, running.least[n + 1 : 2 * n + 1], running.greatest[n + 1 : 2 * n + 1])
    first = recording.samples(0, _ROWS_AT_ONCE)
    joints = tuple(
        JointMeasures(
            position=(float(least[1 + j]), float(greatest[1 + j])),
            effort=(float(least[1 + n + j]), float(greatest[1 + n + j])),
            position_step=_position_step(first.position[:, j]),
            wraps=int(running.wraps[j]),
            first_wrap=float(running.first_wrap[j]) if running.wraps[j] else None,
            clipped=clipped[j],
        )
        for j in range(n)
    )
    low, median, high = (float(value) for value in np.percentile(np.concatenate(running.steps), [1, 50, 99]))
    steps = StepMeasures(running.shortest_step, low, median, high, running.longest_step)
    missed = {name: int(count) for name, count in zip(recording.table.names, running.missed, strict=True) if count}
    return RowMeasures(float(greatest[0] - least[0]), steps, missed, tuple(running.period_lengths), joints)


def measure_gaps(recording: Recording, measures: RowMeasures) -> Gaps:
    """Find where the clock skips."""
    limit = _GAP_FACTOR * measures.steps.median
    count, longest, longest_at = 0, 0.0, None
    for start in range(0, len(recording), _ROWS_AT_ONCE):
        time = recording.samples(max(start - 1, 0), start + _ROWS_AT_ONCE).time
        steps = np.diff(time)
        count += int((steps > limit).sum())
        if len(steps) and steps.max() > max(limit, longest):
            longest, longest_at = float(steps.max()), float(time[np.argmax(steps)])
    return Gaps(count, longest, longest_at)


def _measure_steps(running: _Running, samples: Samples, stride: int) -> None:
    steps = np.diff(samples.time)
    if not len(steps):
        return
    running.steps.append(steps[::stride])
    running.shortest_step = min(running.shortest_step, float(steps.min()))
    running.longest_step = max(running.longest_step, float(steps.max()))
    turned = np.abs(np.abs(np.diff(samples.position, axis=0)) - 2 * np.pi) < _WRAP_TOLERANCE
    for joint in np.flatnonzero(turned.any(axis=0)):
        if not running.wraps[joint]:
            running.first_wrap[joint] = samples.time[1 + np.argmax(turned[:, joint])]
        running.wraps[joint] += turned[:, joint].sum()


def _measure_periods(running: _Running, period: Array) -> None:
    """Lengths of the runs of one period index; NaN belongs to no run."""
    edges = np.flatnonzero(np.diff(period, prepend=np.nan) != 0)
    for start, stop in zip(edges, [*edges[1:], len(period)], strict=True):
        index = float(period[start])
        if index == running.period:
            running.period_lengths[-1] += int(stop - start)
        elif not np.isnan(index):
            running.period_lengths.append(int(stop - start))
        running.period = index


def _position_step(position: Array) -> float | None:
    """The least step of q, where the small steps are its multiples: an encoder's resolution."""
    moves = np.abs(np.diff(position))
    resting = int((moves == 0).sum())
    moves = moves[moves > 1e-9 * max(float(np.nanmax(np.abs(position), initial=0.0)), 1e-300)]
    if len(moves) < _STEP_SAMPLES:
        return None
    step = float(np.percentile(moves, 1))
    multiples = moves[moves < 20 * step] / step
    if len(multiples) < len(moves) / 2 or np.abs(multiples - np.rint(multiples)).max() > 0.1:
        return None
    # Motion at one speed has equal steps too; an encoder also shows none and two at a time.
    if resting + int((multiples > 1.5).sum()) < len(moves) / 100:
        return None
    return float(np.median(moves[moves < 1.5 * step]))


def _find_clipped(recording: Recording, least: Array, greatest: Array) -> list[tuple[tuple[float, int], ...]]:
    """Levels, of the two extremes of each joint's effort, at which it stays for several samples time and again."""
    from scipy.ndimage import binary_opening  # slow to import, and a control process reads no recordings

    levels = np.stack([least, greatest])
    counts = np.zeros(levels.shape, dtype=np.int64)
    for start in range(0, len(recording), _ROWS_AT_ONCE):
        effort = recording.samples(start, start + _ROWS_AT_ONCE).effort
        for side in range(2):
            # Every sample that a run of five covers counts once.
            counts[side] += binary_opening(effort == levels[side], np.ones((_CLIPPED_RUN, 1), dtype=int)).sum(axis=0)
    # The lower extreme of an effort that never changes sign is rest, not a limit.
    is_limit = (np.abs(levels) > np.abs(levels).max(axis=0) / 2) & (least < greatest)
    enough = (counts >= max(_CLIPPED_SAMPLES, _CLIPPED_SHARE * len(recording))) & is_limit
    return [
        tuple((float(levels[side, j]), int(counts[side, j])) for side in range(2) if enough[side, j])
        for j in range(recording.joint_count)
    ]


_MEANINGFUL_STEP = 1e-4


@entry
class Periods:
    """Repeats of the excitation."""

    count: int = Field(description="how many are marked")
    shortest: int = Field(description="samples of the shortest")
    longest: int = Field(description="samples of the longest")


@entry
class RecordingReport:
    """What `check_recording` found."""

    name: str = Field(description="of the recording")
    samples: int = Field(description="number of samples")
    duration_s: float = Field(description="from the first to the last sample [s]")
    rate_hz: float = Field(description="1 / median step [Hz]")
    effort_kind: EffortKind = Field(description="torque (tau), or drive units (i)")
    columns: tuple[str, ...] = Field(description="columns that are read")
    ignored_columns: tuple[str, ...] = Field(description="columns that nobody reads")
    missed: dict[str, int] = Field(description="number of NaN in each column that has any")
    steps: StepMeasures = Field(description="of the clock")
    gaps: Gaps = Field(description="where the clock skips")
    periods: Periods | None = Field(description="repeats of the excitation, where they are marked")
    joints: tuple[JointMeasures, ...] = Field(description="one a joint")
    findings: tuple[Finding, ...] = Field(description="warnings first")

    def require_usable(self) -> None:
        """Raise RecordingError where a column can hardly be in its unit, or a joint has no effort."""
        for finding in self.findings:
            if finding.severity is Severity.ERROR:
                raise RecordingError(f"{self.name}: column {finding.where}: {finding.text}")


def check_recording(
    path: str | Path, joint_count: int | None = None, robot: Robot | None = None, reading: Reading = SI
) -> RecordingReport:
    """Read a recording and report on it in bounded memory. Raises RecordingError where it breaks a rule."""
    reading = reading.for_robot(robot)
    joints = None if robot is None else [joint.name for joint in robot.joints]
    recording = read_recording(path, joint_count, joints, reading)
    return report_recording(recording, robot, trust_units=reading.trust_units)


def report_recording(recording: Recording, robot: Robot | None = None, *, trust_units: bool = False) -> RecordingReport:
    """Report what a recording holds; what no other verb accepts is among the findings, as an error."""
    measures = measure_rows(recording)
    gaps = measure_gaps(recording, measures)
    runs = measures.period_lengths
    findings = [*_about_units(recording, robot, trust_units=trust_units)]
    findings += [_locate(Severity.WARNING, note.text) for note in mend_recording(recording, robot).notes]
    findings += _about_columns(recording)
    if gaps.count:
        longest = f"the longest, {gaps.longest:.4g} s, begins at t = {gaps.longest_at:.6g} s"
        findings.append(Finding(Severity.WARNING, "t", f"{counted(gaps.count, 'gap')} in the clock; {longest}"))
    missed = {name: counted(count, "sample") for name, count in measures.missed.items() if name != "period"}
    findings += [Finding(Severity.INFO, name, f"{text} missed (NaN)") for name, text in missed.items()]
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


def _locate(severity: Severity, text: str) -> Finding:
    """A finding from a text that begins with its column."""
    where, found, rest = text.partition(": ")
    place = where.removeprefix("columns ").removeprefix("column ")
    return Finding(severity, place, rest) if found and place != where else Finding(severity, "t", text)


def _about_columns(recording: Recording) -> Iterator[Finding]:
    currents = [f"i{joint}" for joint in range(1, recording.joint_count + 1)]
    passed_over = [name for name in recording.ignored_columns if name in currents]
    others = [name for name in recording.ignored_columns if name not in currents]
    if passed_over:
        yield Finding(Severity.INFO, ", ".join(passed_over), "currents are not read where torques are there")
    if others:
        yield Finding(Severity.INFO, listed(others), "not read: no column of this name is known")


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
