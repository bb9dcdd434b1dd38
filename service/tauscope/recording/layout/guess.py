"""The mapping that a file's header suggests: by a preset, or by the words of its columns."""

import json
import re
from collections.abc import Mapping, Sequence
from functools import partial

from tauscope.recording.layout.families import Family, find_families, is_silent, role_of, source_of, time_rank, words_of
from tauscope.recording.layout.presets import PRESET_OF, Preset
from tauscope.recording.unit_text import find_quantity
from tauscope.recording.units import Reading
from tauscope.robot.recording_layout import RecordingLayout, Source

_COMMON_JOINT_COUNTS = (6, 7)
_PLAIN = re.compile(r"(?!(?:y|n|yes|no|on|off|true|false|null)$)[A-Za-z_][A-Za-z0-9_./-]*", re.IGNORECASE)
_WHOLE_SECONDS = re.compile(r"(.*[^A-Za-z]|)secs?")
_PANDAS_INDEX = ("", "Unnamed: 0", "__index_level_0__")  # names of an index without one
_BY_UNIT_ALONE = 6  # behind every rank by words
_EFFORTS = ("tau", "i", "taucmd")
_OPTIONAL = ("qd", "qdd", "qref", "taucmd", "temp", "qlink", "volt")


def guess_layout(header: Sequence[str], reading: Reading, preset: str | None = None) -> dict[str, Source] | None:
    """A header's columns; None without positions, efforts or commands, and time. `preset`: a tool, None for any."""
    found, needed = guess_parts(header, reading, preset), {"q"} if reading.units.get("t") == "index" else {"t", "q"}
    return found if needed <= found.keys() and {"tau", "i", "qref"} & found.keys() else None


def guess_parts(header: Sequence[str], reading: Reading, preset: str | None = None) -> dict[str, Source]:
    """As many columns as their names suggest; arguments as of `guess_layout`."""
    count = None if reading.joint_names is None else len(reading.joint_names)
    if is_numbered(header):
        return {} if preset else _guess_by_place(len(header), count)
    every, tool = find_families(header, reading.joint_names), None if preset is None else PRESET_OF[preset]
    rank = role_of if tool is None else partial(_rank_by_ends, tool)
    families = [(family, found) for family in every if (found := rank(family.words))]
    if tool is None:
        families += [(family, found) for family in every if (found := _rank_by_unit(family))]
    time = _find_time(header, tool.columns["t"] if tool else ())
    efforts = [source_of(family.words) for family, (role, _) in families if role in _EFFORTS]
    q = _choose(families, "q", count, efforts)
    count = count or (len(q.columns) if q else None)
    order = ("tau", "taucmd", "i") if reading.prefers_torque else _EFFORTS
    if reading.joint_names is None:  # then nothing says which of more columns are the joints'
        families = [(family, found) for family, found in families if len(family.columns) == count]
    own = [source_of(q.words)] if q else []
    found = {role: _choose(families, role, count, own) for role in (*order, *_OPTIONAL)}
    effort = next((role for role in order if found[role]), "tau")
    groups = {"q": q, "i" if effort == "i" else "tau": found[effort]}
    groups |= {group: found[group] for group in _OPTIONAL if group != effort}
    index = next((place for place, name in enumerate(header, 1) if name in _PANDAS_INDEX), None)
    clock = index if time is None else _add_nanoseconds(header, time)
    columns: dict[str, Source] = {} if clock is None else {"t": clock}
    return columns | {group: _source(family, count) for group, family in groups.items() if family is not None}


def _rank_by_unit(family: Family) -> tuple[str, int] | None:
    quantity = find_quantity(family.template) if is_silent(family.words) else None
    return None if quantity is None else (quantity, _BY_UNIT_ALONE)


def layout_text(layout: RecordingLayout) -> str:
    """A layout as one line of YAML, as a robot file and ``--columns`` take it."""
    fields = {"columns": layout.columns, "units": layout.units or None, "rate_hz": layout.rate_hz}
    fields |= {"decimal": layout.decimal, "delimiter": layout.delimiter, "topic": layout.topic}
    return f"recording: {flow_text({key: value for key, value in fields.items() if value is not None})}"


