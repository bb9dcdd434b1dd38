"""How a recording was sampled: its rate, the pieces between long gaps, and where its excitation repeats.

Column `period` is an index: it steps by one wherever the next period begins. The steps' instants lie on a straight line
over the index, whose slope is the length of a period; the first and the last period of a recording may be cut short.

Read once, in blocks: of ten million samples only their intervals are kept.
"""

from bisect import bisect_left
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from tauscope.errors import RecordingError
from tauscope.recording.recording import Array, Recording

# Distance of a step from the line through all of them, in sample intervals, that rounding to a sample explains.
STEP_TOLERANCE = 1.5
LATE_STEPS = 0.4  # share of the steps that may lie off the line because the first sample of their period was missed
MOST_STEPS = 100  # steps to which the line is fitted
SHORTEST_PERIOD = 32  # samples below which a period is none
WHOLE_PERIOD = 1e-6  # part of a period that rounding may take from the last one


@dataclass(frozen=True)
class PeriodRun:
    """Consecutive periods of one length."""

    rows: tuple[int, int]  # rows of the stretch in which it lies
    start_s: float
    stop_s: float
    length_s: float
    first: float

    @property
    def count(self) -> int:
        """Number of whole periods."""
        return int((self.stop_s - self.start_s) / self.length_s + WHOLE_PERIOD)

    def within(self, rows: tuple[int, int], begin_s: float, end_s: float, interval_s: float) -> "PeriodRun":
        """What of the run lies within a stretch from `begin_s` to `end_s`; its `count` is 0 where nothing does."""
        slack = STEP_TOLERANCE * interval_s
        start = self.start_s if self.start_s > begin_s - slack else begin_s
        stop = self.stop_s if self.stop_s < end_s + slack else end_s
        return PeriodRun(rows, start, max(start, stop), self.length_s, self._at(start))

    def part(self, first: int, last: int) -> "PeriodRun":
        """Some of its periods, counted from its start."""
        start = self.start_s + first * self.length_s
        return PeriodRun(self.rows, start, self.start_s + last * self.length_s, self.length_s, self._at(start))

    def _at(self, time_s: float) -> float:
        return self.first + (time_s - self.start_s) / self.length_s

    def progress(self, origin_s: float, elapsed: Array) -> Array:
        """Index of the period plus the part of it that is over, (N,), `elapsed` (N,) after an origin; NaN outside."""
        since = (origin_s - self.start_s) + elapsed
        slack = WHOLE_PERIOD * self.length_s
        inside = (since >= -slack) & (since < self.stop_s - self.start_s - slack)
        return np.where(inside, self.first + since / self.length_s, np.nan)


@dataclass(frozen=True, eq=False)
class PeriodLabels:
    """Column `period` of a recording, kept as its steps."""

    time: Array  # (K,), instants at which the label changes, the first sample's own first [s]
    label: Array  # (K,), the label from then on; NaN outside the repeated part
    row: NDArray[np.int_]  # (K,) int, rows at which it changes

    def runs(self, rows: tuple[int, int], begin_s: float, end_s: float, interval_s: float) -> Iterator[PeriodRun]:
        """The runs of periods of equal length within one stretch, from row rows[0] to before rows[1]."""
        first = max(int(np.searchsorted(self.row, rows[0], side="right")) - 1, 0)
        last = int(np.searchsorted(self.row, rows[1]))
        begin = np.maximum(self.time[first:last], begin_s)
        label = self.label[first:last]
        borders = np.flatnonzero(np.diff(label) != 1.0) + 1
        edges = [0, *(int(border) for border in borders), len(label)]
        for a, b in pairwise(edges):
            if b - a > 1:
                run = _run(rows, label[a:b], np.append(begin[a:b], begin[b] if b < len(begin) else end_s), interval_s)
                if run is not None and run.length_s >= SHORTEST_PERIOD * interval_s and run.count >= 2:
                    yield run


def _run(rows: tuple[int, int], label: Array, edge: Array, interval_s: float) -> PeriodRun | None:
    if len(label) == 2:
        # Both periods may be cut short; that they are not shows only in their being equally long.
        before, after = np.diff(edge)
        if abs(before - after) > STEP_TOLERANCE * interval_s:
            return None
        length = float(max(before, after))
        return PeriodRun(rows, float(edge[1]) - length, float(edge[1]) + length, length, float(label[0]))
    line = _line(label[1:], edge[1:-1], interval_s)
    if line is None:
        return None
    second, length = line  # instant at which the second label begins
    slack = STEP_TOLERANCE * interval_s
    start = edge[0] if edge[0] > second - length - slack else second - length
    last = second + (len(label) - 1) * length
    stop = edge[-1] if edge[-1] < last + slack else last
    return PeriodRun(rows, float(start), float(stop), length, float(label[1] - (second - start) / length))


