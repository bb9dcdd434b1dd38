"""Efforts that no drive measured: stuck values, spikes, and stretches of exactly zero."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tauscope.recording.examination.edits import NO_NUMBERS, Numbers, Rows, find_runs, row_numbers
from tauscope.recording.examination.scales import (
    BLOCK_ROWS,
    NEIGHBOURS,
    EffortScale,
    distance_beyond,
    is_new,
    neighbour_windows,
)
from tauscope.recording.recording import Recording, Samples
from tauscope.recording.samples import Array

SURPRISE = 20.0  # multiple of the usual distance beyond the neighbours' range above which a sample is a spike
SPAN = 0.15  # share of the effort's usual range that this distance exceeds, too
STUCK_ROWS = 10  # rows for which a stuck value is repeated, at least
STUCK_RUNS = 5  # multiple of the rows for which values usually are
# Rows for which noise lets no value be repeated: where it does, the effort comes in coarse steps and may rest.
USUAL_RUN = 3
ONE_STEP = 1.5  # smallest steps of the effort below which a change is one of them
LEAST_MOVE = 0.01  # distance above which a joint moves within some rows [rad or m]


def find_stuck(rows: Numbers, effort: Array, position: Array, scale: EffortScale) -> Numbers:
    """Which `rows` (N,) of a joint's `effort` (N,) are stuck while any `position` (N, n) moves."""
    if scale.run > USUAL_RUN * scale.hold:
        return NO_NUMBERS
    change = np.diff(effort, prepend=np.nan)
    same = (change == 0.0) & (effort > scale.low) & (effort < scale.high)  # a clipped value is not stuck
    found = _find_stuck_rows(np.arange(len(effort)), same, position, max(STUCK_ROWS, STUCK_RUNS * scale.run))
    return rows[_leave_turns_out(found, change)]


def _leave_turns_out(stuck: Numbers, change: Array) -> Numbers:
    """Rows of values that end with a jump: one that goes on by a single step of the drive's was turning, not stuck."""
    steps = np.abs(change[np.isfinite(change) & (change != 0.0)])
    if not len(stuck) or not len(steps):
        return stuck
    runs = np.split(stuck, np.flatnonzero(np.diff(stuck) > 1) + 1)
    after = [min(run[-1] + 1, len(change) - 1) for run in runs]
    turns = [0.0 < abs(change[place]) < ONE_STEP * steps.min() for place in after]
    return np.concatenate([NO_NUMBERS, *(run for run, turn in zip(runs, turns, strict=True) if not turn)])


def find_all_stuck(rows: Numbers, effort: Array, position: Array, scales: Sequence[EffortScale]) -> Numbers:
    """Which `rows` (N,) repeat the `effort` (N, n) of all joints at once, while any `position` (N, n) moves."""
    if len(scales) < 2 or not any(0 < scale.run <= USUAL_RUN * scale.hold for scale in scales):
        return NO_NUMBERS
    same = np.concatenate([[False], (effort[1:] == effort[:-1]).all(axis=1) & (effort[1:] != 0.0).any(axis=1)])
    return _find_stuck_rows(rows, same, position, max(STUCK_ROWS, *(STUCK_RUNS * scale.hold for scale in scales)))


def _find_stuck_rows(rows: Numbers, same: NDArray[np.bool_], position: Array, least: int) -> Numbers:
    """Rows that repeat a value, where it stands in `least` rows or more while the arm moves; the first was measured."""
    runs = find_runs(same)
    long = runs[runs[:, 1] - runs[:, 0] >= least - 1]
    return np.concatenate([NO_NUMBERS, *(rows[a:b] for a, b in long if is_moving(position[a - 1 : b]))])


def find_spikes(rows: Numbers, effort: Array, scale: EffortScale) -> Numbers:
    """Which `rows` (N,) have an `effort` (N,) of one joint far from all of their neighbours."""
    if scale.hold > 1:  # a held spike is as wide as the hold: one row of each run is judged, for all of them
        firsts = np.flatnonzero(is_new(effort))
        spikes = find_spikes(firsts, effort[firsts], replace(scale, hold=1))
        stops = np.append(firsts, len(effort))[np.searchsorted(firsts, spikes) + 1]
        return rows[row_numbers(np.column_stack([spikes, stops]))]
    least = max(SURPRISE * scale.surprise, SPAN * scale.span)
    large = np.flatnonzero(np.abs(np.diff(effort)) > least)
    # Most blocks have no change as large, and neighbours are dear: only the surroundings are looked at.
    if not len(large) or least == 0.0 or len(effort) < 2 * NEIGHBOURS + 1:
        return NO_NUMBERS
    near = np.unique(large[:, None] + np.arange(2))
    # At the ends there are neighbours on one side only, and a signal that rises is beyond all of them.
    is_end = (near < NEIGHBOURS) | (near >= len(effort) - NEIGHBOURS)
    limit = np.where(is_end, max(least, scale.span), least)
    found = near[distance_beyond(neighbour_windows(effort)[near]) > limit]
    if not len(found):
        return NO_NUMBERS
    # The highest of several spikes hides the others.
    rest = np.delete(np.arange(len(effort)), found)
    return np.union1d(rows[found], find_spikes(rows[rest], effort[rest], scale))


