"""What every row of a recording must satisfy, whatever file it comes from."""

from collections.abc import Callable

import numpy as np

from tauscope.errors import RecordingError
from tauscope.recording.samples import Array

MINIMUM_ROWS = 10  # fewer samples than this are a mistake and not a motion


class RowCheck:
    """Checks blocks of rows: time is known, no number is infinite, a period is a whole number.

    NaN is a missed sample and welcome in every column but time.
    """

    def __init__(self, file: str, names: tuple[str, ...]) -> None:
        self._file = file
        self._names = names
        self._period = names.index("period") if "period" in names else None

    def __call__(self, block: Array, place: Callable[[int], str]) -> None:
        """Check the next block.

        Raises RecordingError, which names the row and the column at fault.

        `block`: (rows, columns), the rows.
        """
        if not len(block):
            return
        if np.isinf(block).any():
            row, column = (int(index) for index in np.argwhere(np.isinf(block))[0])
            raise RecordingError(
                f"{self._file}: {place(row)}, column {self._names[column]}: the value is infinite; "
                "leave the field empty where a sample was missed"
            )
        unknown = np.isnan(block[:, 0])
        if unknown.any():
            row = int(np.argmax(unknown))
            raise RecordingError(f"{self._file}: {place(row)}, column t: the time is missing; delete the row")
        if self._period is not None:
            self._check_period(block[:, self._period], place)

    def _check_period(self, period: Array, place: Callable[[int], str]) -> None:
        fault = (period != np.floor(period)) & ~np.isnan(period)
        if fault.any():
            row = int(np.argmax(fault))
            raise RecordingError(
                f"{self._file}: {place(row)}, column period: {float(period[row])!r} is not a whole number"
            )


def require_rising(time: Array, previous: float, file: str, place: Callable[[int], str]) -> None:
    """Refuse time that does not rise from row to row.

    Raises RecordingError, which names the row.

    `time`: (rows,), stamps [s]; `previous`: the stamp before them [s].
    """
    is_up = np.diff(time, prepend=previous) > 0
    if is_up.all():
        return
    row = int(np.argmin(is_up))
    before = previous if row == 0 else float(time[row - 1])
    word = "repeats" if time[row] == before else "runs backwards:"
    raise RecordingError(
        f"{file}: {place(row)}, column t: time {word} {float(time[row])!r} s after {float(before)!r} s; "
        "a recording is one motion with strictly increasing time"
    )


def require_rows(count: int, file: str) -> None:
    """Refuse a file that holds next to nothing. Raises RecordingError: fewer than `MINIMUM_ROWS` samples."""
    if count < MINIMUM_ROWS:
        found = "no sample" if count == 0 else "only 1 sample" if count == 1 else f"only {count} samples"
        raise RecordingError(f"{file}: holds {found}; at least {MINIMUM_ROWS} are needed")
