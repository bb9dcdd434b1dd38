"""The audit log of a data folder: written by the service and by the command line, entry after entry, to the disk."""

import fcntl
import logging
import os
import queue
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path
from typing import Any

from tauscope.errors import NotFoundError
from tauscope.files import sync_folder
from tauscope.server.auth.audit.chain import Verification, chained_line, parse_entry, verify_lines
from tauscope.server.auth.keys import utc_now

_log = logging.getLogger("tauscope.audit")

AUDIT_FILE = "audit.jsonl"
"""Name of the file, in the data folder."""

_TAIL = 2**20
"""Where the last entry is looked for; entries are far shorter [bytes]."""

MOST_WAITING = 10_000
"""Entries that wait for a disk that does not take them."""


class AuditLog:
    """Entries chained by their hashes. Several processes may append at the same time."""

    def __init__(self, folder: Path, clock: Callable[[], datetime] = utc_now) -> None:
        """Look at the log of a data folder; nothing is opened yet."""
        self.path = folder / AUDIT_FILE
        self._clock = clock

    def append(self, actor: str, action: str, **details: Any) -> None:
        """Add an entry; it is on the disk when this returns.

        Raises
        ------
        OSError
            if it cannot be written
        """
        self._append(self._content(actor, action, details))

    def verify(self, noted: str | None = None) -> Verification:
        """Check the whole log.

        Raises
        ------
        NotFoundError
            if there is no log
        """
        try:
            with self.path.open("rb") as file:
                return verify_lines(file, noted)
        except FileNotFoundError:
            raise NotFoundError(f"{self.path}: there is no audit log; name the service's data folder") from None

    def _content(self, actor: str, action: str, details: Mapping[str, Any]) -> dict[str, Any]:
        """What an entry says."""
        known = {name: value for name, value in details.items() if value is not None}
        return {"time": self._clock().isoformat(), "actor": actor, "action": action, **known}

    def _append(self, content: dict[str, Any]) -> None:
        """Chain an entry to the last one; a line that a crash cut off stays, and the next entry says so."""
        is_new = not self.path.exists()
        descriptor = os.open(self.path, os.O_RDWR | os.O_CREAT | os.O_APPEND | os.O_CLOEXEC, 0o600)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX)
            size = os.fstat(descriptor).st_size
            *whole, last = os.pread(descriptor, _TAIL, max(0, size - _TAIL)).split(b"\n")
            if last:
                content = {**content, "torn_bytes": len(last)}
            entries = (parse_entry(line) for line in reversed(whole))
            line = chained_line(next((entry for entry in entries if entry is not None), None), content) + b"\n"
            os.write(descriptor, b"\n" + line if last else line)
            os.fsync(descriptor)
        finally:
            fcntl.flock(descriptor, fcntl.LOCK_UN)  # closing does not where a process forked meanwhile holds it, too
            os.close(descriptor)
        if is_new:
            sync_folder(self.path.parent)


class AuditTrail:
    """The log as the service writes it: what must not wait for the disk is handed to a thread."""

    def __init__(self, log: AuditLog) -> None:
        """Begin with nothing to write."""
        self.log = log
        self._waiting: queue.Queue[tuple[str, str, dict[str, Any]] | None] = queue.Queue(MOST_WAITING)
        self.lost = 0

    def note(self, actor: str, action: str, **details: Any) -> None:
        """Hand an entry in; returns at once, whatever the disk does."""
        try:
            self._waiting.put_nowait((actor, action, details))
        except queue.Full:
            self.lost += 1

    @contextmanager
    def writing(self) -> Iterator[None]:
        """Write what is handed in, within the context; at its end everything was written, or said to be lost."""
        thread = threading.Thread(target=self._write, name="audit", daemon=True)
        thread.start()
        try:
            yield
        finally:
            self._waiting.put(None)
            thread.join()

    def _write(self) -> None:
        while (entry := self._waiting.get()) is not None:
            actor, action, details = entry
            try:
                self.log.append(actor, action, **details)
            except (OSError, ValueError):
                self.lost += 1
                _log.exception("an audit entry could not be written: %s by %s", action, actor)