def is_moving(position: Array) -> bool:
    """Whether any joint moves within some rows. `position`: (N, n), q [rad or m]."""
    low, high = np.fmin.reduce(position, axis=0), np.fmax.reduce(position, axis=0)
    return bool((high - low > LEAST_MOVE).any())


DROP = 10.0  # multiple of the usual change from row to row by which one joint's effort falls to zero, and comes back
COMMON_DROP = 2.0  # the same of at least one joint, where the efforts of all joints are exactly zero at once
COMMON_ROWS = 3  # rows, at least, in which noisy efforts of all joints are exactly zero by no accident
MOST_RUNS = 100_000  # runs of zero of one joint beyond which zero is a value like any other


class ZeroRuns:
    """Collects runs of zero, block by block: of every joint, and of all at once."""

    def __init__(self, scales: Sequence[EffortScale]) -> None:
        self._scales = scales
        self._runs: list[list[tuple[int, int]]] = [[] for _ in range(len(scales) + 1)]

    def add(self, samples: Samples, first: int) -> None:
        """Take the next rows. `first`: row of the first of them."""
        zero = samples.effort == 0.0
        if not zero.any():
            return
        for joint, runs in enumerate(self._runs):
            is_zero = zero[:, joint] if joint < len(self._scales) else zero.all(axis=1)
            if not is_zero.any() or len(runs) > MOST_RUNS:
                continue
            for start, stop in (find_runs(is_zero) + first).tolist():
                if runs and runs[-1][1] == start:
                    runs[-1] = (runs[-1][0], stop)
                else:
                    runs.append((start, stop))

    def find_dropouts(self, recording: Recording) -> list[Rows]:
        """Ranges of rows that are dropouts, of every joint, (k, 2); they may overlap."""
        change = np.array([scale.change for scale in self._scales])
        # Whether noise lets no effort stay at one value.
        is_noisy = any(0 < scale.run <= USUAL_RUN * scale.hold and scale.change > 0.0 for scale in self._scales)
        *own, common = ([] if len(runs) > MOST_RUNS else runs for runs in self._runs)
        shared = [
            run
            for run in (common if len(own) > 1 else ())
            if (is_noisy and run[1] - run[0] >= COMMON_ROWS and _is_gap(recording, run))
            or (_measure_drops(recording, run) > COMMON_DROP * change).any()
        ]
        lost = [set(shared) for _ in own]
        for joint, runs in enumerate(own):
            lost[joint].update(run for run in runs if _measure_drops(recording, run)[joint] > DROP * change[joint])
        return [np.array(sorted(ranges), dtype=np.int64).reshape(-1, 2) for ranges in lost]


def _is_gap(recording: Recording, run: tuple[int, int]) -> bool:
    """Whether a run has efforts on both sides, or the arm stands still in it, as on its brakes.

    An arm that moves without effort at the beginning or the end swings freely.
    """
    start, stop = run
    if start > 0 and stop < len(recording):
        return True
    return stop - start < len(recording) and not _moves(recording, run)


def _moves(recording: Recording, run: tuple[int, int]) -> bool:
    blocks = (recording.samples(row, min(row + BLOCK_ROWS, run[1])) for row in range(*run, BLOCK_ROWS))
    return any(is_moving(block.position) for block in blocks)


def _measure_drops(recording: Recording, run: tuple[int, int]) -> Array:
    """Distance of zero beyond the range of every joint's efforts before and after a run, (n,); at most 0 within it."""
    if not _is_gap(recording, run):
        return np.zeros(recording.joint_count)
    sides = [row for row in (run[0] - 1, run[1]) if 0 <= row < len(recording)]
    efforts = np.array([recording.samples(row, row + 1).effort[0] for row in sides])
    return np.nan_to_num(np.maximum(efforts.min(axis=0), -efforts.max(axis=0)), nan=0.0)
