"""Archives of whole arrays, NumPy's and MATLAB's, and JSON: all of a file is read at once."""

import math
import re
import struct
import tokenize
import zipfile
import zlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from pydantic_core import from_json

from tauscope.errors import RecordingError
from tauscope.recording.column_files import ROWS_AT_ONCE, Batch, read_batches
from tauscope.recording.columns import ColumnLayout
from tauscope.recording.inflation import HELD_BYTES, require_plausible_inflation
from tauscope.recording.intake import Choice
from tauscope.recording.layout.families import is_name_list
from tauscope.recording.recording import Array, Recording
from tauscope.robot.messages import listed, reason

MAGICS = ZIP_MAGIC, NUMPY_MAGIC, MATLAB_MAGIC = b"PK\x03\x04", b"\x93NUMPY", b"MATLAB 5.0"
JSON_START = re.compile(rb"(?:\xef\xbb\xbf)?\s*(?:(?:\[\s*)?\{|\[\s*\[)")  # an object, or a list of them or of lists

_MOST_COLUMNS = 10_000
_LARGEST_JSON_BYTES = 2**28  # a short number takes eight times its text in memory
_COMPRESSED = 15  # type of an element of a MATLAB file
_MATLAB_HEADER_BYTES = 128
# Errors that damaged archives raise; NumPy reads the header of an array as Python.
_UNREADABLE = (
    *(zipfile.BadZipFile, zlib.error, tokenize.TokenError, struct.error),
    *(ValueError, TypeError, OSError, EOFError, RuntimeError, MemoryError, KeyError, IndexError),
)


def read_arrays(path: Path, choice: Choice) -> Recording:
    """Read such a file; columns are named ``log.q[0]``, …. Raises RecordingError, which names row and column."""
    columns = _read_columns(path, choice.file)
    rows = len(next(iter(columns.values())))

    def open_batches(_layout: ColumnLayout, _wanted: Sequence[str]) -> Iterator[Batch]:
        for start in range(0, rows, ROWS_AT_ONCE):
            yield lambda column, start=start: columns[column][start : start + ROWS_AT_ONCE]

    return read_batches(choice, list(columns), rows, open_batches)


def read_arrays_header(path: Path, name: str) -> list[str]:
    """Names of a file's columns. Raises RecordingError where it is damaged, or no array holds a row a sample."""
    return list(_read_columns(path, name))


def _read_columns(path: Path, name: str) -> dict[str, Array]:
    with path.open("rb") as file:
        magic = file.read(len(MATLAB_MAGIC))
    read, kind = next((entry for start, entry in _READERS.items() if magic.startswith(start)), (None, "JSON file"))
    try:
        return _read_json(path, name) if read is None else _join_arrays(read(path, name), name)
    except _UNREADABLE as error:
        if isinstance(error, RecordingError):
            raise
        if magic.startswith(ZIP_MAGIC) and path.suffix.lower() != ".npz":
            hint = "unpack it, or export the sheet as CSV"
            raise RecordingError(f"{name}: is a zip archive or a spreadsheet; {hint}") from error
        raise RecordingError(f"{name}: not a readable {kind} ({reason(error)})") from error


def _read_npy(path: Path, _name: str) -> dict[str, Any]:
    array = np.load(path, allow_pickle=False)
    return {key: array[key] for key in array.dtype.names or ()} or {"array": array}


def _read_npz(path: Path, name: str) -> dict[str, Any]:
    with zipfile.ZipFile(path) as archive:
        unpacked_bytes = sum(entry.file_size for entry in archive.infolist())
        require_plausible_inflation(path.stat().st_size, unpacked_bytes, name, HELD_BYTES)
        if not all(entry.endswith(".npy") for entry in archive.namelist()):
            raise zipfile.BadZipFile("it is a zip archive or a spreadsheet; unpack it, or export the sheet as CSV")
    with np.load(path, allow_pickle=False) as content:
        return {key: content[key] for key in content.files}


def _read_matlab(path: Path, name: str) -> dict[str, Any]:
    content = path.read_bytes()
    unpacked_bytes = 0
    for piece in _unpack_matlab(content):
        unpacked_bytes += len(piece)
        require_plausible_inflation(len(content), unpacked_bytes, name, HELD_BYTES)
    from scipy.io import loadmat  # not wanted where other files are read

    found = _flatten(loadmat(path, simplify_cells=True), "")
    return {key: array for key, array in found if isinstance(array, np.ndarray)}


_READERS = {
    ZIP_MAGIC: (_read_npz, "NumPy archive"),
    NUMPY_MAGIC: (_read_npy, "NumPy file"),
    MATLAB_MAGIC: (_read_matlab, "MATLAB file"),
}


def _unpack_matlab(content: bytes) -> Iterator[bytes]:
    """Compressed elements of a MATLAB file, unpacked piece by piece."""
    order, at = "<" if content[126:128] == b"IM" else ">", _MATLAB_HEADER_BYTES
    while at + 8 <= len(content):
        kind, size = struct.unpack_from(f"{order}II", content, at)
        if kind == _COMPRESSED:
            unpacking, rest = zlib.decompressobj(), content[at + 8 : at + 8 + size]
            while rest and not unpacking.eof:
                yield unpacking.decompress(rest, 2**20)
                rest = unpacking.unconsumed_tail
        at += 8 + size


