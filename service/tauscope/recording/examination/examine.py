"""One way from a file to a recording that can be trusted, for every verb."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from tauscope.errors import RecordingError
from tauscope.recording.examination.mending import mend_recording
from tauscope.recording.examination.plausibility import find_implausible
from tauscope.recording.examination.sketch import BLOCK_ROWS, joint_types
from tauscope.recording.link_encoders import link_warnings
from tauscope.recording.reading import read_recording
from tauscope.recording.recording import Recording
from tauscope.recording.units import SI, Reading
from tauscope.result_warning import ResultWarning
from tauscope.robot.robot import Robot

TRUST = "go on with --trust-units"


def open_recording(path: str | Path, robot: Robot | None = None, reading: Reading = SI) -> Recording:
    """Read a recording, convert its units, and examine it.

    Raises
    ------
    RecordingError
        the file cannot be read, a column can hardly be in its unit, or a joint has no effort
    """
    reading = reading.for_robot(robot)
    joints = None if robot is None else [joint.name for joint in robot.joints]
    return examine_recording(read_recording(path, None, joints, reading), robot, trust_units=reading.trust_units)


def examine_recording(recording: Recording, robot: Robot | None = None, *, trust_units: bool = False) -> Recording:
    """Examine a recording, and mend its samples; an examined one is returned as it is.

    Raises
    ------
    RecordingError
        a column can hardly be in its unit, or a joint has no effort
    """
    if recording.is_examined:
        return recording
    missing = find_missing_effort(recording)
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
