"""A recording's table with edits: read as any other, only the rows that are asked for are copied."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tauscope.recording.samples import Array, Table

Numbers = NDArray[np.int64]
Rows = NDArray[np.int64]

NO_NUMBERS: Numbers = np.empty(0, dtype=np.int64)
NO_ROWS: Rows = np.empty((0, 2), dtype=np.int64)


@dataclass(frozen=True, eq=False)
class ColumnEdit:
    """Edits of one column."""

    # (k, 2) int64, rows start:stop never measured; ascending, disjoint
    blank: Rows = field(default_factory=lambda: NO_ROWS)
    jumps: Numbers = field(default_factory=lambda: NO_NUMBERS)  # (m,) int64, rows from which on it is off by a constant
    offsets: Array = field(default_factory=lambda: np.empty(0))  # (m,), that constant: subtracted [rad or m]
    hold: int = 0  # rows for which the source holds a value; those in between are on a line from one to the next
    fill: int = 0  # missed rows up to which a straight line is drawn


class EditedTable:
    """A table of which some columns are mended as they are read."""

    def __init__(self, table: Table, edits: Mapping[int, ColumnEdit]) -> None:
        self._table, self.names = table, table.names
        self._edits = dict(edits)
        self._spare = 2 + max(((2 * edit.hold + 2) * (edit.fill + 1) for edit in edits.values()), default=0)

    def __len__(self) -> int:
        return len(self._table)

    def rows(self, start: int, stop: int) -> Array:
        """Rows start:stop, a read-only copy of shape (stop-start, columns)."""
        start, stop, _ = slice(start, stop).indices(len(self))
        first, last = max(start - self._spare, 0), min(max(start, stop) + self._spare, len(self))
        block = self._table.rows(first, last).copy()
        for column, edit in self._edits.items():
            _apply(edit, block[:, column], block[:, 0], first)
        block = block[start - first : max(start, stop) - first]
        block.flags.writeable = False
        return block


def _apply(edit: ColumnEdit, values: Array, time: Array, first: int) -> None:
    """Mend one column of a block that begins at row `first`, in place."""
    if len(edit.jumps):
        last = np.searchsorted(edit.jumps, np.arange(first, first + len(values)), side="right")
        values -= np.concatenate([[0.0], edit.offsets])[last]
    begin = np.searchsorted(edit.blank[:, 1], first, side="right")
    end = np.searchsorted(edit.blank[:, 0], first + len(values))
    for start, stop in edit.blank[begin:end] - first:
        values[max(start, 0) : stop] = np.nan
    if edit.hold:
        known = np.flatnonzero(np.isfinite(values))
        held = values[known]
        _interpolate(held, time[known], np.concatenate([[False], held[1:] == held[:-1]]), 2 * edit.hold)
        values[known] = held
    if edit.fill:
        _interpolate(values, time, np.isnan(values), edit.fill)


def _interpolate(values: Array, time: Array, doubtful: NDArray[np.bool_], longest: int) -> None:
    """Draw straight lines across doubtful rows, up to `longest` of them, in place."""
    gaps = find_runs(doubtful)
    inside = (gaps[:, 0] > 0) & (gaps[:, 1] < len(values)) & (gaps[:, 1] - gaps[:, 0] <= longest)
    at = row_numbers(gaps[inside])
    known = ~doubtful & np.isfinite(values)
    if len(at) and known.any():
        values[at] = np.interp(time[at], time[known], values[known])


def row_numbers(ranges: Rows) -> Numbers:
    """Row numbers of ranges, (m,). `ranges`: (k, 2) int64, start:stop."""
    return np.concatenate([NO_NUMBERS, *(np.arange(start, stop) for start, stop in ranges)])


def join_ranges(rows: Numbers) -> Rows:
    """Ranges start:stop of ascending row numbers, (k, 2). `rows`: (m,) int64, rows, ascending, each once."""
    if not len(rows):
        return NO_ROWS
    edges = np.flatnonzero(np.diff(rows, prepend=rows[0] - 2, append=rows[-1] + 2) != 1)
    return np.column_stack([rows[edges[:-1]], rows[edges[1:] - 1] + 1])


def find_runs(mask: NDArray[np.bool_]) -> Rows:
    """Ranges start:stop in which a mask is true, (k, 2). `mask`: (N,), one value a row."""
    return np.flatnonzero(np.diff(mask, prepend=False, append=False)).reshape(-1, 2)
