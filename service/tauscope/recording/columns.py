"""Which column of a recording file means what: names of CONTRACT.md, their order, and what is wrong with a header."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

from tauscope.errors import RecordingError, RecordingMismatchError
from tauscope.number_text import counted
from tauscope.recording.layout.rename import NANOSECONDS
from tauscope.recording.samples import EffortKind
from tauscope.result_warning import ResultWarning
from tauscope.robot.messages import listed, printable

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
    fault, way_out = f"column q{expected + 1} belongs to no joint", ""
    if found < expected:
        fault, way_out = f"column q{found + 1} is missing", ", or a robot file that states the others as locked"
    raise RecordingMismatchError(
        f"{file}: the recording has {counted(found, 'joint')}, the robot has {counted(expected, 'joint')}: {fault}; "
        f"give the robot file and the recording of the same arm{way_out}"
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
    every = ((prefix, joint) for prefix in ("q", effort) for joint in range(1, joint_count + 1))
    if missing := next(((prefix, joint) for prefix, joint in every if joint not in joints[prefix]), None):
        other = f"q{joint_count}" if joint_count in joints["q"] else f"{effort}{joint_count}"
        raise RecordingError(f"{file}: column {missing[0]}{missing[1]} is missing: the file has columns up to {other}")
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
