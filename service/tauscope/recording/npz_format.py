"""Recordings as NumPy archives, ``np.savez``: one array a column, or one with a row a sample and a column a joint."""

import tokenize
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np

from tauscope.errors import RecordingError
from tauscope.recording.clocks import SplitClock
from tauscope.recording.columns import find_layout, require_joint_count
from tauscope.recording.inflation import HELD_BYTES, require_plausible_inflation
from tauscope.recording.intake import RowIntake
from tauscope.recording.recording import Array, Recording
from tauscope.recording.table import SPOOL_ABOVE_BYTES
from tauscope.recording.units import SI, Reading
from tauscope.recording.words import listed, reason

ZIP_MAGIC = b"PK\x03\x04"

_ROWS_AT_ONCE = 2**16
_MOST_COLUMNS = 10_000
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
"""Errors that damaged archives raise; NumPy reads the header of an array as Python."""


def read_npz(
    path: Path,
    name: str,
    joint_count: int | None = None,
    spool_above_bytes: int = SPOOL_ABOVE_BYTES,
    reading: Reading = SI,
) -> Recording:
    """Read an archive; columns of an array are named ``qpos[0]``, ``qpos[1]``, ….

    Parameters
    ----------
    joint_count : int or None
        joints that the recording must have; None where any number is welcome
    spool_above_bytes : int
        size above which the rows go to a temporary file [bytes]

    Raises
    ------
    RecordingError
        the archive is damaged, is none of NumPy's, or names the row and column at fault
    """
    columns = _read_columns(path, name)
    header = list(columns)
    reading, layout = find_layout(header, reading, name)
    require_joint_count(layout.joint_count, joint_count, name)
    block = np.column_stack([columns[header[index]] for index in layout.source])
    if layout.nanoseconds is not None:
        block[:, 0] = SplitClock().join(block[:, 0], columns[header[layout.nanoseconds]])
    if layout.counts_rows:
        block[:, 0] = np.arange(len(block))
    intake = RowIntake(name, layout.names, layout.effort_kind, reading, len(block), spool_above_bytes)
    for start in range(0, len(block), _ROWS_AT_ONCE):
        intake.add(block[start : start + _ROWS_AT_ONCE], lambda row, start=start: f"row {start + row}")
    return intake.finish(layout.joint_count, layout.ignored, layout.notes)


def read_npz_header(path: Path, name: str) -> list[str]:
    """Names of an archive's columns.

    Raises
    ------
    RecordingError
        the archive is damaged, or is none of NumPy's
    """
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
