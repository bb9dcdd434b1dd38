"""Which column of a recording file means what: names of CONTRACT.md, their order, and what is wrong with a header."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from tauscope.errors import RecordingError, RecordingMismatchError
from tauscope.number_text import counted
from tauscope.recording.csv_dialect import is_number
from tauscope.recording.layout.families import BY_NAME, role_of, words_of
from tauscope.recording.layout.guess import guess_layout, is_numbered, layout_text
from tauscope.recording.layout.presets import PRESET_OF
from tauscope.recording.layout.rename import NANOSECONDS, rename_columns
from tauscope.recording.samples import EffortKind
from tauscope.recording.unit_text import collect_units, root_of, stated_unit
from tauscope.recording.units import Reading
from tauscope.result_warning import ResultWarning
from tauscope.robot.messages import listed, printable
from tauscope.robot.recording_layout import UNITS, RecordingLayout

# Columns of which a joint may have one, in the order in which a table keeps them.
OPTIONAL_GROUPS = ("qd", "qdd", "qref", "taucmd", "temp", "qlink", "volt", "kp")
_JOINT_COLUMN = re.compile(r"(q|tau|i|qd|qdd|qref|taucmd|temp|qlink|volt|kp)([1-9][0-9]{0,3})")


@dataclass(frozen=True)
class ColumnLayout:
    """Where a table's columns are found in a file."""

    names: tuple[str, ...]
    source: tuple[int, ...]
    width: int
    joint_count: int
    effort_kind: EffortKind
    ignored: tuple[str, ...]
    counts_rows: bool = False
    nanoseconds: int | None = None
    notes: tuple[ResultWarning, ...] = ()


def table_columns(joint_count: int, effort_kind: EffortKind, groups: Sequence[str] = ()) -> tuple[str, ...]:
    """Names of a table's columns where every joint has every column."""
    optional = (group for group in OPTIONAL_GROUPS if group in groups and group != effort_kind.value)
    prefixes = ["q", effort_kind.value, *optional]
    names = ["t", *(f"{prefix}{joint}" for prefix in prefixes for joint in range(1, joint_count + 1))]
    return (*names, "period") if "period" in groups else tuple(names)


def is_column(name: str) -> bool:
    """Whether a name is one of CONTRACT.md's."""
    return name in ("t", "period") or _JOINT_COLUMN.fullmatch(name) is not None


def map_columns(header: Sequence[str], reading: Reading, file: str) -> ColumnLayout:
    """Columns of CONTRACT.md in a file's header, by its mapping, its preset or their own names.

    Raises RecordingError, which holds the mapping that the header suggests; RecordingMismatchError for other joints.
    """
    renamed = rename_columns(header, reading, file)
    counts_rows = reading.units.get("t") == "index" and "t" not in renamed
    try:
        layout = find_columns(["t", *renamed] if counts_rows else renamed, file, counts_rows=counts_rows)
        return replace(layout, notes=_note_command(header, renamed))
    except RecordingError as error:
        if reading.columns is not None or isinstance(error, RecordingMismatchError):
            raise
        guess = suggest_layout(header, reading, file)
        if guess is None:
            if _is_ours(header):
                raise
            _require_known_names(header, reading, file)
            raise RecordingError(f"{error}; `tauscope recording map` maps columns of other names") from error
        text = (
            f"{file}: the first row holds numbers where the column names are expected" if is_numbered(header) else error
        )
        layout = layout_text(replace(guess, decimal=reading.decimal, delimiter=reading.delimiter))
        raise RecordingError(f"{text}; if this maps them, give it as --columns FILE.yaml: {layout}") from error


