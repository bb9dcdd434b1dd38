"""Stretches of an effort that is exactly zero and should not be: it was not read, or the drives were off."""

from collections.abc import Sequence

import numpy as np

from tauscope.recording.examination.edits import Rows, find_runs
from tauscope.recording.examination.effort_defects import USUAL_RUN, is_moving
from tauscope.recording.examination.scales import EffortScale
from tauscope.recording.examination.sketch import BLOCK_ROWS
from tauscope.recording.recording import Recording, Samples
from tauscope.recording.samples import Array

DROP = 10.0  # multiple of the usual change from row to row by which one joint's effort falls to zero, and comes back
COMMON_DROP = 2.0  # the same of at least one joint, where the efforts of all joints are exactly zero at once
COMMON_ROWS = 3  # rows, at least, in which noisy efforts of all joints are exactly zero by no accident
OPEN_ROWS = 10  # rows of a dropout, at least, that reaches to the beginning or the end of the recording
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

    @property
    def _is_noisy(self) -> bool:
        """Whether noise lets no effort stay at one value."""
        return any(0 < scale.run <= USUAL_RUN * scale.hold and scale.change > 0.0 for scale in self._scales)

    def find_dropouts(self, recording: Recording) -> list[Rows]:
        """Ranges of rows that are dropouts, of every joint, (k, 2)."""
        change = np.array([scale.change for scale in self._scales])
        *own, common = ([] if len(runs) > MOST_RUNS else runs for runs in self._runs)
        shared = [
            run
            for run in (common if len(own) > 1 else ())
            if (self._is_noisy and run[1] - run[0] >= COMMON_ROWS and _is_gap(recording, run))
            or (_measure_drops(recording, run) > COMMON_DROP * change).any()
        ]
        lost = [set(shared) for _ in own]
        for joint, runs in enumerate(own):
            for run in runs:
                overlaps = any(run[0] < stop and start < run[1] for start, stop in shared)
                if not overlaps and _measure_drops(recording, run)[joint] > DROP * change[joint]:
                    lost[joint].add(run)
        return [np.array(sorted(ranges), dtype=np.int64).reshape(-1, 2) for ranges in lost]


def _is_gap(recording: Recording, run: tuple[int, int]) -> bool:
    """Whether a run has efforts on both sides, or the arm stands still in it, as on its brakes.

    An arm that moves without effort at the beginning or the end swings freely.
    """
    start, stop = run
    if start > 0 and stop < len(recording):
        return True
    is_whole = start == 0 and stop == len(recording)
    return not is_whole and stop - start >= OPEN_ROWS and not _moves(recording, run)


def _moves(recording: Recording, run: tuple[int, int]) -> bool:
    """Whether the arm moves in a run, read block by block."""
    blocks = (recording.samples(row, min(row + BLOCK_ROWS, run[1])) for row in range(*run, BLOCK_ROWS))
    return any(is_moving(block.position) for block in blocks)


def _measure_drops(recording: Recording, run: tuple[int, int]) -> Array:
    """Distance of zero beyond the range of every joint's efforts before and after a run, (n,); at most 0 within it."""
    if not _is_gap(recording, run):
        return np.zeros(recording.joint_count)
    sides = [row for row in (run[0] - 1, run[1]) if 0 <= row < len(recording)]
    efforts = np.array([recording.samples(row, row + 1).effort[0] for row in sides])
    return np.nan_to_num(np.maximum(efforts.min(axis=0), -efforts.max(axis=0)), nan=0.0)
