"""Recordings as NumPy archives, ``np.savez``: one array a column, or one with a row a sample and a column a joint."""

import tokenize
import zipfile
import zlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tauscope.errors import RecordingError
from tauscope.recording.column_batches import ROWS_AT_ONCE, Batch, read_batches
from tauscope.recording.columns import ColumnLayout
from tauscope.recording.inflation import HELD_BYTES, require_plausible_inflation
from tauscope.recording.recording import Array, Recording
from tauscope.recording.units import SI, Reading
from tauscope.robot.messages import listed, reason

ZIP_MAGIC = b"PK\x03\x04"

_MOST_COLUMNS = 10_000
# Errors that damaged archives raise; NumPy reads the header of an array as Python.
_UNREADABLE = (
    zipfile.BadZipFile,
    zlib.error,
    ValueError,
    OSError,
    EOFError,
    NotImplementedError,
    MemoryError,
    KeyError,
    RecursionError,
    tokenize.TokenError,
)


def read_npz(path: Path, name: str, joint_count: int | None = None, reading: Reading = SI) -> Recording:
    """Read an archive; columns of an array are named ``qpos[0]``, ``qpos[1]``, ….

    Raises RecordingError where the archive is damaged, is none of NumPy's, or names the row and column at fault.
    """
    columns = _read_columns(path, name)
    rows = len(next(iter(columns.values())))

    def open_batches(_layout: ColumnLayout, _wanted: Sequence[str]) -> Iterator[Batch]:
        for start in range(0, rows, ROWS_AT_ONCE):
            yield lambda column, start=start: columns[column][start : start + ROWS_AT_ONCE]

    return read_batches(name, list(columns), rows, open_batches, joint_count=joint_count, reading=reading)


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