def suggest_layout(header: Sequence[str], reading: Reading, file: str) -> RecordingLayout | None:
    """The mapping that the header suggests, None where a file with it would be refused again."""
    guess = guess_layout(header, reading.joint_names, prefers_torque=reading.prefers_torque)
    if guess is None:
        return None
    units = _units_of_tool(header, reading, guess)
    try:
        layout = find_columns(rename_columns(header, replace(reading, columns=guess.columns), file), file)
        units = {**units, **units_of_names(header, layout, replace(reading, units=units), file)}
    except RecordingError:
        return None
    return replace(guess, units=units)


def _units_of_tool(header: Sequence[str], reading: Reading, guess: RecordingLayout) -> Mapping[str, str]:
    """Units of the preset that reads the same columns, such as LeRobot's degrees."""
    for name, preset in PRESET_OF.items():
        if preset.units:
            layout = guess_layout(header, reading.joint_names, preset=name, prefers_torque=reading.prefers_torque)
            if layout is not None and layout.columns == guess.columns:
                return preset.units
    return {}


def _require_known_names(header: Sequence[str], reading: Reading, file: str) -> None:
    """Refuse columns that name other joints than the robot's: the message lists both."""
    named = guess_layout(header) if reading.joint_names is not None else None
    if named is not None and isinstance(named.columns, Mapping) and BY_NAME in str(named.columns["q"]):
        rename_columns(header, replace(reading, columns=named.columns), file)


def _is_ours(header: Sequence[str]) -> bool:
    """Whether columns have the names of CONTRACT.md, so that no mapping is missing."""
    return "t" in header and "q1" in header


def _note_command(header: Sequence[str], renamed: Sequence[str]) -> tuple[ResultWarning, ...]:
    column = next((name for name, target in zip(header, renamed, strict=True) if target == "tau1"), "tau1")
    role = None if column == "tau1" else role_of(words_of(column))
    if role is None or role[0] != "taucmd":
        return ()
    text = f"column {printable(column)}: this effort is commanded, not measured; it holds the controller's own model"
    remedy = "record measured torques or currents, and state torque_constant for currents"
    return (ResultWarning(code="commanded-effort", text=text, remedy=remedy),)


def find_layout(header: Sequence[str], reading: Reading, file: str) -> tuple[Reading, ColumnLayout]:
    """How a file is read, and which of its columns is which. Raises RecordingError as `map_columns`."""
    if reading.is_usual and _is_ours(header):  # Tauscope made it, and the robot file describes those of another tool
        try:
            rename_columns(header, reading, file)
        except RecordingError:
            reading = replace(reading, columns=None, units={}, rate_hz=None)
    layout = map_columns(header, reading, file)
    return replace(reading, units={**units_of_names(header, layout, reading, file), **reading.units}), layout


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
    named = [cell for name, cell in zip(header, cells, strict=False) if "name" in words_of(name)]
    if is_numbered(header):  # the texts before the numbers, of which a frame may be the first
        named = [cell for cell in cells if not is_number(cell.encode()) and cell][-len(robot) :]
    if len(named) != len(robot):
        return layout
    if set(named) != set(robot):
        raise RecordingMismatchError(
            f"{file}: the rows name the joints {listed(named)}, the robot's are {listed(robot)}; name the robot's "
            "joints as the recording does"
        )
    where = dict(zip(layout.names, layout.source, strict=True))
    moved = {}
    for group in {name.rstrip("0123456789") for name in layout.names}:
        columns = sorted(index for name, index in where.items() if name.rstrip("0123456789") == group)
        if len(columns) == len(robot):
            moved |= {f"{group}{joint}": columns[named.index(name)] for joint, name in enumerate(robot, 1)}
    return replace(layout, source=tuple((where | moved)[name] for name in layout.names))


