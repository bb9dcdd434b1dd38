"""From the journal to the recording's files, once the arm has stopped."""

from importlib.util import find_spec
from pathlib import Path

from tauscope.errors import RecordingError
from tauscope.recording import write_recording
from tauscope.recording.journal_reading import journal_recording, read_journal
from tauscope.robot.messages import one_line
from tauscope.runtime.record import JOURNAL_FILE, RECORDING_STEM, RecordingFiles

UNKNOWN_LOSS = -1
"""Number of lost rows where the process that counted them is gone."""


def save_recording(folder: Path, *, is_whole: bool, lost_rows: int) -> RecordingFiles:
    """Write what a journal holds of the motion as CSV, and as Parquet where pyarrow is installed."""
    remarks: list[str] = []
    files: list[str] = []
    samples = 0
    try:
        journal = read_journal(folder / JOURNAL_FILE)
        if journal.damage is not None:
            remarks.append(f"{JOURNAL_FILE}: {journal.damage}; {len(journal.rows)} cycles came back")
        recording = journal_recording(journal, str(folder / JOURNAL_FILE))
        samples = len(recording)
        for suffix in (".csv", ".parquet") if find_spec("pyarrow") else (".csv",):
            name = RECORDING_STEM + suffix
            write_recording(recording, folder / name, overwrite=True)
            files.append(name)
    except RecordingError as error:
        remarks.append(str(error))
    except (OSError, MemoryError) as error:
        remarks.append(one_line(f"the recording's files cannot be made ({str(error) or 'out of memory'})"))
    if lost_rows > 0:
        remarks.append(f"{lost_rows} cycles were lost because the journal's disk was behind")
    partial = not is_whole or lost_rows != 0 or bool(remarks)
    return RecordingFiles(
        samples=samples, partial=partial, lost_rows=lost_rows, files=tuple(files), remarks=tuple(remarks)
    )
