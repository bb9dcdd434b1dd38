"""One recording, surveyed once, from which conditioned motion can be drawn at any band, piece by piece."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from pydantic import Field

from tauscope.errors import RecordingError
from tauscope.recording.conditioning.motion import Motion, Trim, average_motion, transient_motion
from tauscope.recording.conditioning.motion_source import MotionSource, choose_sources
from tauscope.recording.conditioning.periods import Periods, repeats, split_periods, with_turns_removed
from tauscope.recording.conditioning.position_noise import (
    STANDING_STILL,
    PositionNoise,
    encoder_step,
    lowest_limit,
    position_noise,
)
from tauscope.recording.conditioning.timing import PeriodRun, Timing, find_stretches, row_at
from tauscope.recording.conditioning.uniform import Mask, Stretch, read_stretch, uniform_grid
from tauscope.recording.recording import Array, Recording, Samples
from tauscope.robot.robot import Robot
from tauscope.strict_model import ResultModel, take_fields


class ConditioningEntry(ResultModel):
    """What was done to one recording, and what was missing in it."""

    recording: str = Field(description="name as given")
    samples: int = Field(description="rows in the file")
    missed_positions: int = Field(description="rows without a complete position: bridged or split, and masked")
    missed_torques: list[int] = Field(description="per joint, samples without a torque: masked")
    dropped: int = Field(description="rows in pieces too short to filter")
    gaps: int = Field(description="long gaps at which the recording was split")
    rate_hz: float = Field(description="sampling rate [Hz]")
    resampled: bool = Field(description="whether stamps jittered so that signals were interpolated")
    averaged_periods: int = Field(description="periods averaged into one; 0 where none were")
    position_noise_std: list[float] = Field(description="per joint, noise of the positions [rad or m]")
    velocity_source: list[str] = Field(
        description="per joint, what q̇ and q̈ were taken from: position, recorded velocity or recorded acceleration"
    )


WINDOW_ROWS = 1 << 15  # rows conditioned at once: bounds memory whatever the recording's length
# Windows, spread over the recording, from which noise is estimated: it may begin with the arm at rest.
SURVEYED_WINDOWS = 4
# Samples of a period up to which periods are averaged: the regressor of one period is held in memory.
LONGEST_PERIOD = 2 * WINDOW_ROWS
AVERAGED_ROWS = 8 * WINDOW_ROWS  # rows that are averaged into one period at most, for the same reason
# A joint moves where its range exceeds `STANDING_STILL` standard deviations of its noise, and this [rad or m].
SMALLEST_MOTION = 1e-5
PERIOD_SPARE = 4  # rows read beyond the periods on either side, so that interpolation has neighbours


RESOLVED_STEPS = 2.0  # steps of an encoder that are motion
RESOLVED_STD = 4.0  # standard deviations of a position's noise that are motion


@dataclass(frozen=True, eq=False)
class Conditioner:
    """One recording, surveyed once, from which conditioned motion can be drawn at any band."""

    recording: Recording
    robot: Robot
    timing: Timing
    noise: PositionNoise
    source: MotionSource
    # (n,) or None, cut-off of the smoothing of motion that is not averaged, by joint [Hz]
    state_hz: Array | None = None

    @staticmethod
    def survey(recording: Recording, robot: Robot) -> "Conditioner":
        """Find stretches, noise and source of the motion. Raises RecordingError where no stretch is long enough."""
        timing = find_stretches(recording)
        spans = _spread_windows(timing.rows)
        step = encoder_step([recording.samples(*span).position for span in spans])
        stretches = [read_stretch(recording, robot, *span, timing) for span in spans]
        noise = position_noise(stretches, step)
        source = choose_sources(stretches, noise)
        noise = replace(noise, limit_hz=lowest_limit(source.limits_hz), joint_limits_hz=source.limits_hz)
        return Conditioner(recording, robot, timing, noise, source)

    def as_one_motion(self, state_hz: Array | None) -> "Conditioner":
        """The same recording with no period averaged, smoothed at `state_hz`, (n,) [Hz]."""
        return replace(self, timing=replace(self.timing, runs=()), state_hz=state_hz)

    @property
    def resolution(self) -> Array:
        """Change of position that is told from noise and from the encoder's step, (n,) [rad or m]."""
        return np.maximum(RESOLVED_STEPS * self.noise.step, RESOLVED_STD * self.position_noise_std)

    @property
    def position_noise_std(self) -> Array:
        """Standard deviation of the noise of each joint's position, (n,) [rad or m]."""
        return np.sqrt(self.noise.density * self.timing.rate_hz / 2.0)

    @cached_property
    def moving(self) -> Mask:
        """Joints that leave the noise of their own encoder at some time of the recording, (n,)."""
        joints = self.robot.joint_count
        lowest, highest = np.full(joints, np.inf), np.full(joints, -np.inf)
        for samples in self.usable_samples():
            position = np.ascontiguousarray(samples.position.T)
            lowest = np.fmin(lowest, np.fmin.reduce(position, axis=1))
            highest = np.fmax(highest, np.fmax.reduce(position, axis=1))
        return highest - lowest > np.maximum(STANDING_STILL * self.position_noise_std, SMALLEST_MOTION)

    def usable_samples(self) -> Iterator[Samples]:
        """The rows of all stretches as they were recorded, piece by piece."""
        for start, stop in self.timing.rows:
            for first in range(start, stop, WINDOW_ROWS):
                yield self.recording.samples(first, min(first + WINDOW_ROWS, stop))

    def motions(self, cutoff_hz: float | None) -> Iterator[Motion]:
        """The motion, piece by piece, in one band. Raises RecordingError where the filters' edges take all of it."""
        found = False
        for rows in self.timing.rows:
            for motion in self._stretch_motions(rows, cutoff_hz):
                found = True
                yield motion
        if not found:
            band = "the filters" if cutoff_hz is None else f"a band of {cutoff_hz:.3g} Hz"
            raise RecordingError(
                f"{self.recording.name}: too short for {band}: the edges take all of it;"
                " record longer or ask for a higher cut-off"
            )

    def summary(self, cutoff_hz: float | None) -> ConditioningEntry:
        """What was missing, and what was averaged in this band."""
        missed, resampled = np.zeros(self.robot.joint_count, int), False
        for samples in self.usable_samples():
            missed += np.isnan(samples.effort, order="F").sum(axis=0)
            time = samples.time[samples.complete]
            resampled = resampled or bool(len(time) > 1 and uniform_grid(time - time[0], self.timing.rate_hz) is None)
        groups = (self._average(group, cutoff_hz) for rows in self.timing.rows for group in self._groups(rows))
        return take_fields(
            ConditioningEntry,
            self.timing,
            recording=self.recording.name,
            missed_positions=self.timing.missed,
            missed_torques=missed.tolist(),
            resampled=resampled,
            averaged_periods=max((motion.repetitions for motion in groups if motion is not None), default=0),
            position_noise_std=self.position_noise_std.tolist(),
            velocity_source=[str(name) for name in self.source.in_band(cutoff_hz).names],
        )

    def _stretch_motions(self, rows: tuple[int, int], cutoff_hz: float | None) -> Iterator[Motion]:
        cursor = rows[0]
        half = 0.5 / self.timing.rate_hz
        for group in self._groups(rows):
            motion = self._average(group, cutoff_hz)
            if motion is not None:
                begin, end = (row_at(self.recording, time - half, rows) for time in (group.start_s, group.stop_s))
                yield from self._transients(cursor, begin, rows, cutoff_hz)
                yield motion
                cursor = end
        yield from self._transients(cursor, rows[1], rows, cutoff_hz)

    def _groups(self, rows: tuple[int, int]) -> Iterator[PeriodRun]:
        begin, end = (float(self.recording.samples(row, row + 1).time[0]) for row in (rows[0], rows[1] - 1))
        interval = 1.0 / self.timing.rate_hz
        for run in (run.within(rows, begin, end + interval, interval) for run in self.timing.runs):
            samples = run.length_s * self.timing.rate_hz
            if run.count < 2 or samples > LONGEST_PERIOD:
                continue
            parts = int(np.ceil(run.count / max(2.0, AVERAGED_ROWS // samples)))
            edges = np.linspace(0, run.count, parts + 1).astype(int)
            for first, last in pairwise(edges):
                if last - first >= 2:
                    yield run.part(int(first), int(last))

    def _average(self, group: PeriodRun, cutoff_hz: float | None) -> Motion | None:
        """The average of some periods; None where they do not repeat, or where torque is missing in all of them."""
        half = 0.5 / self.timing.rate_hz
        first, last = (row_at(self.recording, time - half, group.rows) for time in (group.start_s, group.stop_s))
        first, last = max(first - PERIOD_SPARE, group.rows[0]), min(last + PERIOD_SPARE, group.rows[1])
        timing = replace(self.timing, runs=(group,))
        periods = self._repeating(read_stretch(self.recording, self.robot, first, last, timing), cutoff_hz)
        if periods is None:
            return None
        motion = average_motion(periods, cutoff_hz, self.source.in_band(cutoff_hz))
        measured = np.asarray(motion.measured.any(axis=0))
        usable = motion.band.reduce_mask(measured.T).all(axis=1) | ~np.asarray(measured.any(axis=0))
        return motion if usable.all() else None

    def _repeating(self, stretch: Stretch, cutoff_hz: float | None) -> Periods | None:
        """The stretch's periods, where they repeat well enough to be averaged."""
        periods = split_periods(stretch, refine=True)
        if periods is None:
            return None
        periods = with_turns_removed(periods, [joint.type for joint in self.robot.joints])
        highest = stretch.rate_hz / 2.0 if cutoff_hz is None else cutoff_hz
        return periods if periods is not None and repeats(periods, highest, self.noise.density) else None

    def _transients(self, begin: int, end: int, rows: tuple[int, int], cutoff_hz: float | None) -> Iterator[Motion]:
        """Motion of the rows begin:end in windows that join without a seam: they overlap by what filters cost.

        Filters run on into averaged periods beside it by half the kernel: an output belongs to its kernel's centre.
        """
        trim = Trim.design(self.timing.rate_hz, cutoff_hz, self.state_hz)
        if end - begin < trim.factor:
            return
        spare = trim.margin + (trim.kernel - trim.factor) // 2
        first = max(begin - spare, rows[0])
        stop = min(end + spare, rows[1])
        overlap = 2 * trim.margin + trim.kernel - trim.factor
        size = max(WINDOW_ROWS, 2 * overlap)
        own_from, own_to = (_own_limit(self.recording, row, rows, self.timing.rate_hz) for row in (begin, end))
        while first < stop:
            last = first + size if first + size + (size - overlap) // 2 < stop else stop
            stretch = read_stretch(self.recording, self.robot, first, last, self.timing)
            motion = transient_motion(stretch, trim, self.source.in_band(cutoff_hz))
            if motion is not None:
                yield replace(motion, own=slice(*(int(i) for i in np.searchsorted(motion.time, [own_from, own_to]))))
                own_from = float(motion.time[-1]) + 0.5 / motion.rate_hz
            if last == stop:
                return
            step = trim.outputs(len(stretch.position)) * trim.factor
            following = stretch.start_s + (step - 0.5) / stretch.rate_hz
            first = max(first + 1, row_at(self.recording, following, (first, last)))


def _own_limit(recording: Recording, row: int, rows: tuple[int, int], rate_hz: float) -> float:
    """Instant just before a row, beyond all time at the ends of the stretch."""
    if row <= rows[0]:
        return -np.inf
    return np.inf if row >= rows[1] else float(recording.samples(row, row + 1).time[0]) - 0.5 / rate_hz


def _spread_windows(rows: tuple[tuple[int, int], ...]) -> list[tuple[int, int]]:
    """At most `SURVEYED_WINDOWS` windows, spread over the stretches: all of a short recording."""
    total = sum(stop - start for start, stop in rows)
    if total <= SURVEYED_WINDOWS * WINDOW_ROWS:
        cut = [(span, -(-(span[1] - span[0]) // WINDOW_ROWS)) for span in rows]
        edges = [np.linspace(*span, parts + 1).astype(int) for span, parts in cut]
        return [(int(a), int(b)) for edge in edges for a, b in pairwise(edge)]
    before = np.cumsum([0, *(stop - start for start, stop in rows)])
    spans = []
    for place in np.linspace(0, total - WINDOW_ROWS, SURVEYED_WINDOWS).astype(int):
        start, stop = rows[int(np.searchsorted(before, place, side="right")) - 1]
        offset = int(place - before[np.searchsorted(before, place, side="right") - 1])
        first = max(min(start + offset, stop - WINDOW_ROWS), start)
        spans.append((first, min(first + WINDOW_ROWS, stop)))
    return sorted(set(spans))
