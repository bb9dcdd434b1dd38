"""How a file's columns are found: by its mapping, a preset or their own names; and what to give where they are not."""

import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace

from tauscope.errors import RecordingError, RecordingMismatchError
from tauscope.recording.columns import ColumnLayout, find_columns
from tauscope.recording.csv_dialect import is_number
from tauscope.recording.layout.families import BY_NAME, role_of, words_of
from tauscope.recording.layout.guess import guess_layout, guess_parts, is_numbered, layout_text
from tauscope.recording.layout.presets import PRESET_OF
from tauscope.recording.layout.rename import mismatch, rename_columns, require_as_many, say_layout
from tauscope.recording.unit_text import collect_units, root_of, stated_unit
from tauscope.recording.units import Reading
from tauscope.result_warning import ResultWarning
from tauscope.robot.messages import printable
from tauscope.robot.recording_layout import UNITS, RecordingLayout, Source


def find_layout(header: Sequence[str], reading: Reading, file: str) -> tuple[Reading, ColumnLayout]:
    """How a file is read, and which of its columns is which. Raises RecordingError as `map_columns`."""
    if reading.is_usual and _is_ours(header):  # Tauscope made it, and the robot file describes those of another tool
        try:
            rename_columns(header, reading, file)
        except RecordingError:
            reading = replace(reading, columns=None, units={}, rate_hz=None)
    layout = map_columns(header, reading, file)
    return replace(reading, units={**units_of_names(header, layout, reading, file), **reading.units}), layout


def map_columns(header: Sequence[str], reading: Reading, file: str) -> ColumnLayout:
    """Columns of CONTRACT.md in a file's header, by its mapping, its preset or their own names.

    Raises RecordingError, which holds the mapping that the header suggests; RecordingMismatchError for other joints.
    """
    renamed = rename_columns(header, reading, file)
    try:
        return replace(_find_columns(renamed, reading, file), notes=_note_command(header, renamed))
    except RecordingError as error:
        if reading.columns is not None or isinstance(error, RecordingMismatchError):
            raise
        guess = suggest_layout(header, reading, file)
        if guess is None:
            if _is_ours(header):
                raise
            if not is_numbered(header):
                require_as_many(header, None, None, reading, file)
            raise RecordingError(f"{error}; {_say_parts(header, reading)}") from error
        what = f"{file}: the first row holds numbers where the column names are expected"
        raise RecordingError(
            f"{what if is_numbered(header) else error}; {_say_guess(guess, header, reading)}"
        ) from error


def _find_columns(renamed: Sequence[str], reading: Reading, file: str) -> ColumnLayout:
    counts_rows = reading.units.get("t") == "index" and "t" not in renamed
    return find_columns(["t", *renamed] if counts_rows else renamed, file, counts_rows=counts_rows)


def _note_command(header: Sequence[str], renamed: Sequence[str]) -> tuple[ResultWarning, ...]:
    column = next((name for name, target in zip(header, renamed, strict=True) if target == "tau1"), "tau1")
    role = None if column == "tau1" else role_of(words_of(column))
    if role is None or role[0] != "taucmd":
        return ()
    text = f"column {printable(column)}: this effort is commanded, not measured; it holds the controller's own model"
    remedy = "record measured torques or currents, and state torque_constant for currents"
    return (ResultWarning(code="commanded-effort", text=text, remedy=remedy),)


def units_of_names(header: Sequence[str], layout: ColumnLayout, reading: Reading, file: str) -> dict[str, str]:
    """Units that the names of columns state, where nobody else states them. Raises RecordingError for unknown ones."""
    names = {name: header[index] for name, index in zip(layout.names, layout.source, strict=True)}
    asked = {name for name in names if not {name, root_of(name)}.intersection(reading.units)}
    texts = {name: stated_unit(name, text) for name, text in names.items() if name in asked}
    units = collect_units({name: text for name, text in texts.items() if text not in (reading.joint_names or ())})
    for target, unit in units.items():
        known = UNITS[root_of(target)]
        if unit not in known:
            column = next(name for column, name in names.items() if target in (column, root_of(column)))
            raise RecordingError(
                f"{file}: column {printable(column)}: {printable(unit)} is no unit that is known; state it by --units "
                f"{target}=UNIT, of {', '.join(known)}, or convert the column"
            )
    return units


