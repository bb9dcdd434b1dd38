"""How a recording was sampled: its rate, the pieces between long gaps, and where its excitation repeats.

Read once, in blocks: of ten million samples only their intervals are kept.
"""

from bisect import bisect_left
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tauscope.errors import RecordingError
from tauscope.recording.conditioning.period_runs import PeriodLabels, PeriodRun
from tauscope.recording.recording import Array, Recording

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
    """How a recording was sampled.

    `rows`: tuple of (int, int), row ranges without a long gap, each at least `SHORTEST_STRETCH` complete rows.
    """

    rate_hz: float
    rows: tuple[tuple[int, int], ...]
    samples: int
    missed: int
    dropped: int
    gaps: int
    runs: tuple[PeriodRun, ...] = ()

    def progress(self, origin_s: float, elapsed: Array) -> Array | None:
        """Progress through the repeated excitation, (N,); NaN outside, None where nothing repeats in this time.

        `origin_s`: an instant [s]; `elapsed`: (N,), time since then, increasing [s].
        """
        near = [run for run in self.runs if run.start_s < origin_s + elapsed[-1] and run.stop_s > origin_s + elapsed[0]]
        if not near:
            return None
        progress = np.full(len(elapsed), np.nan)
        for run in near:
            progress = np.fmax(progress, run.progress(origin_s, elapsed))
        return progress


def find_stretches(recording: Recording) -> Timing:
    """Row ranges of `recording` that can be filtered in one go.

    Raises RecordingError where no stretch is long enough to be used.
    """
    interval, incomplete, labels = _scan(recording)
    count = len(recording) - len(incomplete)
    if count < SHORTEST_STRETCH:
        raise RecordingError(
            f"{recording.name}: only {count} rows have a position for every joint; at least {SHORTEST_STRETCH} are"
            " needed: check which q columns are empty"
        )
    typical, rate = _typical_interval(interval)
    breaks = np.flatnonzero(interval > _longest_bridge(typical)) + 1
    edges = np.concatenate([[0], breaks, [count]])
    long_enough = np.diff(edges) >= SHORTEST_STRETCH
    first, last = edges[:-1][long_enough], edges[1:][long_enough] - 1
    if not len(first):
        raise RecordingError(
            f"{recording.name}: broken by {len(breaks)} gaps into pieces of fewer than {SHORTEST_STRETCH} samples:"
            " record again, or check column t"
        )
    row = _row_of(np.concatenate([first, last]), incomplete)
    rows = tuple((int(a), int(b) + 1) for a, b in zip(row[: len(first)], row[len(first) :], strict=True))
    dropped = count - int(np.sum(last - first + 1))
    runs = () if labels is None else _runs(recording, labels, rows, 1.0 / rate)
    return Timing(rate, rows, len(recording), len(incomplete), dropped, len(breaks), runs)


def row_at(recording: Recording, time_s: float, rows: tuple[int, int]) -> int:
    """First of the rows that is not before an instant; the one after the last where all are.

    `time_s`: the instant [s]; `rows`: (int, int), first and one-past-last row to look at.
    """
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
    """Time from sample to sample, and the sampling rate, from intervals of which some are gaps."""
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


def _longest_bridge(typical_s: float) -> float:
    """Longest interval that is bridged [s]."""
    longest = max(min(BRIDGED_SAMPLES * typical_s, LONGEST_BRIDGE_S), BRIDGED_SECONDS)
    return max(min(longest, MOST_BRIDGED_SAMPLES * typical_s), FEWEST_BRIDGED_SAMPLES * typical_s)


def _row_of(complete: NDArray[np.int_], incomplete: NDArray[np.int_]) -> NDArray[np.int_]:
    """Rows of complete samples, counted among themselves: as many further as incomplete ones lie before them."""
    return complete + np.searchsorted(incomplete - np.arange(len(incomplete)), complete, side="right")


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