def flow_text(value: object) -> str:
    """A value in YAML's flow style, which takes quoted text as JSON does."""
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key}: {flow_text(entry)}" for key, entry in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(flow_text, value)) + "]"
    return value if isinstance(value, str) and _PLAIN.fullmatch(value) else json.dumps(value, ensure_ascii=False)


def is_numbered(header: Sequence[str]) -> bool:
    """Whether columns have numbers from 1 for want of names."""
    return list(header) == [str(number) for number in range(1, len(header) + 1)]


def _guess_by_place(width: int, joint_count: int | None) -> dict[str, Source]:
    """Groups behind the time, behind all that `ros2 topic echo --csv` writes before them, or without time."""
    counts = [joint_count] if joint_count else [*_COMMON_JOINT_COUNTS, (width - 1) // 2]
    shapes = [
        (n, groups) for n in counts if n > 0 for groups in (("q", "tau"), ("q", "qd", "tau"), ("q", "qd", "qdd", "tau"))
    ]
    times: Sequence[tuple[dict[str, Source], bool]] = (({"t": 1}, False), ({"t": [1, 2]}, True), ({}, False))
    for time, has_names in times:
        for n, groups in shapes:
            first = (3 + n if has_names else len(time)) + 1
            if width == first - 1 + len(groups) * n:
                places = {group: [first + k * n + j for j in range(n)] for k, group in enumerate(groups)}
                return {**time, **places}
    return {}


def _rank_by_ends(preset: Preset, words: Sequence[str]) -> tuple[str, int] | None:
    """As `role_of`, by the ends of names that a preset knows."""
    name = "_" + "_".join(words)
    ends = ((end, group, rank) for group, ends in preset.columns.items() for rank, end in enumerate(ends))
    return next(((group, rank) for end, group, rank in ends if group != "t" and name.endswith(f"_{end}")), None)


def _find_time(header: Sequence[str], known: Sequence[str]) -> str | None:
    """The column with the time; a preset's own names go before any other."""

    def rank(column: str) -> int | None:
        name = "_".join(words_of(column))
        return known.index(name) - len(known) if name in known else time_rank(words_of(column))

    ranked = [(found, len(column), column) for column in header if (found := rank(column)) is not None]
    return min(ranked)[2] if ranked else None


def _add_nanoseconds(header: Sequence[str], time: str) -> Source:
    """The column of the time, with that of its nanoseconds where it counts whole seconds; the first of several."""
    if header.count(time) > 1:  # each signal has its own time
        return header.index(time) + 1
    match = _WHOLE_SECONDS.fullmatch(time)
    names = [f"{match[1]}{name}" for name in ("nanosec", "nsec", "nsecs", "nano_sec")] if match else []
    return next(([time, name] for name in names if name in header), time)


def _choose(
    families: Sequence[tuple[Family, tuple[str, int]]], role: str, count: int | None, sources: Sequence[frozenset[str]]
) -> Family | None:
    """The family of a role: with a column for each joint, of the first rank, a joint's, and as near to `sources`."""
    fit = [
        (family, rank) for family, (found, rank) in families if found == role and len(family.columns) >= (count or 1)
    ]

    def unfitness(entry: tuple[Family, int]) -> tuple[object, ...]:
        family, rank = entry
        size = -len(family.columns) if count is None else len(family.columns) != count
        distance = min((len(source_of(family.words) ^ source) for source in sources), default=0)
        return size, rank, "joint" not in family.words, family.is_guessed, distance, len(family.template)

    return min(fit, key=unfitness, default=(None, 0))[0]


def _source(family: Family, count: int | None) -> Source:
    """The family as a template, or as the columns of the first joints where it has more than the robot."""
    is_whole = family.is_regular and count in (None, len(family.columns))
    return family.template if is_whole else list(family.columns[:count])
