"""One way from a file to a recording that can be trusted, for every verb."""

from dataclasses import replace
from pathlib import Path

from tauscope.recording.examination.mending import mend_recording
from tauscope.recording.examination.plausibility import require_plausible
from tauscope.recording.reading import read_recording
from tauscope.recording.recording import Recording
from tauscope.recording.units import Reading
from tauscope.robot.robot import Robot


def read_examined(path: str | Path, robot: Robot | None = None, reading: Reading = Reading()) -> Recording:
    """Read a recording, convert its units, and examine it.

    Raises
    ------
    RecordingError
        the file cannot be read, or a column can hardly be in its unit
    """
    reading = reading.for_robot(robot)
    joints = None if robot is None else [joint.name for joint in robot.joints]
    return examine_recording(read_recording(path, None, joints, reading), robot, trust_units=reading.trust_units)


def examine_recording(recording: Recording, robot: Robot | None = None, *, trust_units: bool = False) -> Recording:
    """Examine a recording; an examined one is returned as it is.

    Raises
    ------
    RecordingError
        a column can hardly be in its unit
    """
    if recording.is_examined:
        return recording
    if not trust_units:
        require_plausible(recording, robot)
    return replace(mend_recording(recording, robot), is_examined=True)
