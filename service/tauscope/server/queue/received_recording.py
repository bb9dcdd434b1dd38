"""Recordings and trajectories that strangers sent, as a reading process reads them: named by their file names alone."""

import json
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tauscope.errors import RecordingError
from tauscope.recording import ColumnMapping, Reading, RecordingReport, check_recording, find_mapping, read_recording
from tauscope.recording.recording import Array
from tauscope.robot import Robot, read_robot
from tauscope.server.queue.job_folder import hide_folders, without_folders
from tauscope.trajectory import read_trajectory


def check_trajectory(folder: Path, robot_file: Path) -> None:
    """Read a trajectory as a worker does. Raises ExcitationError if it is not valid, or not for this arm."""
    (path,) = folder.iterdir()
    with hide_folders(folder, robot_file.parent):
        read_trajectory(path, read_robot(robot_file))


def check_kept_recording(path: Path, joint_count: int | None) -> RecordingReport:
    """Report on a recording. Raises RecordingError, whose message calls the file by its name alone."""
    with hide_folders(path.parent):
        return replace(check_recording(path, joint_count), name=path.name)


@dataclass(frozen=True)
class Understanding:
    """`mapping`: None for a log, which names its joints; `problem`: why the file is refused, without `report`."""

    mapping: ColumnMapping | None
    report: RecordingReport | None
    problem: str | None


def understand_recording(path: Path, robot: Robot | None, reading: Reading) -> Understanding:
    """Find columns and units, guessed ones too, and report what a file holds when it is read so."""
    mapping = None
    with suppress(RecordingError):  # a log, or a file that the check refuses, too
        mapping = find_mapping(path, robot, reading)
    if mapping is not None and mapping.is_guessed and reading.columns is None:
        reading = replace(reading, columns=mapping.columns, units={**mapping.units, **reading.units})
    try:
        report = check_recording(path, None, robot, reading)
    except RecordingError as error:
        return Understanding(mapping, None, without_folders(str(error), path.parent))
    return Understanding(mapping, replace(report, name=path.name), None)


def read_kept_samples(path: Path, most: int) -> bytes:
    """Samples of a plot, thinned to extremes: header length (4 bytes), JSON header, columns of 32-bit floats."""
    with hide_folders(path.parent):
        recording = read_recording(path)
    samples = recording.samples()
    effort = recording.effort_kind.value
    values = np.hstack([samples.position, samples.effort])
    kept = _choose_rows(values, most)
    joints = range(1, recording.joint_count + 1)
    header = {
        "columns": ["t", *(f"q{j}" for j in joints), *(f"{effort}{j}" for j in joints)],
        "joint_count": recording.joint_count,
        "effort": effort,
        "samples": len(samples.time),
        "shown": len(kept),
    }
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 4)
    columns = np.vstack([samples.time[kept] - samples.time[0], values[kept].T]).astype("<f4")
    return len(text).to_bytes(4, "little") + text + columns.tobytes()


def _choose_rows(values: Array, most: int) -> NDArray[np.intp]:
    from tauscope.report.series import envelope_indices  # loads all of an identification, for plots only

    if len(values) <= most:
        return np.arange(len(values))
    share = max(most // values.shape[1], 2)
    return np.unique(np.concatenate([envelope_indices(column, share) for column in values.T]))
