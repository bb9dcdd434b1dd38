"""Clocks of other tools: seconds and nanoseconds in two columns, and episodes that each begin at zero."""

import numpy as np

from tauscope.recording.samples import Array
from tauscope.result_warning import ResultWarning

PAUSE_S = 60.0  # between two episodes [s]: no filter and no fit bridges a gap of this length


class SplitClock:
    """Joins seconds and nanoseconds, from the first row on: a large count has no room for small parts of a second."""

    def __init__(self) -> None:
        self._first = np.nan

    def join(self, seconds: Array, nanoseconds: Array) -> Array:
        """Time since the first second.

        `seconds`, `nanoseconds`: (rows,), parts of each stamp [s, ns]. Returns (rows,) [s].
        """
        if len(seconds) and np.isnan(self._first):
            self._first = seconds[0]
        return (seconds - self._first) + 1e-9 * nanoseconds


class EpisodeClock:
    """Puts episodes one after another, `PAUSE_S` apart."""

    def __init__(self, unit_s: float) -> None:
        """Start before the first row. `unit_s`: unit of the file's time [s]."""
        self._pause = PAUSE_S / unit_s
        self._episode, self._shift, self._last = np.nan, 0.0, np.nan
        self._count = 0

    def shift(self, time: Array, episode: Array) -> Array:
        """Time on the common clock.

        `time`: (rows,), of each row within its episode, in the file's unit; `episode`: (rows,), index of its episode.
        Returns (rows,), in the file's unit.
        """
        starts = np.flatnonzero(np.diff(episode, prepend=self._episode) != 0)
        shifted = time + self._shift
        for start in starts:
            before = self._last if start == 0 else shifted[start - 1]
            if np.isfinite(before):
                self._shift = before + self._pause - time[start]
                shifted[start:] = time[start:] + self._shift
        self._count += len(starts)
        if len(time):
            self._episode, self._last = episode[-1], shifted[-1]
        return shifted

    @property
    def notes(self) -> tuple[ResultWarning, ...]:
        """A warning where there is more than one episode."""
        if self._count < 2:
            return ()
        text = f"column t: {self._count} episodes, put one after another with a gap of {PAUSE_S:g} s between them"
        remedy = "give one file an episode where their order or their arm differs"
        return (ResultWarning(code="episodes", text=text, remedy=remedy),)
