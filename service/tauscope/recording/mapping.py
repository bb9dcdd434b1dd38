"""Which columns of a file are read as which, and in which units: for a user to check and to mend."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from tauscope.errors import RecordingError
from tauscope.recording.columns import find_layout, is_column, suggest_layout
from tauscope.recording.layout.guess import guess_parts
from tauscope.recording.layout.rename import rename_columns
from tauscope.recording.reading import read_header
from tauscope.recording.units import SI, Reading
from tauscope.robot.recording_layout import UNITS
from tauscope.robot.robot import Robot


@dataclass(frozen=True)
class ColumnMapping:
    """A file's columns as they are understood.

    `columns`: column of the file by that of CONTRACT.md, such as ``q1``; only those that were found.
    `units`: unit of ``t``, ``q``, ``qd`` and ``tau``.
    `is_guessed`: whether words of the column names suggest it, and no reader accepts the file without it.
    """

    header: tuple[str, ...]
    columns: Mapping[str, str]
    units: Mapping[str, str]
    is_guessed: bool


def find_mapping(path: Path, robot: Robot | None = None, reading: Reading = SI) -> ColumnMapping:
    """The mapping by which a table is read; where none is, as much as its column names suggest.

    Raises RecordingError where the header cannot be read, or the file is a log, which names its joints itself.
    """
    header = tuple(read_header(path))
    reading = reading.for_robot(robot)
    try:
        used, layout = find_layout(header, reading, path.name)
    except RecordingError:
        return _suggest(header, reading)
    places = zip(layout.names, layout.source, strict=True)
    columns = {name: header[place] for name, place in places if not (name == "t" and layout.counts_rows)}
    return ColumnMapping(header, columns, _complete_units(used.units, columns), is_guessed=False)


def _suggest(header: Sequence[str], reading: Reading) -> ColumnMapping:
    """As much as was stated, or else as the names of the columns suggest."""
    if reading.columns is None:
        guess = suggest_layout(header, reading, "") or guess_parts(header, reading.joint_names)
        reading = replace(reading, columns=guess.columns, units={**guess.units, **reading.units})
    try:
        renamed = rename_columns(header, reading, "")
    except RecordingError:
        renamed = ()
    columns = {target: name for target, name in zip(renamed, header, strict=False) if is_column(target)}
    return ColumnMapping(tuple(header), columns, _complete_units(reading.units, columns), is_guessed=True)


def _complete_units(stated: Mapping[str, str], columns: Mapping[str, str]) -> dict[str, str]:
    """Units of all groups: SI, or the drive's own for currents, where none is stated."""
    usual = {group: units[0] for group, units in UNITS.items()}
    if "i1" in columns:
        usual["tau"] = "A"
    return usual | {group: unit for group, unit in stated.items() if group in usual}
