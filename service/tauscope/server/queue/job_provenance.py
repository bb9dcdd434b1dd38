"""Where the result of a job comes from, as its report says it: names and hashes of the order, no path of the server."""

from collections.abc import Iterable, Sequence
from datetime import UTC, datetime
from pathlib import Path

from tauscope.report.provenance import InputFile, Provenance, input_files, versions
from tauscope.server.queue.identification_order import OrderedRecording


def job_provenance(
    command: Sequence[str],
    robot_folder: Path,
    recordings: Iterable[tuple[str, OrderedRecording, Path]],
) -> Provenance:
    """Name what a job was made from.

    Parameters
    ----------
    recordings : iterable of (str, OrderedRecording, Path)
        what each was read as, its entry in the order, and where it lies

    Raises
    ------
    RecordingError
        where a file cannot be read any more
    """
    robot = [
        InputFile("robot", Path(entry.path).name, entry.size_bytes, entry.sha256)
        for entry in input_files("robot", str(robot_folder))
    ]
    measured = [InputFile(role, entry.name, path.stat().st_size, entry.sha256) for role, entry, path in recordings]
    return Provenance(tuple(command), (*robot, *measured), versions(), datetime.now(UTC))
