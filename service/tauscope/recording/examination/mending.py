"""A recording with its defects mended, and a warning about each kind of them."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from tauscope.errors import RecordingError
from tauscope.recording.examination.edits import NO_NUMBERS, ColumnEdit, EditedTable, Numbers, row_numbers
from tauscope.recording.examination.scan import Defects, JointDefects, find_defects
from tauscope.recording.recording import Recording
from tauscope.result_warning import ResultWarning
from tauscope.robot.robot import JointType, Robot

ROWS_AT_ONCE = 1 << 15

FILLED_ROWS = 4
"""Rows without an effort that are filled in where positions and efforts come in rows of their own."""

BUS = "check the bus for lost reads and damaged frames"


def mend_recording(recording: Recording, robot: Robot | None = None) -> Recording:
    """Mask or repair the samples of a recording that were never measured, and say so in its notes.

    Raises
    ------
    RecordingError
        a joint has no effort at all
    """
    _require_effort(recording)
    types = [JointType.REVOLUTE] * recording.joint_count if robot is None else [joint.type for joint in robot.joints]
    names = [None] * len(types) if robot is None else [joint.name for joint in robot.joints]
    defects = find_defects(recording, types)
    edits = _edits(recording, defects)
    if not edits:
        return recording
    notes = (*recording.notes, *_warnings(recording, defects, names))
    return replace(recording, table=EditedTable(recording.table, edits), notes=notes)


def _require_effort(recording: Recording) -> None:
    """Refuse a recording in which a joint's effort is NaN throughout."""
    n, kind = recording.joint_count, recording.effort_kind.value
    seen = np.zeros(n, dtype=bool)
    for start in range(0, len(recording), ROWS_AT_ONCE):
        seen |= np.isfinite(recording.samples(start, start + ROWS_AT_ONCE).effort).any(axis=0)
        if seen.all():
            return
    many = not seen.any() and n > 1
    columns = f"columns {kind}1 to {kind}{n} are" if many else f"column {kind}{np.argmin(seen) + 1} is"
    raise RecordingError(
        f"{recording.name}: {columns} NaN throughout: no effort was recorded; record torques or currents of every joint"
    )


def _edits(recording: Recording, defects: Defects) -> dict[int, ColumnEdit]:
    """What is mended, by column."""
    edits: dict[int, ColumnEdit] = {}
    n, names = recording.joint_count, recording.table.names
    for joint, found in enumerate(defects.joints):
        # A row without one joint's position is left out as a whole.
        position = found.position_edit(len(recording), defects.bunched if joint == 0 else NO_NUMBERS)
        if len(position.blank) or len(position.jumps):
            edits[1 + joint] = position
        hold = found.effort_hold if found.effort_hold > 1 else 0
        effort = ColumnEdit(found.lost_efforts, hold=hold, fill=FILLED_ROWS if defects.alternate else 0)
        if len(effort.blank) or effort.hold or effort.fill:
            edits[1 + n + joint] = effort
    return edits


def _warnings(recording: Recording, defects: Defects, joints: Sequence[str | None]) -> Iterator[ResultWarning]:
    """A warning about each kind of defect of each joint."""

    def begin(row: int) -> str:
        return f"first at t = {recording.samples(row, row + 1).time[0]:.6g} s"

    if len(defects.bunched):
        text = f"column t: {_counted(defects.bunched)} within a tenth of an interval of another row"
        remedy = "stamp samples when they are measured, not when a buffer is emptied"
        yield ResultWarning(
            code="time-stamps", text=f"{text}, {begin(int(defects.bunched[0]))}; left out", remedy=remedy
        )
    if defects.alternate:
        text = "positions and efforts stand in rows of their own; efforts are interpolated to the rows of the positions"
        yield ResultWarning(code="held-samples", text=text, remedy="record both at the same instants")
    kind = recording.effort_kind.value
    for number, (joint, name) in enumerate(zip(defects.joints, joints, strict=True), 1):
        for code, text, remedy in _joint_texts(joint, f"q{number}", f"{kind}{number}", begin):
            yield ResultWarning(code=code, joint=name, text=f"column {text}", remedy=remedy)


def _joint_texts(
    joint: JointDefects, q: str, effort: str, begin: Callable[[int], str]
) -> Iterator[tuple[str, str, str | None]]:
    """Code, text and remedy of each kind of defect of one joint."""
    if joint.wraps:
        first, times = min(joint.wraps)[0], "once" if len(joint.wraps) == 1 else f"{len(joint.wraps)} times"
        yield "wrapped-angle", f"{q}: wraps by 2π {times}, {begin(first)}; unwrapped", None
    if joint.jumps:
        jumps = sorted(joint.jumps)
        heights = ", ".join(f"{step:.4g}" for _, step in jumps[:3]) + (", …" if len(jumps) > 3 else "")
        text = f"{q}: jumps by {heights}, {begin(jumps[0][0])}; taken out, the longest piece is kept as it is"
        yield "encoder-reset", text, "home the encoder before the recording, and not within it"
    slow = "record at the rate of the controller"
    if len(joint.repeated):
        text = f"{q}: holds each value for about {joint.hold} rows; {_counted(joint.repeated)} masked"
        yield "held-samples", text, slow
    if joint.effort_hold > 1:
        text = f"{effort}: holds each value for about {joint.effort_hold} rows; interpolated from change to change"
        yield "held-samples", text, slow
    for code, column, rows, words in (
        ("spikes", q, joint.spikes, "away from the neighbours by a jump and back"),
        ("stuck-samples", q, joint.frozen, "with a repeated value that the next one makes up for"),
        ("effort-dropouts", effort, row_numbers(joint.zeros), "of exactly zero between others that are not"),
        ("stuck-samples", effort, joint.stuck, "with a repeated value while the joint moves"),
        ("spikes", effort, joint.effort_spikes, "far from all of their neighbours"),
    ):
        if len(rows):
            yield code, f"{column}: {_counted(rows)} {words}, {begin(int(rows[0]))}; masked", BUS


def _counted(rows: Numbers) -> str:
    """A count of rows in words."""
    return "1 row" if len(rows) == 1 else f"{len(rows)} rows"
