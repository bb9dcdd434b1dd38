"""The check of a recording, as a worker process does it: a hostile file harms that process at most."""

from dataclasses import replace
from pathlib import Path

from tauscope.errors import RecordingError
from tauscope.recording import RecordingReport, check_recording
from tauscope.server.queue.messages import without_folders


def check_kept_recording(path: Path, joint_count: int | None) -> RecordingReport:
    """Report what a recording in the store holds.

    Parameters
    ----------
    joint_count : int or None
        joints that it must have; None where any number is welcome

    Raises
    ------
    RecordingError
        if it cannot be read or breaks a rule; the message calls the file by its name alone
    """
    try:
        report = check_recording(path, joint_count)
    except RecordingError as error:
        raise type(error)(without_folders(str(error), path.parent)) from None
    return replace(report, name=path.name)