def _line(label: Array, step: Array, interval_s: float) -> tuple[float, float] | None:
    """Instant of the first step and time from step to step; None where they are unevenly spaced.

    Least absolute deviations, none counted as more than half a sample: most steps lie on the line as nearly as sampling
    allows; where the first sample of a period was missed one lies late, by however much.
    """
    chosen = np.unique(np.linspace(0, len(step) - 1, min(len(step), MOST_STEPS)).astype(int))
    count, since = (label - label[0])[chosen], (step - step[0])[chosen]  # epoch seconds would cost digits
    later, earlier = np.tril_indices(len(chosen), -1)
    slopes = (since[later] - since[earlier]) / (count[later] - count[earlier])
    rest = since - slopes[:, None] * count
    starts = np.median(rest, axis=1)
    deviation = np.abs(rest - starts[:, None])
    best = int(np.argmin(np.minimum(deviation, 0.5 * interval_s).sum(axis=1)))
    if np.mean(deviation[best] <= STEP_TOLERANCE * interval_s) < 1.0 - LATE_STEPS:
        return None
    return float(step[0] + starts[best]), float(slopes[best])


SCAN_ROWS = 1 << 17  # rows read at once while looking for gaps
BRIDGED_SAMPLES = 5.5
BRIDGED_SECONDS = 0.0125
LONGEST_BRIDGE_S = 0.05
MOST_BRIDGED_SAMPLES = 32.0
# A gap is bridged up to `BRIDGED_SAMPLES` intervals or `BRIDGED_SECONDS`, whichever is longer: an arm moves along a
# cubic that long. A single missing sample always is; beyond it `LONGEST_BRIDGE_S` and `MOST_BRIDGED_SAMPLES` are the
# end.
FEWEST_BRIDGED_SAMPLES = 2.5
ONE_INTERVAL = 1.75  # multiple of the typical interval above which a sample is missing
# Share of single intervals below which stamps rounded to the interval itself are taken to be coarse, not missing.
COARSE_SINGLES = 0.85
BURST_TIME = 0.1  # share of the time below which the usual interval cannot be the sampling interval
MEDIAN_SAMPLES = 1 << 20

# Samples below which a stretch between two long gaps cannot be filtered and is left out (and counted).
SHORTEST_STRETCH = 32


@dataclass(frozen=True, eq=False)
class Timing:
    """How a recording was sampled."""

    rate_hz: float
    rows: tuple[tuple[int, int], ...]  # ranges without a long gap, each at least `SHORTEST_STRETCH` complete rows
    samples: int
    missed: int
    dropped: int
    gaps: int
    runs: tuple[PeriodRun, ...] = ()

    def progress(self, origin_s: float, elapsed: Array) -> Array | None:
        """Progress through the repeated excitation, `elapsed` (N,) after an origin; None where nothing repeats."""
        near = [run for run in self.runs if run.start_s < origin_s + elapsed[-1] and run.stop_s > origin_s + elapsed[0]]
        if not near:
            return None
        progress = np.full(len(elapsed), np.nan)
        for run in near:
            progress = np.fmax(progress, run.progress(origin_s, elapsed))
        return progress