def order_by_cells(
    header: Sequence[str], layout: ColumnLayout, cells: Sequence[str], reading: Reading, file: str
) -> ColumnLayout:
    """The same with each joint's columns in the place of its name, where a file names the joints in its rows.

    So do logs of ROS messages as text: ``name0, name1, …, position0, …``. `cells`: of the first row. Raises
    RecordingMismatchError where these name other joints.
    """
    robot = reading.joint_names or ()
    is_by_place = reading.columns is not None and BY_NAME not in str(reading.columns)
    if len(robot) < 2 or not is_by_place:
        return layout
    named = {
        cell: name
        for name, cell in zip(header, cells, strict=False)
        if "name" in words_of(name) and _LAST_NUMBER.search(name)
    }
    if is_numbered(header):  # the texts before the numbers, of which a frame may be the first
        texts = [cell for cell in cells if cell and not is_number(cell.encode())][-len(robot) :]
        named = {cell: str(place) for place, cell in enumerate(texts)}
    if len(named) < len(robot):
        return layout
    if not set(robot) <= named.keys():
        raise mismatch(f"{file}: the rows name", [*named], robot)

    def move(column: str, index: int) -> int:
        """Place of the column of the joint that the robot has in the place of this one."""
        group = column.rstrip("0123456789")
        joint = robot[int(column[len(group) :] or 1) - 1]
        if is_numbered(header):
            columns = sorted(each for name, each in where.items() if name.rstrip("0123456789") == group)
            return columns[int(named[joint])] if len(columns) == len(robot) else index
        wanted = _LAST_NUMBER.sub(_LAST_NUMBER.findall(named[joint])[0], header[index])
        return header.index(wanted) if wanted in header else index

    where = dict(zip(layout.names, layout.source, strict=True))
    return replace(layout, source=tuple(move(column, index) for column, index in where.items()))


_LAST_NUMBER = re.compile(r"[0-9]+(?=[^0-9]*$)")


def suggest_layout(header: Sequence[str], reading: Reading, file: str) -> RecordingLayout | None:
    """The mapping that the header suggests, None where a file with it would be refused again."""
    guess = guess_layout(header, reading)
    if guess is None:
        return None
    units = _units_of_tool(header)
    try:
        layout = _find_columns(rename_columns(header, replace(reading, columns=guess), file), reading, file)
    except RecordingError:
        return None
    with suppress(RecordingError):  # who reads the file so is told of units that are not known
        units = {**units, **units_of_names(header, layout, replace(reading, units=units), file)}
    return RecordingLayout(columns=guess, units=units)


def _units_of_tool(header: Sequence[str]) -> Mapping[str, str]:
    """Units of the preset whose mark a column has, such as LeRobot's degrees."""
    marked = (preset for preset in PRESET_OF.values() if preset.mark)
    return next(
        (preset.units for preset in marked if any(re.search(f"{preset.mark}(?![A-Za-z])", name) for name in header)), {}
    )


def _is_ours(header: Sequence[str]) -> bool:
    """Whether columns have the names of CONTRACT.md, so that no mapping is missing."""
    return "t" in header and "q1" in header


def _say_guess(guess: RecordingLayout, header: Sequence[str], reading: Reading) -> str:
    """What to give where a header suggests all columns, and what it takes for granted."""
    condition = "this maps them"
    if not is_numbered(header) and isinstance(guess.columns, Mapping) and isinstance(guess.columns["q"], list):
        condition = f"the first {len(guess.columns['q'])} joints are the robot's"
    return say_layout(replace(guess, decimal=reading.decimal, delimiter=reading.delimiter), condition)


def _say_parts(header: Sequence[str], reading: Reading) -> str:
    """What to give where it suggests some: a mapping with ``?`` for the others."""
    parts = guess_parts(header, reading)
    each: Source = ["?"] * len(reading.joint_names or "?") if is_numbered(header) else "?{1}"
    lacks: dict[str, Source] = {"t": "?", "q": each, "tau": each}
    if {"i", "qref"} & parts.keys():
        del lacks["tau"]
    layout = layout_text(RecordingLayout(columns=lacks | parts))
    timeless = " (without t, and with --units t=index --rate HZ, where no column is the time)"
    return f"give --columns FILE.yaml with a name for each ?{'' if 't' in parts else timeless}: {layout}"