def find_columns(header: Sequence[str], file: str, *, counts_rows: bool = False) -> ColumnLayout:
    """Columns of CONTRACT.md in a header; `counts_rows`: its first name is no column. Raises RecordingError."""
    where = _positions(header, file)
    if "t" not in where:
        raise RecordingError(f"{file}: column t (time in seconds) is missing; the columns are {listed(header)}")
    for name in ("q0", "tau0", "i0"):
        if name in where:
            raise RecordingError(
                f"{file}: column {name} belongs to no joint: joints are numbered from 1, q1 is the first"
            )
    joints = {prefix: _joints_of(prefix, where) for prefix in ("q", "tau", "i", *OPTIONAL_GROUPS)}
    effort_kind = next((kind for kind in EffortKind if joints[kind.value]), EffortKind.TORQUE)
    joint_count = _joint_count(joints, effort_kind, header, file)
    names = _order_names(joints, effort_kind, joint_count, where, file)
    used = set(names)
    return ColumnLayout(
        names=names,
        source=tuple(max(where[name] - counts_rows, 0) for name in names),
        width=len(header) - counts_rows,
        joint_count=joint_count,
        effort_kind=effort_kind,
        ignored=tuple(name.strip() for name in header if name and name not in used),
        counts_rows=counts_rows,
        nanoseconds=where.get(NANOSECONDS),
    )


def require_joint_count(found: int, expected: int | None, file: str) -> None:
    """Refuse a recording of another robot. Raises RecordingMismatchError."""
    if expected is None or found == expected:
        return
    fault = f"column q{found + 1} is missing" if found < expected else f"column q{expected + 1} belongs to no joint"
    raise RecordingMismatchError(
        f"{file}: the recording has {counted(found, 'joint')}, the robot has {counted(expected, 'joint')}: {fault}; "
        "give the robot file and the recording of the same arm"
    )


def _positions(header: Sequence[str], file: str) -> dict[str, int]:
    """Index of every named column; unnamed ones (pandas writes its index so) are nobody's."""
    where: dict[str, int] = {}
    for index, name in enumerate(header):
        if name in where and is_column(name):
            raise RecordingError(
                f"{file}: column {printable(name)} appears twice (as columns {where[name] + 1} and {index + 1}); "
                "rename or delete one"
            )
        if name:
            where[name] = index
    return where


def _joints_of(prefix: str, where: dict[str, int]) -> list[int]:
    """Joint numbers for which a column with this prefix exists, ascending."""
    matches = (_JOINT_COLUMN.fullmatch(name) for name in where)
    return sorted(int(match[2]) for match in matches if match and match[1] == prefix)


def _joint_count(joints: dict[str, list[int]], effort_kind: EffortKind, header: Sequence[str], file: str) -> int:
    """Number of joints, once positions and efforts are known to be numbered 1…n alike."""
    effort = effort_kind.value
    if not joints["q"]:
        raise RecordingError(f"{file}: column q1 (position of joint 1) is missing; the columns are {listed(header)}")
    if not joints[effort]:
        raise RecordingError(
            f"{file}: column tau1 (or i1, torque or current of joint 1) is missing, and qref1, of which a"
            f" stated actuator makes it; the columns are {listed(header)}"
        )
    joint_count = max(joints["q"][-1], joints[effort][-1])
    for prefix in ("q", effort):
        present = set(joints[prefix])
        for joint in range(1, joint_count + 1):
            if joint not in present:
                other = f"q{joint_count}" if joint_count in joints["q"] else f"{effort}{joint_count}"
                raise RecordingError(f"{file}: column {prefix}{joint} is missing: the file has columns up to {other}")
    return joint_count


def _order_names(
    joints: dict[str, list[int]], effort_kind: EffortKind, joint_count: int, where: dict[str, int], file: str
) -> tuple[str, ...]:
    names = list(table_columns(joint_count, effort_kind))
    for group in OPTIONAL_GROUPS:
        for joint in joints[group] if group != effort_kind.value else ():
            if joint > joint_count:
                raise RecordingError(
                    f"{file}: column {group}{joint} belongs to no joint: the positions are q1 to q{joint_count}"
                )
            names.append(f"{group}{joint}")
    return (*names, "period") if "period" in where else tuple(names)
