"""Columns of a Parquet file, list columns unfolded to one column an element, named as LeRobot's ``info.json`` says."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tauscope.errors import RecordingError

_LARGEST_INFO_BYTES = 2**22
_MOST_ELEMENTS = 1000
_FOLDERS_UP = 3
"""A LeRobot data set keeps ``data/chunk-000/FILE.parquet`` beside ``meta/info.json``."""


@dataclass(frozen=True)
class FileColumn:
    """A column of numbers: a whole one, or one element of a list column."""

    column: str
    element: int | None = None


def unfold_columns(arrow: Any, file: Any, path: Path, name: str) -> dict[str, FileColumn]:
    """Every column by its name, elements of lists as ``observation.state[0]`` or ``observation.state[elbow.pos]``.

    Raises RecordingError where two columns have one name.
    """
    found: dict[str, FileColumn] = {}
    schema, elements = file.schema_arrow, _element_names(path)
    for column in map(str, schema.names):
        if column in found:
            raise RecordingError(f"{name}: column {column} appears twice; rename or delete one")
        if not _is_list(arrow, schema.field(column).type):
            found[column] = FileColumn(column)
            continue
        width = _width(arrow, file, column)
        names = elements.get(column, ())
        names = names if len(names) == width else [str(index) for index in range(width)]
        found |= {f"{column}[{element}]": FileColumn(column, index) for index, element in enumerate(names)}
    return found


def take_column(arrow: Any, batch: Any, wanted: FileColumn) -> Any:
    """A column of a batch, or one element of its lists."""
    column = batch.column(wanted.column)
    return column if wanted.element is None else arrow.compute.list_element(column, wanted.element)


def _is_list(arrow: Any, kind: Any) -> bool:
    """Whether a column holds lists of numbers."""
    types = arrow.types
    is_list = types.is_list(kind) or types.is_fixed_size_list(kind) or types.is_large_list(kind)
    return is_list and (types.is_floating(kind.value_type) or types.is_integer(kind.value_type))


def _width(arrow: Any, file: Any, column: str) -> int:
    """Elements of the first list; a later one that is shorter is refused as it is read."""
    for batch in file.iter_batches(batch_size=1, columns=[column]):
        length = arrow.compute.list_value_length(batch.column(0))[0].as_py()
        if length is not None:
            return min(length, _MOST_ELEMENTS)
    return 0


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
    """Names of a feature: a list, or a mapping with one list."""
    while isinstance(names, dict):
        names = next(iter(names.values()), None)
    is_named = isinstance(names, list) and all(isinstance(name, str) for name in names)
    return names if is_named and len(set(names)) == len(names) else ()
