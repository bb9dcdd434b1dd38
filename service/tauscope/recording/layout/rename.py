"""A header's columns under the names of CONTRACT.md, as a mapping or a preset says."""

import difflib
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace

from tauscope.errors import RecordingError, RecordingMismatchError
from tauscope.recording.layout.families import BY_NAME, FROM_ZERO, PLACEHOLDERS, fill_template, names_in
from tauscope.recording.layout.guess import guess_layout, guess_parts, layout_text
from tauscope.recording.layout.presets import PRESET_OF
from tauscope.recording.units import Reading
from tauscope.robot.messages import listed, printable
from tauscope.robot.recording_layout import RecordingLayout, Source

_TARGET = re.compile(r"([a-z]+)([0-9]*)")
NANOSECONDS = "t nanoseconds"  # name of the column with the nanoseconds of each second
_EFFORTS = ("tau", "i")


def rename_columns(header: Sequence[str], reading: Reading, file: str) -> list[str]:
    """The header with the names of CONTRACT.md. Raises RecordingError for names or joints that it lacks."""
    columns = reading.columns
    if columns is None:
        return list(header)
    if isinstance(columns, str):
        columns = _preset_columns(header, columns, reading, file)
    target_of = _Mapping(header, reading, file).expand(columns)
    taken, whole = set(target_of.values()), {target for target in columns if not _split(target)[1]}
    efforts = {_group(target) for target in columns} & {*_EFFORTS}
    others = {*_EFFORTS} - efforts if efforts else set()

    def is_replaced(name: str) -> bool:
        return name in taken or _group(name) in whole | others

    # A column that the mapping leaves out keeps its name, unless the mapping has another in its place.
    return [target_of.get(index, f"{name} " if is_replaced(name) else name) for index, name in enumerate(header)]


def _preset_columns(header: Sequence[str], preset: str, reading: Reading, file: str) -> Mapping[str, Source]:
    columns = guess_layout(header, reading, preset)
    require_as_many(header, preset, columns, reading, file)
    if columns is not None:
        return columns
    parts, known = guess_parts(header, reading, preset), PRESET_OF[preset].columns
    lacks, groups = next(
        (words, groups)
        for words, *groups in (("time", "t"), ("position", "q"), ("effort", "tau", "i", "taucmd"))
        if not parts.keys() & {*groups}
    )
    names = [name for group in groups for name in known.get(group, ())]
    other = guess_layout(header, reading)
    way_out = "record it, or name the columns by --columns FILE.yaml"
    way_out = way_out if other is None else say_layout(RecordingLayout(columns=other), "this maps")
    raise RecordingError(
        f"{file}: no column holds the {lacks}, which {preset} calls {' or '.join(names)}; the columns are "
        f"{listed(header)}; {way_out}"
    )


def require_as_many(
    header: Sequence[str], preset: str | None, columns: Mapping[str, Source] | None, reading: Reading, file: str
) -> None:
    """Refuse columns of other joints, or of more or fewer, than the robot has. `columns`: those that fit it, if any."""
    unnamed = replace(reading, joint_names=None)
    found = None if reading.joint_names is None else guess_layout(header, unnamed, preset)
    if found is None or reading.joint_names is None:
        return
    if columns is None:
        _Mapping(header, reading, file).expand(found)  # names the joints that differ
    targets = _Mapping(header, unnamed, file).expand(found).values()
    count, wanted = sum(_group(target) == "q" for target in targets), len(reading.joint_names)
    if count != wanted and (columns is None or BY_NAME not in str(columns["q"])):
        hint = "give the robot file and the recording of the same arm"
        if columns is not None:
            hint = say_layout(RecordingLayout(columns=columns), f"the first {wanted} are the robot's")
        raise RecordingMismatchError(f"{file}: the columns are of {count} joints, the robot has {wanted}; {hint}")


def say_layout(layout: RecordingLayout, condition: str) -> str:
    """The mapping to give, and what it takes for granted."""
    return f"if {condition}, give it as --columns FILE.yaml: {layout_text(layout)}"


