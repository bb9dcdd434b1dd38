"""One way from a file to a recording that can be trusted, for every verb."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np

from tauscope.errors import RecordingError
from tauscope.number_text import counted
from tauscope.recording.examination.edits import NO_NUMBERS, ColumnEdit, EditedTable
from tauscope.recording.examination.plausibility import find_implausible
from tauscope.recording.examination.scales import BLOCK_ROWS, joint_types
from tauscope.recording.examination.scan import Defects, JointDefects, find_defects
from tauscope.recording.link_encoders import link_warnings
from tauscope.recording.reading import read_recording
from tauscope.recording.recording import EffortKind, Recording, take_commands
from tauscope.recording.units import SI, Reading
from tauscope.result_warning import ResultWarning
from tauscope.robot.robot import Robot

FILLED_ROWS = 4  # rows without an effort that are filled in where positions and efforts come in rows of their own
BUS = "check the bus for lost reads and damaged frames"


def mend_recording(recording: Recording, robot: Robot | None = None) -> Recording:
    """Mask or repair the samples of a recording that were never measured, and say so in its notes."""
    names = [None] * recording.joint_count if robot is None else [joint.name for joint in robot.joints]
    defects = find_defects(recording, joint_types(recording, robot))
    edits = _build_edits(recording, defects)
    if not edits:
        return recording
    notes = (*recording.notes, *_describe_defects(recording, defects, names))
    return replace(recording, table=EditedTable(recording.table, edits), notes=notes)


def _build_edits(recording: Recording, defects: Defects) -> dict[int, ColumnEdit]:
    edits: dict[int, ColumnEdit] = {}
    n = recording.joint_count
    for joint, found in enumerate(defects.joints):
        # A row without one joint's position is left out as a whole.
        position = found.position_edit(len(recording), defects.bunched if joint == 0 else NO_NUMBERS)
        if len(position.blank) or len(position.jumps):
            edits[1 + joint] = position
        if recording.effort_kind is EffortKind.COMMAND:  # targets may rest, jump and repeat
            continue
        hold = found.effort_hold if found.effort_hold > 1 else 0
        effort = ColumnEdit(found.lost_efforts, hold=hold, fill=FILLED_ROWS if defects.alternate else 0)
        if len(effort.blank) or effort.hold or effort.fill:
            edits[1 + n + joint] = effort
    return edits


def _describe_defects(recording: Recording, defects: Defects, joints: Sequence[str | None]) -> Iterator[ResultWarning]:

    def begin(row: int) -> str:
        return f"first at t = {recording.samples(row, row + 1).time[0]:.6g} s"

    if len(defects.bunched):
        text = f"column t: {counted(len(defects.bunched), 'row')} that waited for a later one"
        remedy = "stamp samples when they are measured, not when a buffer is emptied"
        yield ResultWarning(
            code="time-stamps", text=f"{text}, {begin(int(defects.bunched[0]))}; left out", remedy=remedy
        )
    if defects.alternate and recording.effort_kind is not EffortKind.COMMAND:
        text = "positions and efforts stand in rows of their own; efforts are interpolated to the rows of the positions"
        yield ResultWarning(code="held-samples", text=text, remedy="record both at the same instants")
    kind = recording.effort_kind.value
    alike: dict[tuple[str, str, str | None], list[int]] = {}
    for number, joint in enumerate(defects.joints, 1):
        for column, code, text, remedy in _describe_joint(joint, begin):
            if column == "effort" and recording.effort_kind is EffortKind.COMMAND:
                continue
            alike.setdefault((code, f"{column}: {text}", remedy), []).append(number)
    for (code, text, remedy), numbers in alike.items():
        group, _, words = text.partition(": ")
        columns = [f"{kind if group == 'effort' else 'q'}{number}" for number in numbers]
        many = "column" if len(columns) == 1 else "columns"
        joint = joints[numbers[0] - 1] if len(numbers) == 1 else None
        yield ResultWarning(code=code, joint=joint, text=f"{many} {', '.join(columns)}: {words}", remedy=remedy)


def _describe_joint(
    joint: JointDefects, begin: Callable[[int], str]
) -> Iterator[tuple[Literal["q", "effort"], str, str, str | None]]:
    if joint.wraps:
        first, times = min(joint.wraps)[0], "once" if len(joint.wraps) == 1 else f"{len(joint.wraps)} times"
        yield "q", "wrapped-angle", f"wraps by 2π {times}, {begin(first)}; unwrapped", None
    if joint.jumps:
        jumps = sorted(joint.jumps)
        heights = ", ".join(f"{step:.4g}" for _, step in jumps[:3]) + (", …" if len(jumps) > 3 else "")
        text = f"jumps by {heights}, {begin(jumps[0][0])}; taken out, the longest piece is kept as it is"
        yield "q", "encoder-reset", text, "home the encoder before the recording, and not within it"
    slow = "record at the rate of the controller"
    if len(repeated := joint.rows["repeated"]):
        text = f"each value is held for about {joint.hold} rows; {counted(len(repeated), 'row')} masked"
        yield "q", "held-samples", text, slow
    if joint.effort_hold > 1:
        text = f"each value is held for about {joint.effort_hold} rows; interpolated from change to change"
        yield "effort", "held-samples", text, slow
    masked: tuple[tuple[Literal["q", "effort"], str, str, str], ...] = (
        ("q", "spikes", "spikes", "away from the neighbours by a jump and back"),
        ("q", "stuck-samples", "frozen", "with a repeated value that the next one makes up for"),
        ("effort", "effort-dropouts", "zeros", "of exactly zero between others that are not"),
        ("effort", "stuck-samples", "stuck", "with a repeated value while the arm moves"),
        ("effort", "spikes", "effort_spikes", "far from all of their neighbours"),
    )
    for column, code, kind, words in masked:
        if len(rows := joint.rows[kind]):
            yield column, code, f"{counted(len(rows), 'row')} {words}, {begin(int(rows[0]))}; masked", BUS


TRUST = "go on with --trust-units"


def open_recording(path: str | Path, robot: Robot | None = None, reading: Reading = SI) -> Recording:
    """Read and examine a recording. Raises RecordingError where it cannot be read, or as `examine_recording`."""
    reading = reading.for_robot(robot)
    joints = None if robot is None else [joint.name for joint in robot.joints]
    return examine_recording(read_recording(path, None, joints, reading), robot, trust_units=reading.trust_units)


def examine_recording(recording: Recording, robot: Robot | None = None, *, trust_units: bool = False) -> Recording:
    """Mend samples, once. Raises RecordingError where a unit is implausible, or a joint has no effort."""
    if recording.is_examined:
        return recording
    missing = find_missing_effort(recording)
    if robot is not None and all(joint.actuator is not None and joint.actuator.has_loop for joint in robot.joints):
        commanded = None if missing is None else take_commands(recording)
        if commanded is not None:
            recording, missing = commanded, None
    if missing is not None:
        raise RecordingError(f"{recording.name}: {missing}")
    doubt = find_implausible(recording, robot)
    if doubt is not None:
        if not trust_units:
            raise RecordingError(f"{recording.name}: {doubt}, or {TRUST}")
        text, _, remedy = doubt.rpartition("; ")
        note = ResultWarning(code="doubtful-units", text=text, remedy=remedy)
        recording = replace(recording, notes=(*recording.notes, note))
    mended = mend_recording(recording, robot)
    names = [None] * recording.joint_count if robot is None else [joint.name for joint in robot.joints]
    links = link_warnings(mended, joint_types(mended, robot), names)
    return replace(mended, notes=(*mended.notes, *links), is_examined=True)


def find_missing_effort(recording: Recording) -> str | None:
    """Columns of effort that are NaN, or as of position servos zero, throughout, and what to do."""
    n, kind = recording.joint_count, recording.effort_kind.value
    seen, is_zero = np.zeros(n, dtype=bool), recording.effort_kind is not EffortKind.COMMAND
    for start in range(0, len(recording), BLOCK_ROWS):
        effort = recording.samples(start, start + BLOCK_ROWS).effort
        seen |= np.isfinite(effort).any(axis=0)
        is_zero = is_zero and not np.nan_to_num(effort).any()
        if seen.all() and not is_zero:
            return None
    many, value = seen.all() == seen.any() and n > 1, "zero" if seen.all() else "NaN"
    columns = f"columns {kind}1 to {kind}{n}" if many else f"column {kind}{np.argmin(seen) + 1}"
    return f"{columns}: {value} throughout: no effort was recorded; record torques or currents of every joint"