def _flatten(value: Any, name: str) -> Iterator[tuple[str, Any]]:
    """Arrays and lists in structures by their whole names, ``log.q``; numbered entries are those of a list."""
    if isinstance(value, Mapping) and value and all(str(key).isdecimal() for key in value):
        value = list(value.values())
    if isinstance(value, Mapping):
        for key, each in value.items():
            if not str(key).startswith("__"):
                yield from _flatten(each, f"{name}.{key}" if name else str(key))
    elif isinstance(value, np.ndarray | list):
        yield name, value


def _join_arrays(arrays: Mapping[str, Any], name: str) -> dict[str, Array]:
    """Columns of the arrays with as many rows as most of them, named by lists of as many names as they have columns.

    An array may have a column a sample. Arrays no longer than another is wide hold parameters.
    """
    shaped = {key: np.squeeze(array) for key, array in arrays.items()}
    tables = {key: array for key, array in shaped.items() if array.dtype.kind in "fiu" and array.ndim in (1, 2)}
    width = max((min(array.shape) for array in tables.values() if array.ndim == 2), default=0)
    known = {len(array) for array in tables.values() if array.ndim == 1 and len(array) > width}
    lengths = [next(filter(known.__contains__, array.shape), max(array.shape)) for array in tables.values()]
    if not lengths:
        raise RecordingError(
            f"{name}: no array holds a row a sample; the arrays are {listed(list(arrays)) or 'numbers'}"
        )
    rows = max((length for length in lengths if length > width or len(lengths) == 1), key=lengths.count)
    lists = [array.tolist() for key, array in shaped.items() if is_name_list(key) and array.ndim == 1]
    is_alone = len(tables) == 1  # then its columns need no other name
    columns: dict[str, Array] = {}
    for key, array in tables.items():
        values = array if len(array) == rows else array.T
        if len(values) != rows or values[0].size > _MOST_COLUMNS:
            continue
        numbers = range(is_alone, values[0].size + is_alone)
        elements = next((names for names in lists if len(set(names)) == values[0].size), numbers)
        named = [key] if array.ndim == 1 else [str(each) if is_alone else f"{key}[{each}]" for each in elements]
        columns |= dict(zip(named, values.astype(np.float64).reshape(rows, -1).T, strict=True))
    return columns


def _read_json(path: Path, name: str) -> dict[str, Array]:
    """Columns of lines that are an object each, of a list of objects, or of an object of lists."""
    if path.stat().st_size > _LARGEST_JSON_BYTES:
        raise RecordingError(f"{name}: is JSON of more than {_LARGEST_JSON_BYTES >> 20} MiB; save it as CSV or Parquet")
    content = _parse_json(path.read_bytes().removeprefix(b"\xef\xbb\xbf"), name)
    if isinstance(content, list) and not isinstance(content[0], list):
        return _join_records(content, path, name)
    lists = {key: value for key, value in _flatten(content, "") if isinstance(value, list) and value}
    records = next((value for value in lists.values() if isinstance(value[0], dict)), None)
    if records is not None:
        return _join_records(records, path, name)
    return _join_arrays({key: array for key, value in lists.items() if (array := _make_array(value)) is not None}, name)


def _parse_json(text: bytes, name: str) -> Any:
    first, *others = text.strip().split(b"\n")
    try:
        records = [from_json(first)]
    except ValueError:  # it goes on in the next line
        return from_json(text)
    for number, line in enumerate(others, 2):
        try:
            records += [from_json(line)] if line.strip() else []
        except ValueError as error:
            raise RecordingError(f"{name}: line {number} is no whole JSON object; delete or complete it") from error
    return records if others else records[0]


def _make_array(value: Any) -> Array | None:
    try:
        return np.array(value, dtype=str if isinstance(value[0], str) else np.float64)
    except (ValueError, TypeError):  # objects, or lists of different lengths
        return None


def _join_records(records: Iterable[Any], path: Path, name: str) -> dict[str, Array]:
    """Columns of objects, NaN where one lacks a value."""
    columns: dict[str, list[float]] = {}
    rows, size = 0, path.stat().st_size
    for rows, record in enumerate(records, 1):
        for key, value in _find_numbers(record, ""):
            if key not in columns:  # each may have a key of its own
                require_plausible_inflation(size, 8 * rows * len(columns), name, HELD_BYTES)
            column = columns.setdefault(key, [])
            column += [math.nan] * (rows - 1 - len(column)) + [value]
    if not columns:
        raise RecordingError(f"{name}: no object holds a number by a name")
    return {key: np.array(column + [math.nan] * (rows - len(column))) for key, column in columns.items()}


def _find_numbers(value: Any, name: str) -> Iterator[tuple[str, float]]:
    """Numbers of an object by their whole names: ``state.position[elbow]`` where it names its joints, else by place."""
    if isinstance(value, dict):
        joints = next((each for key, each in value.items() if is_name_list(key) and isinstance(each, list)), [])
        for key, each in value.items():
            inner = f"{name}.{key}" if name else key
            if isinstance(each, list):
                elements = joints if len(joints) == len(each) else range(len(each))
                for element, number in zip(elements, each, strict=True):
                    yield from _find_numbers(number, f"{inner}[{element}]")
            else:
                yield from _find_numbers(each, inner)
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield name, float(value)