def mismatch(place: str, found: Sequence[str], robot: Sequence[str], way_out: str = "") -> RecordingMismatchError:
    """Joints that are not the robot's. `place`: file, columns or topic, and the verb; `way_out`: beside new names."""
    remedy = f"; name the robot's joints as the recording does{way_out}"
    missed = [name for name in robot if name not in found]
    if len(missed) < len(robot):
        verb, still = "is" if len(missed) == 1 else "are", ", ".join(f"{name}: 0" for name in missed)
        remedy = f": {listed(missed)} {verb} missing; record them too, or state in a robot file locked: {{{still}}}"
    return RecordingMismatchError(
        f"{place} {len(found)} joints ({listed(found)}), the robot has {len(robot)} ({listed(robot)}){remedy}"
    )


class _Mapping:
    """Turns a mapping for all joints into one for each column."""

    def __init__(self, header: Sequence[str], reading: Reading, file: str) -> None:
        self._header, self._file = header, file
        self._places: dict[str, list[str]] = {}
        for place, name in enumerate(header, 1):
            self._places.setdefault(name, []).append(str(place))
        self._robot = reading.joint_names
        self._names: Sequence[str] | None = reading.joint_names

    def expand(self, columns: Mapping[str, Source]) -> dict[int, str]:
        """Column of CONTRACT.md by the index of the file's."""
        target_of: dict[int, str] = {}
        for target, source in columns.items():
            group, number = _split(target)
            is_one = number or group in ("t", "period")
            sources = [source] if isinstance(source, str | int) and is_one else self._group(group, source)
            for joint, name in enumerate(sources):
                index = self._find(name, target)
                wanted = target if is_one else f"{group}{joint + 1}"
                wanted = NANOSECONDS if target == "t" and joint else wanted
                if index in target_of:
                    raise RecordingError(
                        f"{self._file}: column {printable(str(name))} is mapped to {target_of[index]} and {wanted};"
                        " keep one"
                    )
                target_of[index] = wanted
        return target_of

    def _find(self, source: Source, target: str) -> int:
        """Index of a column, by its name, or by its number from 1 where no column has that name."""
        name = str(source)
        places = self._places.get(name, [])
        if len(places) > 1:
            raise RecordingError(
                f"{self._file}: columns: {target}: {len(places)} columns are named {printable(name)}; give one by its "
                f"number, {listed(places)}"
            )
        if places:
            return int(places[0]) - 1
        if isinstance(source, int) and 0 < source <= len(self._header):
            return source - 1
        near = difflib.get_close_matches(name, self._header, 1)
        hint = f"did you mean {printable(near[0])}?" if near else f"the columns are {listed(self._header)}"
        raise RecordingError(f"{self._file}: columns: {target}: no column is named {printable(name)}; {hint}")

    def _group(self, group: str, source: Source) -> Sequence[str | int]:
        if not isinstance(source, str | int):
            return source
        template = str(source)
        if not any(placeholder in template for placeholder in PLACEHOLDERS):
            if template in self._places:
                return [template]
            if elements := names_in(self._header, f"{template}[{BY_NAME}]"):
                template += f"[{FROM_ZERO if elements[0].isdecimal() else BY_NAME}]"
        if BY_NAME in template:
            return self._match_by_name(template)
        if not any(placeholder in template for placeholder in PLACEHOLDERS):
            return [template]
        found = []
        while (name := fill_template(template, len(found), None)) in self._places:
            found.append(name)
        wanted = None if self._robot is None else len(self._robot)
        if wanted is not None and len(found) > wanted and group in ("q", *_EFFORTS):
            raise RecordingMismatchError(
                f"{self._file}: columns: {group}: {printable(template)} numbers {len(found)} joints, the robot has "
                f"{wanted}; list the columns of its joints, as in [{listed(found[:wanted])}]"
            )
        return found or [fill_template(template, 0, None)]

    def _match_by_name(self, template: str) -> Sequence[str]:
        found = names_in(self._header, template)
        if self._names is None:
            self._names = found
        missing = [name for name in self._names if name not in found]
        if not found or missing:
            way_out = ", or list the columns in the order of the robot's joints"
            raise mismatch(f"{self._file}: {printable(template)} names", found, self._names, way_out)
        return [fill_template(template, 0, name) for name in self._names]


def _split(target: str) -> tuple[str, str]:
    match = _TARGET.fullmatch(target)
    return (match[1], match[2]) if match else (target, "")


def _group(name: str) -> str:
    """Group of a column, itself where it is not one of CONTRACT.md."""
    return _split(name)[0]
