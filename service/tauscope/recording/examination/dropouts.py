"""Stretches of an effort that is exactly zero and should not be: it was not read, or the drives were off."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tauscope.recording.examination.edits import Rows, find_runs
from tauscope.recording.examination.effort_defects import STUCK_ROWS, USUAL_RUN, is_moving
from tauscope.recording.examination.scales import EffortScale
from tauscope.recording.recording import Recording, Samples

DROP = 10.0
"""Multiple of the usual change from row to row by which one joint's effort falls to zero, and comes back."""

COMMON_DROP = 2.0
"""The same of at least one joint, where the efforts of all joints are exactly zero at once."""

COMMON_ROWS = 3
"""Rows, at least, in which all efforts are exactly zero by no accident: one side of the drop is enough."""

OPEN_ROWS = 10
"""Rows of a dropout, at least, that reaches to the beginning or the end of the recording."""

MOST_RUNS = 100_000
"""Runs of zero of one joint beyond which zero is a value like any other."""


class ZeroRuns:
    """Collects runs of zero, block by block: of every joint, and of all at once."""

    def __init__(self, scales: Sequence[EffortScale]) -> None:
        """Start before the first row."""
        self._scales = scales
        self._runs: list[list[tuple[int, int]]] = [[] for _ in range(len(scales) + 1)]

    def add(self, samples: Samples, first: int) -> None:
        """Take the next rows.

        Parameters
        ----------
        first : int
            row of the first of them
        """
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

    def dropouts(self, recording: Recording) -> list[Rows]:
        """Ranges of rows that are dropouts, of every joint, (k, 2)."""
        *own, common = ([] if len(runs) > MOST_RUNS else runs for runs in self._runs)
        lost: list[set[tuple[int, int]]] = [set() for _ in own]
        for run in common if len(own) > 1 else ():
            drops = _drops(recording, run, common=True)
            is_deep = any(drop > COMMON_DROP * scale.change for drop, scale in zip(drops, self._scales, strict=True))
            is_closed = run[0] > 0 and run[1] < len(recording)
            if is_deep or (is_closed and run[1] - run[0] >= STUCK_ROWS and self._is_noisy):
                for ranges in lost:
                    ranges.add(run)
        for joint, (runs, scale) in enumerate(zip(own, self._scales, strict=True)):
            shared = list(lost[joint])
            for run in runs:
                overlaps = any(run[0] < stop and start < run[1] for start, stop in shared)
                if not overlaps and _drops(recording, run)[joint] > DROP * scale.change:
                    lost[joint].add(run)
        return [np.array(sorted(ranges), dtype=np.int64).reshape(-1, 2) for ranges in lost]


def _drops(recording: Recording, run: tuple[int, int], *, common: bool = False) -> NDArray[np.float64]:
    """By how much every joint's effort falls to zero and comes back, the lesser of both, (n,); 0 where it changes sign.

    A run that is open on one side counts where the arm stands still in it, as on its brakes: an arm that moves without
    effort swings freely.
    """
    start, stop = run
    sides = [row for row in (start - 1, stop) if 0 <= row < len(recording)]
    none = np.zeros(recording.joint_count)
    if not sides:
        return none
    if len(sides) == 1 and (stop - start < OPEN_ROWS or is_moving(recording.samples(start, stop).position)):
        return none
    efforts = np.array([recording.samples(row, row + 1).effort[0] for row in sides])
    if common and stop - start >= COMMON_ROWS:
        return np.nan_to_num(np.abs(efforts).max(axis=0), nan=0.0)
    drops = np.where(efforts[0] * efforts[-1] > 0.0, np.abs(efforts).min(axis=0), 0.0)
    return np.nan_to_num(drops, nan=0.0)
