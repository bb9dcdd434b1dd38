"""Where the cycles of a run go while it runs: a process that writes the journal, or this thread in virtual time."""

import fcntl
import json
import os
import select
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tauscope.errors import AcquisitionError, RecordingError, one_line
from tauscope.recording import write_recording
from tauscope.recording.journal import JournalWriter
from tauscope.recording.journal_process import FRAME, HEADER, ROW, event_frame, frame
from tauscope.recording.journal_reading import journal_recording, read_journal
from tauscope.recording.journal_rows import JournalHeader, journal_row_type
from tauscope.runtime.record import JOURNAL_FILE, RECORDING_STEM, RecordingFiles, child_environment
from tauscope.runtime.states import Stops, raise_if_requested

PIPE_BYTES = 2**20  # room between loop and writer: some seconds of cycles
OPENING_S = 20.0  # time that the writer may take to start
CLOSING_S = 5.0  # time that the writer may take to write what is left
_LARGEST_FRAME = select.PIPE_BUF
_ROWS_AT_ONCE = 32


class DirectRecorder:
    """Writes the journal itself: in virtual time nobody is late."""

    def __init__(self, path: Path, header: JournalHeader) -> None:
        """Open the journal. Raises AcquisitionError where the journal cannot be created."""
        self._path = path
        try:
            self._writer = JournalWriter(path, header)
        except OSError as error:
            raise _cannot_open(path, error.strerror) from error
        self._rows = np.empty(_ROWS_AT_ONCE, dtype=journal_row_type(header.joint_count))
        self._count = 0
        self.lost = 0  # rows that were not taken because the writer was behind

    def put(self, row: NDArray[np.void]) -> None:
        """Take a cycle, and never hold up the loop. `row`: (1,) of `journal_row_type`, the cycle; copied."""
        self._rows[self._count] = row[0]
        self._count += 1
        if self._count == len(self._rows):
            self._write()

    def event(self, time_ns: int, event: Mapping[str, Any]) -> None:
        self._write()
        self._writer.write_event(time_ns, event)

    def close(self) -> str | None:
        """Bring everything to the file; why that did not work, None where it did."""
        try:
            self._write()
            self._writer.close()
        except (AcquisitionError, OSError) as error:
            return f"the journal was not closed ({error})"
        return None

    def _write(self) -> None:
        rows, self._count = self._rows[: self._count], 0
        try:
            self._writer.write_rows(rows)
        except OSError as error:
            reason = error.strerror or error
            raise AcquisitionError(f"{self._path}: the journal cannot be written ({reason}); make room") from error


class RecorderProcess:
    """Hands the cycles to a process that outlives this one: what is in the pipe is still written."""

    def __init__(
        self, path: Path, header: JournalHeader, *, may_wait: bool = False, command: Sequence[str] | None = None
    ) -> None:
        """Start the process; `wait_until_open` says when the journal is there."""
        row_bytes = journal_row_type(header.joint_count).itemsize
        if row_bytes + FRAME.size > _LARGEST_FRAME:
            raise _cannot_open(path, f"a cycle of {header.joint_count} joints is larger than a pipe takes at once")
        self.lost = 0
        self._path = path
        program = list(command or (sys.executable, "-m", "tauscope.recording.journal_process", str(path)))
        self._process = subprocess.Popen(  # noqa: S603 - our own program
            program, stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=child_environment(), bufsize=0
        )
        assert self._process.stdin is not None  # noqa: S101 - asked for above
        assert self._process.stdout is not None  # noqa: S101
        self._input, self._output = self._process.stdin, self._process.stdout
        self._pipe, self._said = self._input.fileno(), self._output.fileno()
        # A user may have used up the room for pipes: then there is less, and what is lost is counted.
        with suppress(OSError):
            fcntl.fcntl(self._pipe, fcntl.F_SETPIPE_SZ, PIPE_BYTES)
        os.write(self._pipe, frame(HEADER, json.dumps(header.to_dict()).encode()))
        os.set_blocking(self._pipe, may_wait)
        self._buffer = bytearray(FRAME.pack(row_bytes, ROW) + bytes(row_bytes))
        self._row = np.frombuffer(self._buffer, np.uint8, row_bytes, FRAME.size)

    def wait_until_open(self, stops: Stops) -> None:
        """Wait until the journal is open. Raises AcquisitionError where the journal cannot be created."""
        deadline = time.monotonic() + OPENING_S
        poll = select.poll()
        poll.register(self._said, select.POLLIN | select.POLLHUP)
        while not poll.poll(20):
            raise_if_requested(stops)
            if time.monotonic() > deadline:
                raise _cannot_open(self._path, f"its writer did not start within {OPENING_S:g} s")
        answer = _last_answer(os.read(self._said, 4096))
        if not answer.get("open"):
            raise _cannot_open(self._path, str(answer.get("problem") or "its writer ended"))

    def put(self, row: NDArray[np.void]) -> None:
        """Take a cycle. `row`: (1,) of `journal_row_type`, the cycle; copied."""
        self._row[:] = row.view(np.uint8)
        self._send(self._buffer)

    def event(self, time_ns: int, event: Mapping[str, Any]) -> None:
        content = event_frame(time_ns, dict(event))
        if len(content) <= _LARGEST_FRAME:
            self._send(content)

    def close(self) -> str | None:
        """Close the pipe and wait for the writer; why something is missing, None where nothing is."""
        self._input.close()
        try:
            self._process.wait(CLOSING_S)
        except subprocess.TimeoutExpired:
            return f"the journal was not closed within {CLOSING_S:g} s: its disk does not take it"
        answer = _last_answer(self._output.read())
        self._output.close()
        return answer.get("problem", "the journal's writer ended before its time")

    def _send(self, content: bytes | bytearray) -> None:
        """Write a whole frame or nothing: the system does not split so few bytes."""
        try:
            os.write(self._pipe, content)
        except BlockingIOError:
            self.lost += 1
        except BrokenPipeError as error:
            raise AcquisitionError(
                f"{self._path}: the journal's writer has ended, nothing more is recorded; is the disk full?"
            ) from error


Recorder = DirectRecorder | RecorderProcess


def _last_answer(said: bytes) -> dict[str, Any]:
    lines = said.splitlines()
    return json.loads(lines[-1]) if lines else {}


def _cannot_open(path: Path, reason: str | None) -> AcquisitionError:
    return AcquisitionError(f"{path}: the journal cannot be created ({reason or 'unknown reason'}); nothing has moved")


UNKNOWN_LOSS = -1  # number of lost rows where the process that counted them is gone


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
