"""Where the excitation repeats, told from column `period`: how long a period lasts and which are complete.

The column is an index: it steps by one wherever the next period begins. The steps' instants lie on a straight line over
the index, whose slope is the length of a period; the first and the last period of a recording may be cut short.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from tauscope.recording.recording import Array

# Distance of a step from the line through all of them, in sample intervals, that rounding to a sample explains.
STEP_TOLERANCE = 1.5
LATE_STEPS = 0.4  # share of the steps that may lie off the line because the first sample of their period was missed
MOST_STEPS = 100  # steps to which the line is fitted
SHORTEST_PERIOD = 32  # samples below which a period is none
WHOLE_PERIOD = 1e-6  # part of a period that rounding may take from the last one


@dataclass(frozen=True)
class PeriodRun:
    """Consecutive periods of one length.

    `rows`: (int, int), rows of the stretch in which it lies.
    """

    rows: tuple[int, int]
    start_s: float
    stop_s: float
    length_s: float
    first: float

    @property
    def count(self) -> int:
        """Number of whole periods."""
        return int((self.stop_s - self.start_s) / self.length_s + WHOLE_PERIOD)

    def within(self, rows: tuple[int, int], begin_s: float, end_s: float, interval_s: float) -> "PeriodRun":
        """What of the run lies within a stretch; its `count` is 0 where nothing does.

        `rows`: (int, int), rows of the stretch; `begin_s`, `end_s`: instants of its first sample and of the end of its
        last one [s]; `interval_s`: time from sample to sample [s].
        """
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
        """Index of the period plus the part of it that is over, (N,); NaN outside the run.

        `origin_s`: an instant [s]; kept apart because epoch seconds would cost digits; `elapsed`: (N,), time since then
        [s].
        """
        since = (origin_s - self.start_s) + elapsed
        slack = WHOLE_PERIOD * self.length_s
        inside = (since >= -slack) & (since < self.stop_s - self.start_s - slack)
        return np.where(inside, self.first + since / self.length_s, np.nan)


@dataclass(frozen=True, eq=False)
class PeriodLabels:
    """Column `period` of a recording, kept as its steps.

    `time`: (K,), instants at which the label changes, the first sample's own first [s].
    `label`: (K,), the label from then on; NaN outside the repeated part.
    `row`: (K,) int, rows at which it changes.
    """

    time: Array
    label: Array
    row: NDArray[np.int_]

    def runs(self, rows: tuple[int, int], begin_s: float, end_s: float, interval_s: float) -> Iterator[PeriodRun]:
        """The runs of periods of equal length within one stretch of a recording.

        `rows`: (int, int), the stretch, as first and one-past-last row; `begin_s`, `end_s`: instants of its first
        sample and of the end of its last one [s]; `interval_s`: time from sample to sample [s].
        """
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
    """One run of consecutive labels between K + 1 edges, or None where their lengths differ."""
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
