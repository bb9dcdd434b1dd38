"""Keeps a run's record on the disk from a thread of its own: a disk that is stuck must not hold up the loop."""

import threading
from pathlib import Path

from tauscope.runtime.record import RunRecord, write_record

FLUSH_S = 5.0
"""Time that the disk may take for the last record."""


class RecordKeeper:
    """Writes the newest record; records that are overtaken while the disk is busy are left out."""

    def __init__(self, folder: Path) -> None:
        """Start the thread."""
        self._folder = folder
        self._newest: RunRecord | None = None
        self._problem: str | None = None
        self._is_closed = False
        self._changed = threading.Condition()
        # A daemon: a thread that the disk holds up must not hold up the end of the process.
        self._thread = threading.Thread(target=self._work, name="run-record", daemon=True)
        self._thread.start()

    def keep(self, record: RunRecord) -> None:
        """Have a record written; returns at once."""
        with self._changed:
            self._newest = record
            self._changed.notify_all()

    def close(self, patience_s: float = FLUSH_S) -> str | None:
        """Wait for the last record to reach the disk.

        Parameters
        ----------
        patience_s : float
            how long [s]

        Returns
        -------
        str or None
            why it did not, None where it did
        """
        with self._changed:
            self._is_closed = True
            self._changed.notify_all()
        self._thread.join(patience_s)
        if self._thread.is_alive():
            return (
                f"{self._folder}: the run's record was not written within {patience_s:g} s: the disk does not take it"
            )
        return self._problem

    def _work(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._newest is not None or self._is_closed)
                record, self._newest = self._newest, None
            if record is None:
                return
            try:
                write_record(self._folder, record)
                self._problem = None
            except OSError as error:
                self._problem = f"{self._folder}: the run's record cannot be written ({error.strerror or error})"
