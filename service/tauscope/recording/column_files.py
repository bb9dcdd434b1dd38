"""Files of whole columns, batch by batch, and NumPy archives, ``np.savez``: an array a column, or a table."""

import tokenize
import zipfile
import zlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from tauscope.errors import RecordingError
from tauscope.recording.columns import ColumnLayout, find_layout, require_joint_count
from tauscope.recording.inflation import HELD_BYTES, require_plausible_inflation
from tauscope.recording.intake import Choice, EpisodeClock, RowIntake, SplitClock
from tauscope.recording.recording import Array, Recording
from tauscope.recording.units import SECONDS
from tauscope.robot.messages import listed, reason

ROWS_AT_ONCE = 2**16
_EPISODE = "episode_index"

Batch = Callable[[str], Array]  # values of a column of the file, (rows,) float64


def read_batches(
    choice: Choice,
    header: Sequence[str],
    rows: int,
    open_batches: Callable[[ColumnLayout, Sequence[str]], Iterable[Batch]],
    *,
    first_row: int = 0,
    has_episodes: bool = False,
) -> Recording:
    """Take all rows of the wanted columns.

    Raises RecordingError, which names row and column, and RecordingMismatchError for another number of joints.

    `first_row`: number of the file's first row in messages.
    `has_episodes`: whether a column `episode_index` splits the rows into episodes, each on a clock of its own.
    """
    reading, layout = find_layout(header, choice.reading, choice.file)
    require_joint_count(layout.joint_count, choice.joint_count, choice.file)
    wanted = [header[index] for index in layout.source]
    nanoseconds = None if layout.nanoseconds is None else header[layout.nanoseconds]
    episodes = None
    if has_episodes and _EPISODE in header:
        episodes = EpisodeClock(SECONDS.get(reading.units.get("t", "s"), 1.0))
    further = [*([] if nanoseconds is None else [nanoseconds]), *([_EPISODE] if episodes else [])]
    batches = open_batches(layout, [*wanted, *further])  # before there is memory for rows, which it may refuse
    intake = RowIntake(replace(choice, reading=reading), layout.names, layout.effort_kind, rows)
    split = SplitClock()
    for take in batches:
        block, first = np.column_stack([take(column) for column in wanted]), first_row + len(intake)
        if nanoseconds is not None:
            block[:, 0] = split.join(block[:, 0], take(nanoseconds))
        if layout.counts_rows:
            block[:, 0] = np.arange(len(block)) + len(intake)
        elif episodes is not None:
            block[:, 0] = episodes.shift(block[:, 0], take(_EPISODE))
        intake.add(block, lambda row, first=first: f"row {first + row}")
    return intake.finish(layout.joint_count, layout.ignored, (*layout.notes, *(episodes.notes if episodes else ())))


ZIP_MAGIC = b"PK\x03\x04"

_MOST_COLUMNS = 10_000
# Errors that damaged archives raise; NumPy reads the header of an array as Python.
_UNREADABLE = (
    *(zipfile.BadZipFile, zlib.error, tokenize.TokenError),
    *(ValueError, OSError, EOFError, RuntimeError, MemoryError, KeyError),
)


def read_npz(path: Path, choice: Choice) -> Recording:
    """Read a NumPy archive; columns are named ``qpos[0]``, …. Raises RecordingError, which names row and column."""
    columns = _read_columns(path, choice.file)
    rows = len(next(iter(columns.values())))

    def open_batches(_layout: ColumnLayout, _wanted: Sequence[str]) -> Iterator[Batch]:
        for start in range(0, rows, ROWS_AT_ONCE):
            yield lambda column, start=start: columns[column][start : start + ROWS_AT_ONCE]

    return read_batches(choice, list(columns), rows, open_batches)


def read_npz_header(path: Path, name: str) -> list[str]:
    """Names of an archive's columns. Raises RecordingError where the archive is damaged, or is none of NumPy's."""
    return list(_read_columns(path, name))


def _read_columns(path: Path, name: str) -> dict[str, Array]:
    """Columns of the arrays with as many rows as most of them."""
    try:
        with zipfile.ZipFile(path) as archive:
            unpacked_bytes = sum(entry.file_size for entry in archive.infolist())
            require_plausible_inflation(path.stat().st_size, unpacked_bytes, name, HELD_BYTES)
            if not all(entry.endswith(".npy") for entry in archive.namelist()):
                raise zipfile.BadZipFile("it is a zip archive or a spreadsheet; unpack it, or export the sheet as CSV")
        with np.load(path, allow_pickle=False) as content:
            arrays: dict[str, Any] = {key: content[key] for key in content.files}
    except _UNREADABLE as error:
        if isinstance(error, RecordingError):
            raise
        if path.suffix.lower() != ".npz":
            hint = "unpack it, or export the sheet as CSV"
            raise RecordingError(f"{name}: is a zip archive or a spreadsheet; {hint}") from error
        raise RecordingError(f"{name}: not a readable NumPy archive ({reason(error)})") from error
    tables = {key: array for key, array in arrays.items() if array.dtype.kind in "fiu" and array.ndim in (1, 2)}
    samples = {len(array) for array in tables.values() if array.ndim == 1}
    for key, array in tables.items():  # arrays may have a column a sample
        if array.ndim == 2 and array.shape[1] in samples and len(array) not in samples:
            tables[key] = array.T
    tables = {key: array for key, array in tables.items() if array[:1].size <= _MOST_COLUMNS}
    lengths = [len(array) for array in tables.values()]
    if not lengths:
        raise RecordingError(f"{name}: no array holds a row a sample; the arrays are {listed(list(arrays))}")
    rows = max(set(lengths), key=lengths.count)
    columns: dict[str, Array] = {}
    for key, array in tables.items():
        if len(array) == rows:
            values = array.astype(np.float64).reshape(rows, -1)
            names = [key] if array.ndim == 1 else [f"{key}[{index}]" for index in range(values.shape[1])]
            columns |= dict(zip(names, values.T, strict=True))
    return columns
