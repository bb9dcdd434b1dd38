"""One way from a file to a recording that can be trusted, for every verb."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from tauscope.errors import RecordingError
from tauscope.recording.columns import table_columns
from tauscope.recording.examination.mending import mend_recording
from tauscope.recording.examination.plausibility import find_implausible
from tauscope.recording.examination.sketch import BLOCK_ROWS, joint_types
from tauscope.recording.link_encoders import link_warnings
from tauscope.recording.reading import read_recording
from tauscope.recording.recording import EffortKind, Recording
from tauscope.recording.table import MemoryTable
from tauscope.recording.units import SI, Reading
from tauscope.result_warning import ResultWarning
from tauscope.robot.robot import Robot

TRUST = "go on with --trust-units"


def open_recording(path: str | Path, robot: Robot | None = None, reading: Reading = SI) -> Recording:
    """Read a recording, convert its units, and examine it.

    Raises RecordingError where the file cannot be read, a column can hardly be in its unit, or a joint has no effort.
    """
    reading = reading.for_robot(robot)
    joints = None if robot is None else [joint.name for joint in robot.joints]
    return examine_recording(read_recording(path, None, joints, reading), robot, trust_units=reading.trust_units)


def examine_recording(recording: Recording, robot: Robot | None = None, *, trust_units: bool = False) -> Recording:
    """Examine a recording, and mend its samples; an examined one is returned as it is.

    Raises RecordingError where a column can hardly be in its unit, or a joint has no effort.
    """
    if recording.is_examined:
        return recording
    missing = find_missing_effort(recording)
    if robot is not None and _has_commands(recording, robot) and (missing is not None or _is_zero(recording)):
        recording, missing = _take_commands(recording), None
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


def _has_commands(recording: Recording, robot: Robot) -> bool:
    """Whether loops of the robot can make torque of the commands."""
    loops = [joint.actuator for joint in robot.joints]
    named = all(f"qref{joint}" in recording.table.names for joint in range(1, recording.joint_count + 1))
    return named and all(loop is not None and loop.has_loop for loop in loops)


def _is_zero(recording: Recording) -> bool:
    """Whether the effort is exactly zero throughout, as position servos report what they do not measure."""
    blocks = (recording.samples(start, start + BLOCK_ROWS) for start in range(0, len(recording), BLOCK_ROWS))
    return not any(np.nan_to_num(block.effort).any() for block in blocks)


def _take_commands(recording: Recording) -> Recording:
    """The recording without its column of effort, which is NaN for a joint."""
    names, lost = recording.table.names, recording.effort_kind.value
    first = table_columns(recording.joint_count, EffortKind.COMMAND)
    kept = (*first, *(name for name in names if name not in first and name.rstrip("0123456789") != lost))
    rows = recording.table.rows(0, len(recording))[:, [names.index(name) for name in kept]]
    return replace(recording, effort_kind=EffortKind.COMMAND, table=MemoryTable(kept, rows))


def find_missing_effort(recording: Recording) -> str | None:
    """The columns of effort that are NaN throughout, and what to do; None where every joint has an effort."""
    n, kind = recording.joint_count, recording.effort_kind.value
    seen = np.zeros(n, dtype=bool)
    for start in range(0, len(recording), BLOCK_ROWS):
        seen |= np.isfinite(recording.samples(start, start + BLOCK_ROWS).effort).any(axis=0)
        if seen.all():
            return None
    many = not seen.any() and n > 1
    columns = f"columns {kind}1 to {kind}{n}" if many else f"column {kind}{np.argmin(seen) + 1}"
    return f"{columns}: NaN throughout: no effort was recorded; record torques or currents of every joint"