def find_stretches(recording: Recording) -> Timing:
    """Row ranges that can be filtered in one go. Raises RecordingError where none is long enough."""
    interval, incomplete, labels = _scan(recording)
    count = len(recording) - len(incomplete)
    if count < SHORTEST_STRETCH:
        raise RecordingError(
            f"{recording.name}: only {count} rows have a position for every joint; at least {SHORTEST_STRETCH} are"
            " needed: check which q columns are empty"
        )
    typical, rate = _typical_interval(interval)
    longest = max(min(BRIDGED_SAMPLES * typical, LONGEST_BRIDGE_S), BRIDGED_SECONDS)
    longest = max(min(longest, MOST_BRIDGED_SAMPLES * typical), FEWEST_BRIDGED_SAMPLES * typical)
    breaks = np.flatnonzero(interval > longest) + 1
    edges = np.concatenate([[0], breaks, [count]])
    long_enough = np.diff(edges) >= SHORTEST_STRETCH
    first, last = edges[:-1][long_enough], edges[1:][long_enough] - 1
    if not len(first):
        raise RecordingError(
            f"{recording.name}: broken by {len(breaks)} gaps into pieces of fewer than {SHORTEST_STRETCH} samples:"
            " record again, or check column t"
        )
    complete = np.concatenate([first, last])  # of complete rows: each is as many further as incomplete ones before
    row = complete + np.searchsorted(incomplete - np.arange(len(incomplete)), complete, side="right")
    rows = tuple((int(a), int(b) + 1) for a, b in zip(row[: len(first)], row[len(first) :], strict=True))
    dropped = count - int(np.sum(last - first + 1))
    runs = () if labels is None else _runs(recording, labels, rows, 1.0 / rate)
    return Timing(rate, rows, len(recording), len(incomplete), dropped, len(breaks), runs)


def row_at(recording: Recording, time_s: float, rows: tuple[int, int]) -> int:
    """First of the rows that is not before an instant; the one after the last where all are."""
    found = bisect_left(range(*rows), time_s, key=lambda row: float(recording.table.rows(row, row + 1)[0, 0]))
    return rows[0] + found


def _scan(recording: Recording) -> tuple[Array, NDArray[np.int_], PeriodLabels | None]:
    """Intervals between complete rows, the rows that are not, and the steps of column `period`."""
    interval = np.empty(len(recording))
    incomplete, steps = [np.empty(0, dtype=int)], []
    count, previous_time, previous_label = 0, None, None
    for start in range(0, len(recording), SCAN_ROWS):
        samples = recording.samples(start, min(start + SCAN_ROWS, len(recording)))
        complete = samples.complete
        incomplete.append(np.flatnonzero(~complete) + start)
        time = samples.time[complete]
        if not len(time):
            continue
        before = time[0] if previous_time is None else previous_time
        interval[count : count + len(time)] = np.diff(time, prepend=before)
        count, previous_time = count + len(time), time[-1]
        if samples.period is not None:
            label = samples.period[complete]
            before_label = np.concatenate([[np.inf if previous_label is None else previous_label], label[:-1]])
            changed = (label != before_label) & ~(np.isnan(label) & np.isnan(before_label))
            steps.append((time[changed], label[changed], np.flatnonzero(complete)[changed] + start))
            previous_label = label[-1]
    labels = PeriodLabels(*(np.concatenate(parts) for parts in zip(*steps, strict=True))) if steps else None
    return interval[1:count], np.concatenate(incomplete), labels


def _typical_interval(interval: Array) -> tuple[float, float]:
    stride = (len(interval) // MEDIAN_SAMPLES) | 1  # odd: stamps that come in pairs are not seen one-sidedly
    few = interval[::stride]
    median = float(np.median(few))
    single = interval < ONE_INTERVAL * median
    between = interval <= max(BRIDGED_SAMPLES * median, BRIDGED_SECONDS)
    mean = float(np.mean(interval, where=between))
    # Stamps in bursts: most samples follow at once, as buffers are emptied. Only their mean is a rate.
    in_bursts = np.sum(interval, where=single) < BURST_TIME * np.sum(interval, where=between)
    if in_bursts or (np.mean(single) < COARSE_SINGLES and _is_last_digit(median, few)):
        return mean, 1.0 / mean
    return median, 1.0 / float(np.mean(interval, where=single))


def _is_last_digit(median_s: float, interval: Array) -> bool:
    """Whether stamps are rounded to the interval itself, so that two of them seem a sample apart that are not."""
    steps = interval / median_s
    is_decimal = abs(np.log10(median_s) - np.rint(np.log10(median_s))) < 1e-3
    return bool(is_decimal and np.abs(steps - np.rint(steps)).max() < 1e-2)


def _runs(
    recording: Recording, labels: PeriodLabels, rows: tuple[tuple[int, int], ...], interval_s: float
) -> tuple[PeriodRun, ...]:
    """Runs of repeated periods; none goes across a long gap."""
    runs = []
    for start, stop in rows:
        begin = float(recording.samples(start, start + 1).time[0])
        end = float(recording.samples(stop - 1, stop).time[0]) + interval_s
        runs += labels.runs((start, stop), begin, end, interval_s)
    return tuple(runs)
