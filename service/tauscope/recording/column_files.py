"""Files of whole columns, batch by batch: Parquet, by the extra ``tauscope[parquet]``."""

import json
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from tauscope.errors import RecordingError
from tauscope.extras import require_extra
from tauscope.recording.columns import ColumnLayout, require_joint_count
from tauscope.recording.inflation import require_plausible_inflation
from tauscope.recording.intake import Choice, EpisodeClock, RowIntake, SplitClock
from tauscope.recording.layout.families import is_name_list
from tauscope.recording.mapping import find_layout
from tauscope.recording.recording import Array, Recording
from tauscope.recording.units import SECONDS
from tauscope.robot.messages import printable, reason

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
    """Take all rows of the wanted columns, from `first_row` in messages on; `has_episodes`: by ``episode_index``.

    Raises RecordingError, which names row and column, and RecordingMismatchError for another number of joints.
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


_LARGEST_INFO_BYTES = 2**22
_MOST_ELEMENTS = 1000
_FOLDERS_UP = 3  # a LeRobot data set keeps ``data/chunk-000/FILE.parquet`` beside ``meta/info.json``


@dataclass(frozen=True)
class FileColumn:
    """A column of numbers: a whole one, or one element of a column of lists or structures."""

    column: str
    element: int | str | None = None


def unfold_columns(arrow: Any, file: Any, path: Path, name: str) -> dict[str, FileColumn]:
    """Columns by name, ``observation.state[0]`` or ``state[elbow.pos]``. Raises RecordingError for one twice."""
    found: dict[str, FileColumn] = {}
    schema, elements = file.schema_arrow, _element_names(path)
    lists = [_first(file, column) for column in map(str, schema.names) if is_name_list(column)]
    for column in map(str, schema.names):
        if column in found:
            raise RecordingError(f"{name}: column {column} appears twice; rename or delete one")
        kind = schema.field(column).type
        if arrow.types.is_struct(kind):
            fields = [each.name for each in kind if _NUMBER_TYPE.fullmatch(str(each.type))]
            found |= {f"{column}[{field}]": FileColumn(column, field) for field in fields}
            continue
        if not _is_list(arrow, kind):
            found[column] = FileColumn(column)
            continue
        width = min(len(_first(file, column)), _MOST_ELEMENTS)
        known = (names for names in (elements.get(column, ()), *lists) if len(set(names)) == len(names) == width)
        names = next(known, [str(index) for index in range(width)])
        found |= {f"{column}[{element}]": FileColumn(column, index) for index, element in enumerate(names)}
    return found


def take_column(arrow: Any, batch: Any, wanted: FileColumn) -> Any:
    """A column of a batch, or one element of its lists."""
    column = batch.column(wanted.column)
    if isinstance(wanted.element, str):
        return arrow.compute.struct_field(column, wanted.element)
    return column if wanted.element is None else arrow.compute.list_element(column, wanted.element)


def _is_list(arrow: Any, kind: Any) -> bool:
    types = arrow.types
    is_list = types.is_list(kind) or types.is_fixed_size_list(kind) or types.is_large_list(kind)
    return is_list and (types.is_floating(kind.value_type) or types.is_integer(kind.value_type))


def _first(file: Any, column: str) -> Sequence[Any]:
    """The first list of a column; a later one that is shorter is refused as it is read."""
    for batch in file.iter_batches(batch_size=1, columns=[column]):
        value = batch.column(0)[0].as_py()
        if isinstance(value, list):
            return value
    return ()


def _element_names(path: Path) -> Mapping[str, Sequence[str]]:
    """Names of list elements by column, where a data set's ``meta/info.json`` is near; none where it is not."""
    folders = list(path.absolute().parents)[:_FOLDERS_UP]
    info = next((file for folder in folders if (file := folder / "meta" / "info.json").is_file()), None)
    if info is None or info.stat().st_size > _LARGEST_INFO_BYTES:
        return {}
    try:
        features = json.loads(info.read_text(encoding="utf-8"))["features"]
        return {column: _names(feature.get("names")) for column, feature in features.items()}
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return {}


def _names(names: Any) -> Sequence[str]:
    while isinstance(names, dict):
        names = next(iter(names.values()), None)
    return names if isinstance(names, list) and all(isinstance(name, str) for name in names) else ()


PARQUET_MAGIC = b"PAR1"

_NUMBER_TYPE = re.compile(r"u?int(8|16|32|64)|halffloat|float|double")


