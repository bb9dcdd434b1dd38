"""Samples of a recording as arrays, and the rules that all rows keep."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from tauscope.errors import RecordingError
from tauscope.robot.robot import Array


class EffortKind(StrEnum):
    """What the recording holds in place of joint torque."""

    TORQUE = "tau"
    CURRENT = "i"
    COMMAND = "qref"


@dataclass(frozen=True, eq=False)
class Samples:
    """A stretch of a recording as it was measured; NaN: a sample that was missed, or a joint without the column."""

    time: Array  # (N,), strictly increasing [s]
    position: Array  # (N, n), q [rad or m]
    effort: Array  # (N, n), τ, drive units or commanded positions, as `effort_kind` says; sign and constant not applied
    velocity: Array | None = None  # (N, n), column qd
    acceleration: Array | None = None  # (N, n), column qdd
    reference: Array | None = None  # (N, n), column qref
    effort_command: Array | None = None  # (N, n), column taucmd
    temperature: Array | None = None  # (N, n), column temp
    link_position: Array | None = None  # (N, n), column qlink
    voltage: Array | None = None  # (N, n), column volt
    gain: Array | None = None  # (N, n), column kp
    period: Array | None = None  # (N,), index of the repeated excitation period, NaN outside the repeated part

    @property
    def complete(self) -> NDArray[np.bool_]:
        """Rows in which the position of every joint is known, (N,)."""
        known = np.isfinite(self.position, order="F")  # column by column: a tenth of the time
        return np.asarray(known.all(axis=1))


class Table(Protocol):
    """Rows of float64 columns, in memory or spooled to a temporary file when they are many."""

    @property
    def names(self) -> tuple[str, ...]:
        """Column names of CONTRACT.md: t, q1…, tau1… or i1…, qd1…, period."""
        ...

    def __len__(self) -> int: ...

    def rows(self, start: int, stop: int) -> Array:
        """Rows start:stop as one (stop-start, columns) float64 array."""
        ...


MINIMUM_ROWS = 10  # fewer samples than this are a mistake and not a motion


class RowCheck:
    """Checks that time is known, no number is infinite, and a period is whole; NaN is a missed sample."""

    def __init__(self, file: str, names: tuple[str, ...]) -> None:
        self._file = file
        self._names = names
        self._period = names.index("period") if "period" in names else None

    def __call__(self, block: Array, place: Callable[[int], str]) -> None:
        """Check the next `block`. Raises RecordingError, which names the row and the column."""
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
    """Raise RecordingError, which names the row, where `time` (rows,) does not rise from `previous` on."""
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
