"""What every row of a recording must satisfy, whatever file it comes from."""

from collections.abc import Callable

import numpy as np

from tauscope.errors import RecordingError
from tauscope.recording.samples import Array

MINIMUM_ROWS = 10
"""Fewer samples than this are a mistake and not a motion."""


class RowCheck:
    """Checks blocks of rows in the order of the file: time is finite and strictly increasing, no number is infinite.

    NaN is a missed sample and welcome in every column but time.
    """

    def __init__(self, file: str, names: tuple[str, ...]) -> None:
        """Prepare for the first block."""
        self._file = file
        self._names = names
        self._period = names.index("period") if "period" in names else None
        self._previous = -np.inf

    def __call__(self, block: Array, place: Callable[[int], str]) -> None:
        """Check the next block.

        Parameters
        ----------
        block : (rows, columns) float64
            the rows

        Raises
        ------
        RecordingError
            names the row and the column at fault
        """
        if not len(block):
            return
        if np.isinf(block).any():
            row, column = (int(index) for index in np.argwhere(np.isinf(block))[0])
            raise RecordingError(
                f"{self._file}: {place(row)}, column {self._names[column]}: the value is infinite; "
                "leave the field empty where a sample was missed"
            )
        self._check_time(block[:, 0], place)
        if self._period is not None:
            self._check_period(block[:, self._period], place)

    def _check_time(self, time: Array, place: Callable[[int], str]) -> None:
        step_is_up = np.diff(time, prepend=self._previous) > 0
        if not step_is_up.all():
            row = int(np.argmin(step_is_up))
            if np.isnan(time[row]):
                raise RecordingError(f"{self._file}: {place(row)}, column t: the time is missing; delete the row")
            previous = self._previous if row == 0 else float(time[row - 1])
            word = "repeats" if time[row] == previous else "runs backwards:"
            raise RecordingError(
                f"{self._file}: {place(row)}, column t: time {word} {float(time[row])!r} s after {previous!r} s; "
                "a recording is one motion with strictly increasing time"
            )
        self._previous = float(time[-1])

    def _check_period(self, period: Array, place: Callable[[int], str]) -> None:
        fault = (period != np.floor(period)) & ~np.isnan(period)
        if fault.any():
            row = int(np.argmax(fault))
            raise RecordingError(
                f"{self._file}: {place(row)}, column period: {float(period[row])!r} is not a whole number"
            )


def require_rows(count: int, file: str) -> None:
    """Refuse a file that holds next to nothing.

    Raises
    ------
    RecordingError
        fewer than `MINIMUM_ROWS` samples
    """
    if count < MINIMUM_ROWS:
        found = "no sample" if count == 0 else "only 1 sample" if count == 1 else f"only {count} samples"
        raise RecordingError(f"{file}: holds {found}; at least {MINIMUM_ROWS} are needed")
