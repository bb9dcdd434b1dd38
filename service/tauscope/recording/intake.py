"""The rows of all formats: converted to SI, checked, put in order of time, kept in a table."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tauscope.errors import RecordingError
from tauscope.number_text import counted
from tauscope.recording.recording import Recording
from tauscope.recording.samples import Array, EffortKind, RowCheck, require_rising, require_rows
from tauscope.recording.table import SPOOL_ABOVE_BYTES, TableBuilder
from tauscope.recording.units import SI, Conversion, Reading
from tauscope.result_warning import ResultWarning


@dataclass(frozen=True)
class Choice:
    """What is wanted of a file."""

    file: str
    joint_count: int | None = None  # joints that the recording must have; None where any number is welcome
    joint_names: tuple[str, ...] | None = None
    spool_above_bytes: int = SPOOL_ABOVE_BYTES  # size above which the rows go to a temporary file [bytes]
    reading: Reading = SI
    packed_bytes: int | None = None  # size of a log, by which its messages are plausible [bytes]; None where any are


PAUSE_S = 60.0  # between two episodes [s]: no filter and no fit bridges a gap of this length


class SplitClock:
    """Joins seconds and nanoseconds, from the first row on: a large count has no room for small parts of a second."""

    def __init__(self) -> None:
        self._first = np.nan

    def join(self, seconds: Array, nanoseconds: Array) -> Array:
        """Time since the first second, (rows,) [s], of `seconds` and `nanoseconds`, (rows,)."""
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
        """The common clock, (rows,), in the file's unit; `time`: (rows,), within each `episode`, (rows,) of indices."""
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


class CounterClock:
    """Goes on where a counter of 16 or 32 bits begins again."""

    def __init__(self) -> None:
        self._last = np.nan
        self._base = 0.0
        self.count = 0  # how often it began again

    def unwrap(self, counts: Array) -> Array:
        """Counts that rise on, (rows,), block by block; `counts`: (rows,), those in the file."""
        steps, bases = np.diff(counts, prepend=self._last), np.full(len(counts), self._base)
        for size in (2.0**16, 2.0**32):
            # Another clock that is set back goes by a whole range, to a thousandth of it, by rare chance only.
            wraps = (steps < 0) & (steps + size > 0) & (steps + size < 1e-3 * size)
            bases += size * np.cumsum(wraps)
            self.count += int(wraps.sum())
        if len(counts):
            self._last, self._base = counts[-1], bases[-1]
        return counts + bases


# Rows by which one may come too late and still be put in its place: threads and networks swap neighbours. A clock that
# is set back, or two files in one, come later by far more.
LATE_ROWS = 8
# Share of rows with a stamp of another row above which the stamps are too coarse: leaving them out leaves holes.
REPEATED_SHARE = 0.05


class RowIntake:
    """Takes a file's rows block by block, in the order of the file."""

    def __init__(self, choice: Choice, names: Sequence[str], effort_kind: EffortKind, expected_rows: int = 0) -> None:
        self._file = choice.file
        self._conversion = Conversion.design(names, effort_kind, choice.reading)
        self._check = RowCheck(choice.file, self._conversion.names)
        self._builder = TableBuilder(self._conversion.names, expected_rows, choice.spool_above_bytes)
        self._tail = np.empty((0, len(names)))
        self._tail_rows = np.empty(0, dtype=np.intp)
        self._origin: float | None = None
        self._counter = CounterClock()
        self._last = -np.inf
        self._rows = self._repeated = self._late = 0
        self._first_repeated = self._first_late = np.nan

    def __len__(self) -> int:
        """Rows taken so far, repeated ones too."""
        return self._rows

    def add(self, block: Array, place: Callable[[int], str]) -> None:
        """Take the next (rows, columns) `block`. Raises RecordingError, which names row and column."""
        self._check(block, place)
        rows = np.append(self._tail_rows, np.arange(self._rows, self._rows + len(block)))
        self._rows += len(block)
        block = self._convert(block)
        kept = len(self._tail)
        if kept:
            block = np.concatenate([self._tail, block])
        if not (np.diff(block[:, 0], prepend=self._last) > 0).all():
            block, rows = self._order(block, rows, lambda row: place(max(row - kept, 0)))
        split = max(len(block) - LATE_ROWS, 0)
        if split:
            self._last = float(block[split - 1, 0])
            self._builder.append(block[:split])
        self._tail, self._tail_rows = block[split:].copy(), rows[split:]

    def finish(
        self, joint_count: int, ignored: tuple[str, ...] = (), notes: tuple[ResultWarning, ...] = ()
    ) -> Recording:
        """The recording of all rows. Raises RecordingError where there are too few, or too many have one stamp."""
        self._builder.append(self._tail)
        require_rows(len(self._builder), self._file)
        if self._repeated > max(LATE_ROWS, REPEATED_SHARE * self._rows):
            raise RecordingError(
                f"{self._file}: column t: {self._repeated} of {self._rows} rows repeat the time of another row, first"
                f" at t = {self._first_repeated:.6g} s; write t with more digits"
            )
        kind, table = self._conversion.effort_kind, self._builder.finish()
        return Recording(self._file, joint_count, kind, table, ignored, (*notes, *self._warnings()))

    def _convert(self, block: Array) -> Array:
        if not self._conversion.is_needed or not len(block):
            return block
        converted = block * self._conversion.factor
        if self._conversion.from_first:
            counts = self._counter.unwrap(block[:, 0])
            self._origin = float(counts[0]) if self._origin is None else self._origin
            converted[:, 0] = (counts - self._origin) * self._conversion.factor[0]
        return converted

    def _order(
        self, block: Array, rows: NDArray[np.intp], place: Callable[[int], str]
    ) -> tuple[Array, NDArray[np.intp]]:
        """Rows in order of time, the first of those with one stamp, and their numbers in the file."""
        time = block[:, 0]
        order = np.argsort(time, kind="stable")
        place_in_file = np.arange(self._rows - len(block), self._rows)
        if np.abs(rows[order] - place_in_file).max() > LATE_ROWS or time[order[0]] < self._last:
            row = int(np.argmax(np.diff(time, prepend=self._last) < 0))
            require_rising(
                time[row:], self._last if row == 0 else float(time[row - 1]), self._file, lambda _: place(row)
            )
        late = np.flatnonzero(np.diff(time, prepend=self._last) < 0)
        block = block[order]
        is_new = np.diff(block[:, 0], prepend=self._last) > 0
        if len(late):
            self._first_late = self._first_late if self._late else float(time[late[0]])
            self._late += len(late)
        if not is_new.all():
            self._first_repeated = self._first_repeated if self._repeated else float(block[np.argmin(is_new), 0])
            self._repeated += int((~is_new).sum())
        return block[is_new], rows[order][is_new]

    def _warnings(self) -> Sequence[ResultWarning]:
        found = []
        if times := self._counter.count:
            text = f"the counter began again {'once' if times == 1 else f'{times} times'}; taken as going on"
            found.append((text, "give each motion a file of its own, if these are several"))
        if self._late:
            rows = counted(self._late, "row")
            text = f"{rows} came after a later one, first at t = {self._first_late:.6g} s; put in order of time"
            found.append((text, "record with one publisher, or sort the file by t"))
        if self._repeated:
            rows = "1 row has" if self._repeated == 1 else f"{self._repeated} rows have"
            text = f"{rows} the time of the row before, first at t = {self._first_repeated:.6g} s; left out"
            found.append((text, "write t with more digits, or record each message once"))
        return [ResultWarning(code="time-stamps", text=f"column t: {text}", remedy=remedy) for text, remedy in found]
