"""Where a recording's numbers are kept: in memory, or in an unnamed temporary file when they are many."""

import os
import tempfile
import weakref
from contextlib import AbstractContextManager

import numpy as np

from tauscope.errors import RecordingError, explain_os_errors
from tauscope.recording.samples import Array, Table

# Tables larger than this go to a temporary file: 1.3 million samples of a six-joint arm still fit into memory.
SPOOL_ABOVE_BYTES = 128 * 2**20
_FIRST_ROWS = 4096


class MemoryTable:
    """Rows in memory."""

    def __init__(self, names: tuple[str, ...], data: Array) -> None:
        """Keep `data` as it is, without a copy. `data`: (N, columns), the rows; made read-only."""
        self.names = names
        self._data = data
        self._data.flags.writeable = False

    def __len__(self) -> int:
        return len(self._data)

    def rows(self, start: int, stop: int) -> Array:
        """Rows start:stop, a read-only view of shape (stop-start, columns)."""
        return self._data[start:stop]


class SpooledTable:
    """Rows in an unnamed temporary file (TMPDIR), read by `preadv`: mapped pages count as memory of the process."""

    def __init__(self, names: tuple[str, ...]) -> None:
        self.names = names
        self._row_bytes = 8 * len(names)
        self._length = 0
        self._file = tempfile.TemporaryFile(prefix="tauscope-")  # noqa: SIM115 — lives as long as the table
        weakref.finalize(self, self._file.close)

    def __len__(self) -> int:
        return self._length

    def append(self, block: Array) -> None:
        """Write rows behind the last one. `block`: (rows, columns), the rows."""
        self._file.write(np.ascontiguousarray(block).data)
        self._file.flush()
        self._length += len(block)

    def rows(self, start: int, stop: int) -> Array:
        """Rows start:stop, a read-only copy of shape (stop-start, columns)."""
        start, stop, _ = slice(start, stop).indices(self._length)
        block = np.empty((max(stop - start, 0), len(self.names)))
        target = block.reshape(-1).view(np.uint8).data
        done = 0
        while done < len(target):
            read = os.preadv(self._file.fileno(), [target[done:]], start * self._row_bytes + done)
            if read == 0:
                raise RecordingError("the temporary copy of the recording was cut short: is the disk full or failing?")
            done += read
        block.flags.writeable = False
        return block


class TableBuilder:
    """Takes rows block by block and moves them to a temporary file once they grow past a limit."""

    def __init__(
        self, names: tuple[str, ...], expected_rows: int = 0, spool_above_bytes: int = SPOOL_ABOVE_BYTES
    ) -> None:
        """Prepare an empty table; larger ones than `spool_above_bytes` go to a temporary file."""
        self._names = names
        self._limit_rows = spool_above_bytes // (8 * len(names))
        self._length = 0
        self._spool: SpooledTable | None = None
        # Memory that is never written to is never given to the process: a generous guess costs nothing.
        self._data = np.empty((min(max(expected_rows, _FIRST_ROWS), self._limit_rows), len(names)))
        if expected_rows > self._limit_rows:
            self._start_spool()

    def __len__(self) -> int:
        return self._length

    def append(self, block: Array) -> None:
        """Add a copy of `block`, (rows, columns). Raises RecordingError where the temporary folder is full."""
        length = self._length + len(block)
        if self._spool is None and length > self._limit_rows:
            self._start_spool()
        if self._spool is not None:
            with _naming_room():
                self._spool.append(block)
        else:
            if length > len(self._data):  # by half as much again, so that growing stays linear in total
                grown = np.empty((min(max(length, len(self._data) * 3 // 2), self._limit_rows), len(self._names)))
                grown[: self._length] = self._data[: self._length]
                self._data = grown
            self._data[self._length : length] = block
        self._length = length

    def finish(self) -> Table:
        """The table; nothing may be appended afterwards."""
        if self._spool is not None:
            return self._spool
        return MemoryTable(self._names, self._data[: self._length])

    def _start_spool(self) -> None:
        with _naming_room():
            self._spool = SpooledTable(self._names)
            self._spool.append(self._data[: self._length])
        self._data = np.empty((0, len(self._names)))


def _naming_room() -> AbstractContextManager[None]:
    """Say in which folder there is no room. Raises RecordingError."""
    words = f"the temporary folder {tempfile.gettempdir()} cannot hold the recording"
    return explain_os_errors(RecordingError, words, ": make room there or set TMPDIR to a larger folder")
