"""Families of columns: names that differ in a joint's number or name alone, and the quantity that they hold."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass


def _split(words: str) -> tuple[str, ...]:
    return tuple(words.split())


_WORDS_OF = {
    "q": "q qpos position positions pos angle angles theta state winkel istposition istwinkel mp",
    "qd": "qd dq qdot qvel velocity velocities vel speed speeds omega",
    "qdd": "qdd ddq qacc acceleration accelerations acc",
    "tau": "tau torque torques effort efforts eff trq moment moments force drehmoment istmoment mt",
    "i": "i iq current currents cur curr strom iststrom load",
    "qref": "qref action sollposition sollwinkel ip",
    "taucmd": "taucmd ctrl",
    "temp": "temp temperature temperatures",
    "volt": "volt volts voltage voltages",
    "qlink": "qlink",
}
_CORES: Mapping[str, str] = {word: group for group, words in _WORDS_OF.items() for word in _split(words)}
_COMMANDED = _split(
    "target desired des d cmd command commanded ref reference goal setpoint setpt sp soll consigne ipo action"
)
# Words of quantities that belong to no joint, or are not its measurement.
_FOREIGN = {
    *_split("tcp ee eef cartesian base tool ext external wrench object pose contact"),
    *_split("qfrc gravity error err bias limit limits max min std stddev var variance accelerometer imu"),
}
_QUALIFIERS = _split("present actual measured meas act raw filtered msr computed applied")
_JOINTS = {*_split("axis joint j a")}  # what is said of it is its position: `J1`, `AXIS_ACT_A1`
_NO_NAMES = {*_CORES, *_COMMANDED, *_QUALIFIERS}  # they name a quantity or how it came about, and no joint
# Words that make a family second choice.
_LEVELS: Mapping[str, int] = {
    **{"computed": 1, "motor": 1, "force": 2, "theta": 2, "load": 2, "state": 3},
    **dict.fromkeys(_split("ff feedforward est estimated estimate model modelled predicted nominal friction"), 5),
}
_TIMES = _split(
    "t time zeit timestamp zeitstempel stamp sim_time time_s tout x_value seconds secs sec clock elapsed duration"
)  # the likeliest first


def role_of(words: Sequence[str]) -> tuple[str, int] | None:
    """The group of CONTRACT.md that the last word naming a quantity names, and its distance from the first choice."""
    if tuple(words[-2:]) == ("qfrc", "actuator"):  # the joint torque of MuJoCo's actuators
        return "tau", 0
    if _FOREIGN.intersection(words):
        return None
    cores = [word for word in words if word in _CORES]
    is_joint = not cores and bool(words) and _JOINTS.union(_COMMANDED, _QUALIFIERS).issuperset(words)
    if not cores and not is_joint:
        return None
    role = "q" if is_joint else _CORES[cores[-1]]
    if "dot" in words:
        role = {"q": "qd", "qd": "qdd"}.get(role, role)
    if "link" in words and role == "q":
        role = "qlink"
    if set(_COMMANDED).intersection(words):
        role = {"q": "qref", "tau": "taucmd", "qref": "qref", "taucmd": "taucmd"}.get(role, "")
    return (role, sum(_LEVELS.get(word, 0) for word in words) + 4 * is_joint) if role else None


def source_of(words: Sequence[str]) -> frozenset[str]:
    """The words that say whose quantity a column holds: `leader`, `sim`."""
    return frozenset(words) - _NO_NAMES - _LEVELS.keys() - {"joint"}


def is_silent(words: Sequence[str]) -> bool:
    """Whether no word says which quantity a column holds, or that it holds another one."""
    return _NO_NAMES.union(_FOREIGN).isdisjoint(words)


def time_rank(words: Sequence[str]) -> int | None:
    """How likely a column is the time; the least is the likeliest, None where it is none."""
    name = "_".join(word for word in words if word not in ("ms", "us", "ns", "s", "min"))
    if name in _TIMES:
        return _TIMES.index(name)
    return next((len(_TIMES) + rank for rank, time in enumerate(_TIMES) if name.endswith(f"_{time}")), None)


def is_name_list(column: str) -> bool:
    """Whether a column, or an array, is the list of joints or columns that other lists follow: ``msg.name``."""
    return re.split(r"[./]", column)[-1].lower() in ("name", "names", "joint_names", "joints", "columns", "header")


# Placeholders of a template: the joint's number from 0, its number from 1, its name.
FROM_ZERO, FROM_ONE, BY_NAME = "{0}", "{1}", "{name}"
PLACEHOLDERS = (FROM_ZERO, FROM_ONE, BY_NAME)

_WORD = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])|[0-9]+")
_JOINT = re.compile(r"\[[^\[\]]*\{(?:0|1|name)\}[^\[\]]*\]|\{(?:0|1|name)\}")
_SEGMENT = re.compile(r"[^/.\[\]:]+")
_NUMBER = re.compile(r"[0-9]+")

# Characters of a column's name beyond which it belongs to no family: topic, field and joint are shorter together.
LONGEST_NAME = 200


@dataclass(frozen=True)
class Family:
    """Columns of one quantity, one a joint."""

    template: str  # name of the columns with a placeholder for the joint
    # columns in the order of the joints: by number, of the robot, or of the file; by place where they have one name
    columns: tuple[str | int, ...]
    is_regular: bool = True  # whether the template gives the columns; zeros in front of a number it does not
    is_guessed: bool = False  # whether the joints' names are any part of the columns' names

    @property
    def words(self) -> tuple[str, ...]:
        """Words of the template in lower case, without its placeholder and the brackets around it."""
        return words_of(_JOINT.sub(" ", self.template))


def words_of(text: str) -> tuple[str, ...]:
    """Words of a column's name, in lower case: at separators, at digits and where a capital begins one."""
    return tuple(word.lower() for word in _WORD.findall(text))


