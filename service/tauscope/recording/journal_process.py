"""A process that writes a journal: rows come by a pipe, so that neither the disk nor this process holds up a loop.

``python -m tauscope.recording.journal_process PATH`` reads frames from standard input: length (uint32), kind (one
byte), content. The first frame holds the header. When the pipe ends, because the sender closed it or died, the journal
is closed properly. One JSON line on standard output says that the journal is open, one at the end how it went.
"""

import fcntl
import json
import os
import signal
import struct
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

from tauscope.recording.journal import JournalWriter
from tauscope.recording.journal_rows import JournalHeader, journal_row_type

HEADER, ROW, EVENT = b"h", b"r", b"e"  # kinds of frame
FRAME = struct.Struct("<Ic")
EVENT_TIME = struct.Struct("<q")

_READ_BYTES = 2**18


def frame(kind: bytes, content: bytes) -> bytes:
    """One frame."""
    return FRAME.pack(len(content), kind) + content


def event_frame(time_ns: int, event: dict[str, Any]) -> bytes:
    """The frame of an event. `time_ns`: when, by the clock of the rows [ns]."""
    return frame(EVENT, EVENT_TIME.pack(time_ns) + json.dumps(event).encode())


class FrameWriter:
    """Turns the bytes of a pipe into a journal."""

    def __init__(self, path: Path) -> None:
        """Prepare for the first bytes; the journal is created when its header is there."""
        self.writer: JournalWriter | None = None
        self._path = path
        self._pending = b""

    def feed(self, data: bytes) -> None:
        """Take the next bytes. Raises OSError where the disk does not take them."""
        data, at, rows = self._pending + data, 0, []
        while len(data) - at >= FRAME.size:
            length, kind = FRAME.unpack_from(data, at)
            start, stop = at + FRAME.size, at + FRAME.size + length
            if stop > len(data):
                break
            at = stop
            if kind == ROW:
                rows.append(data[start:stop])
                continue
            self._write(rows)
            rows = []
            if kind == HEADER:
                header = JournalHeader.from_dict(json.loads(data[start:stop]))
                self.writer = JournalWriter(self._path, header, synchronise=True)
            elif self.writer is not None:
                (time_ns,) = EVENT_TIME.unpack_from(data, start)
                self.writer.write_event(time_ns, json.loads(data[start + EVENT_TIME.size : stop]))
        self._write(rows)
        self._pending = data[at:]

    def close(self) -> int:
        """Close the journal; the number of rows in it."""
        if self.writer is None:
            return 0
        self.writer.close()
        return self.writer.rows

    def _write(self, rows: list[bytes]) -> None:
        if rows and self.writer is not None:
            row_type = journal_row_type(self.writer.header.joint_count)
            self.writer.write_rows(np.frombuffer(b"".join(rows), dtype=row_type))


def main(path: str) -> int:
    """Write a journal from standard input until it ends."""
    # Whoever interrupts the run shall not lose its recording: this process ends when the pipe does.
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    frames = FrameWriter(Path(path))
    is_open = False
    try:
        while data := os.read(sys.stdin.fileno(), _READ_BYTES):
            frames.feed(data)
            if frames.writer is not None and not is_open:
                is_open = True
                _say({"open": True})
        _say({"rows": frames.close(), "problem": None})
    except OSError as error:
        rows = 0 if frames.writer is None else frames.writer.rows
        _say({"rows": rows, "problem": f"{path}: the journal cannot be written ({error.strerror or error})"})
        return 1
    return 0


def wait_for_writer(path: Path, patience_s: float) -> bool:
    """Wait until nobody writes a journal any more. `patience_s`: how long to wait [s]."""
    deadline = time.monotonic() + patience_s
    with path.open("rb") as file:
        while True:
            try:
                fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
            except OSError:
                if time.monotonic() >= deadline:
                    return False
                time.sleep(0.02)
            else:
                return True


def _say(line: dict[str, Any]) -> None:
    try:
        os.write(sys.stdout.fileno(), json.dumps(line).encode() + b"\n")
    except OSError:
        return


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