def read_parquet(path: Path, choice: Choice) -> Recording:
    """Read batch by batch; null is a missed sample. Raises MissingExtraError, RecordingError with row and column."""
    name = choice.file
    arrow = _arrow(name)
    with path.open("rb") as stream, _arrow_errors(arrow, name):
        file = arrow.parquet.ParquetFile(stream, page_checksum_verification=True)
        found = unfold_columns(arrow, file, path, name)
        rows = file.metadata.num_rows

        def open_batches(layout: ColumnLayout, wanted: Sequence[str]) -> Iterator[Batch]:
            columns = [found[column] for column in wanted]
            _require_numbers(file.schema_arrow, columns[: len(layout.names)], layout, name)
            require_plausible_inflation(path.stat().st_size, rows * len(layout.names) * 8, name)
            read = sorted({column.column for column in columns})
            batches = file.iter_batches(batch_size=ROWS_AT_ONCE, columns=read, use_threads=False)
            return _take_batches(arrow, batches, found, columns[0])

        return read_batches(choice, list(found), rows, open_batches, first_row=1, has_episodes=True)


def _take_batches(
    arrow: Any, batches: Iterable[Any], found: Mapping[str, FileColumn], time: FileColumn
) -> Iterator[Batch]:
    """Batches by column; dates with time become seconds since the first one."""
    first_stamp: Any = None
    for batch in batches:
        stamps = take_column(arrow, batch, time)
        if _is_stamp(stamps.type):
            stamps = stamps.cast(f"{str(stamps.type).partition('[')[0]}[ns]", safe=False).cast("int64")
            first_stamp = next((stamp.as_py() for stamp in stamps), 0) if first_stamp is None else first_stamp
            since = arrow.compute.subtract(stamps, first_stamp or 0)
            stamps = arrow.compute.multiply(since.cast("float64"), 1e-9)

        def take(column: str, batch: Any = batch, stamps: Any = stamps) -> Array:
            values = stamps if found[column] == time else take_column(arrow, batch, found[column])
            return values.cast("float64", safe=False).to_numpy(zero_copy_only=False)

        yield take


def read_parquet_header(path: Path, name: str) -> list[str]:
    """Names of columns, lists unfolded. Raises MissingExtraError, and RecordingError for a damaged file."""
    arrow = _arrow(name)
    with path.open("rb") as stream, _arrow_errors(arrow, name):
        return list(unfold_columns(arrow, arrow.parquet.ParquetFile(stream), path, name))


def write_parquet(recording: Recording, file: BinaryIO) -> None:
    """Write float64 columns, checksums on every page. Raises MissingExtraError where pyarrow is not installed."""
    arrow = _arrow(recording.name)
    table = recording.table
    schema = arrow.schema([(name, arrow.float64()) for name in table.names])
    with arrow.parquet.ParquetWriter(file, schema, compression="zstd", write_page_checksum=True) as writer:
        for start in range(0, len(table), ROWS_AT_ONCE):
            block = table.rows(start, min(start + ROWS_AT_ONCE, len(table)))
            columns = [arrow.array(np.ascontiguousarray(column)) for column in block.T]
            writer.write_batch(arrow.record_batch(columns, schema=schema))


def _arrow(name: str) -> Any:
    """The module pyarrow with its Parquet reader, loaded when first wanted: it is large, and an extra."""
    with require_extra(f"{name}: Parquet"):
        import_module("pyarrow.parquet")
        import_module("pyarrow.compute")
        return import_module("pyarrow")


@contextmanager
def _arrow_errors(arrow: Any, name: str) -> Iterator[None]:
    """Arrow's complaints about a damaged file, in one line; it raises many types and they share no base."""
    try:
        yield
    except RecordingError:
        raise
    except (arrow.ArrowException, OSError, ValueError, KeyError, TypeError, MemoryError, OverflowError) as error:
        raise RecordingError(f"{name}: not a readable Parquet file ({reason(error)})") from error


def _require_numbers(schema: Any, wanted: Sequence[FileColumn], layout: ColumnLayout, name: str) -> None:
    for target, column in zip(layout.names, wanted, strict=True):
        kind = schema.field(column.column).type
        is_number = column.element is not None or _NUMBER_TYPE.fullmatch(str(kind))
        if not is_number and not (target == "t" and _is_stamp(kind)):
            hint = "seconds as a float are needed" if target == "t" else "numbers are needed"
            raise RecordingError(f"{name}: column {column.column} is of type {printable(str(kind))}; {hint}")


def _is_stamp(kind: Any) -> bool:
    return str(kind).startswith(("timestamp[", "duration["))