def find_families(header: Sequence[str], joint_names: Sequence[str] | None) -> list[Family]:
    """Families of a header: named by the robot's joints, numbered, or named by any word; one joint has no number."""
    repeated = _find_repeated_families(header)
    header = [name for name in header if len(name) <= LONGEST_NAME]
    named = _find_named_families(header, joint_names or ())
    has_one = joint_names is None or len(joint_names) == 1
    single = [Family(name, (name,), is_guessed=True) for name in header if has_one and not _NUMBER.search(name)]
    return [*named, *_find_numbered(header), *([] if named else _find_segment_families(header)), *single, *repeated]


def fill_template(template: str, index: int, name: str | None) -> str:
    """The column of a joint. `index`: counted from 0."""
    filled = template.replace(FROM_ZERO, str(index)).replace(FROM_ONE, str(index + 1))
    return filled if name is None else filled.replace(BY_NAME, name)


def names_in(header: Sequence[str], template: str) -> list[str]:
    """Joint names that a header has in place of a template's placeholder, in the order of the header."""
    before, _, after = template.partition(BY_NAME)
    pattern = re.compile(re.escape(before) + "(.+)" + re.escape(after))
    return [match[1] for match in map(pattern.fullmatch, header) if match]


def _find_repeated_families(header: Sequence[str]) -> list[Family]:
    """Families whose columns all have one name."""
    places: dict[str, list[int]] = {}
    for place, name in enumerate(header, 1):
        places.setdefault(name[: LONGEST_NAME + 1], []).append(place)
    return [
        Family(name, tuple(found), is_regular=False)
        for name, found in places.items()
        if len(found) > 1 and len(name) <= LONGEST_NAME
    ]


def _find_numbered(header: Sequence[str]) -> list[Family]:
    """Families in which a number runs from 0 or from 1 without a gap."""
    groups: dict[tuple[str, str], dict[int, str]] = {}
    for name in header:
        for match in _NUMBER.finditer(name):
            groups.setdefault((name[: match.start()], name[match.end() :]), {})[int(match[0])] = name
    found = []
    for (before, after), columns in groups.items():
        first = 0 if 0 in columns else 1
        if set(columns) == set(range(first, first + len(columns))):
            template = before + (FROM_ZERO if first == 0 else FROM_ONE) + after
            names = tuple(columns[number] for number in sorted(columns))
            is_regular = all(fill_template(template, k, None) == name for k, name in enumerate(names))
            found.append(Family(template, names, is_regular))
            if first == 1 and (stem := before.rstrip("._ ") + after) in header:  # pandas: `pos`, `pos.1`, `pos.2`
                found.append(Family(template, (stem, *names), is_regular=False))
    return found


def _find_named_families(header: Sequence[str], joint_names: Sequence[str]) -> list[Family]:
    patterns = {
        name: re.compile(f"(?<![A-Za-z0-9]){re.escape(name)}(?![A-Za-z0-9])")
        for name in sorted(joint_names, key=len, reverse=True)
    }
    groups: dict[str, dict[str, str]] = {}
    for column in header:
        for name, pattern in patterns.items():
            match = pattern.search(column)
            if match:
                groups.setdefault(column[: match.start()] + BY_NAME + column[match.end() :], {})[name] = column
                break
    return [
        Family(template, tuple(columns[name] for name in joint_names))
        for template, columns in groups.items()
        if len(columns) == len(joint_names)
    ]


def _find_segment_families(header: Sequence[str]) -> list[Family]:
    """Families in which one segment is the joint: ``/states/elbow/position``, ``effort[elbow]``, ``elbow_pos``."""
    groups: dict[str, dict[str, str]] = {}
    for column in header:
        for template, name in _segments(column):
            groups.setdefault(template, {})[name] = column
    return [
        Family(template, tuple(columns.values()), is_guessed=True)
        for template, columns in groups.items()
        if all(not name.isdecimal() and _NO_NAMES.isdisjoint(words_of(name)) for name in columns)
    ]


def _segments(column: str) -> list[tuple[str, str]]:
    """The column with a placeholder for each part that may be a joint's name, and that part."""
    spans = [match.span() for match in _SEGMENT.finditer(column)][-2:]
    spans = spans if len(spans) > 1 else []
    first, last = column.find("_"), column.rfind("_")
    if first > 0 and last < len(column) - 1 and not spans:
        spans = [(0, last), (first + 1, len(column))]
    return [(column[:start] + BY_NAME + column[stop:], column[start:stop]) for start, stop in spans]
