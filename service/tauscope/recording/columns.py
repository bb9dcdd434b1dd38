"""Which column of a recording file means what: names of CONTRACT.md, their order, and what is wrong with a header."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

from tauscope.errors import RecordingError, RecordingMismatchError
from tauscope.recording.samples import EffortKind
from tauscope.recording.words import listed, printable

OPTIONAL_GROUPS = ("qd", "qdd", "qref", "taucmd", "temp", "qlink")
"""Columns of which a joint may have one, in the order in which a table keeps them."""

_JOINT_COLUMN = re.compile(r"(q|tau|i|qd|qdd|qref|taucmd|temp|qlink)([1-9][0-9]{0,3})")


@dataclass(frozen=True)
class ColumnLayout:
    """Where a table's columns are found in a file."""

    names: tuple[str, ...]
    source: tuple[int, ...]
    width: int
    joint_count: int
    effort_kind: EffortKind
    ignored: tuple[str, ...]


def table_columns(joint_count: int, effort_kind: EffortKind, groups: Sequence[str] = ()) -> tuple[str, ...]:
    """Names of a table's columns where every joint has every column."""
    prefixes = ["q", effort_kind.value, *(group for group in OPTIONAL_GROUPS if group in groups)]
    names = ["t", *(f"{prefix}{joint}" for prefix in prefixes for joint in range(1, joint_count + 1))]
    return (*names, "period") if "period" in groups else tuple(names)


def find_columns(header: Sequence[str], file: str) -> ColumnLayout:
    """Find the columns of CONTRACT.md in a file's header.

    Raises
    ------
    RecordingError
        a required column is missing, a name appears twice, a joint's number leaves a gap
    """
    where = _positions(header, file)
    if "t" not in where:
        raise RecordingError(f"{file}: column t (time in seconds) is missing; the columns are {listed(header)}")
    for name in ("q0", "tau0", "i0"):
        if name in where:
            raise RecordingError(
                f"{file}: column {name} belongs to no joint: joints are numbered from 1, q1 is the first"
            )
    joints = {prefix: _joints_of(prefix, where) for prefix in ("q", "tau", "i", *OPTIONAL_GROUPS)}
    effort_kind = EffortKind.TORQUE if joints["tau"] or not joints["i"] else EffortKind.CURRENT
    joint_count = _joint_count(joints, effort_kind, header, file)
    names = _order_names(joints, effort_kind, joint_count, where, file)
    used = set(names)
    return ColumnLayout(
        names=names,
        source=tuple(where[name] for name in names),
        width=len(header),
        joint_count=joint_count,
        effort_kind=effort_kind,
        ignored=tuple(name for name in header if name and name not in used),
    )


def require_joint_count(found: int, expected: int | None, file: str) -> None:
    """Refuse a recording of another robot.

    Parameters
    ----------
    expected : int or None
        joints of the robot; None where any number is welcome

    Raises
    ------
    RecordingMismatchError
        the numbers differ
    """
    if expected is None or found == expected:
        return
    fault = f"column q{found + 1} is missing" if found < expected else f"column q{expected + 1} belongs to no joint"
    raise RecordingMismatchError(
        f"{file}: the recording has {_joints(found)}, the robot has {_joints(expected)}: {fault}; "
        "give the robot file and the recording of the same arm"
    )


def _positions(header: Sequence[str], file: str) -> dict[str, int]:
    """Index of every named column; unnamed ones (pandas writes its index so) are nobody's."""
    where: dict[str, int] = {}
    for index, name in enumerate(header):
        if name and name in where:
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
            f"{file}: column tau1 (or i1, torque or current of joint 1) is missing; the columns are {listed(header)}"
        )
    joint_count = max(joints["q"][-1], joints[effort][-1])
    for prefix in ("q", effort):
        for joint in range(1, joint_count + 1):
            if joint not in joints[prefix]:
                other = f"q{joint_count}" if joint_count in joints["q"] else f"{effort}{joint_count}"
                raise RecordingError(f"{file}: column {prefix}{joint} is missing: the file has columns up to {other}")
    return joint_count


def _order_names(
    joints: dict[str, list[int]], effort_kind: EffortKind, joint_count: int, where: dict[str, int], file: str
) -> tuple[str, ...]:
    """Columns in the order in which a table keeps them."""
    names = list(table_columns(joint_count, effort_kind))
    for group in OPTIONAL_GROUPS:
        for joint in joints[group]:
            if joint > joint_count:
                raise RecordingError(
                    f"{file}: column {group}{joint} belongs to no joint: the positions are q1 to q{joint_count}"
                )
            names.append(f"{group}{joint}")
    return (*names, "period") if "period" in where else tuple(names)


def _joints(count: int) -> str:
    """A count of joints in words."""
    return f"{count} joint" if count == 1 else f"{count} joints"
