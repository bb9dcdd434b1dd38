"""The audit log: a file that only grows, each line chained to the one before by its hash.

No line is changed, moved or left out unseen. A chain alone cannot show that its end was cut off, or that all of it was
written anew: note the head now and then out of the machine owner's reach, and `verify` looks for that entry.
"""

import hashlib
import json
import logging
import os
import queue
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from tauscope.errors import NotFoundError
from tauscope.files import sync_folder
from tauscope.server.store.data_folder import utc_now
from tauscope.server.store.files import lock_file, parse_object

GENESIS = "0" * 64  # what the first line names as the hash before


def chain_line(previous: Mapping[str, Any] | None, content: Mapping[str, Any]) -> bytes:
    """The line that follows another one. `previous`: the entry before; None for the first."""
    entry = {
        "number": 1 if previous is None else previous["number"] + 1,
        **content,
        "previous": GENESIS if previous is None else previous["hash"],
    }
    return _canonical({**entry, "hash": _digest(entry)})


@dataclass(frozen=True)
class Verification:
    """`head`: hash of the last entry, None without one; `fault`: the first thing that is wrong, None without one."""

    entries: int
    head: str | None
    fault: str | None


def verify_lines(lines: Iterable[bytes], noted: str | None = None) -> Verification:
    count, head, is_noted_there = 0, GENESIS, noted is None
    torn: bytes | None = None
    for place, line in enumerate(lines, start=1):
        entry = parse_entry(line)
        if entry is None and torn is None and not is_line_of_ours(line):
            torn = line.rstrip(b"\n")
            continue
        fault = _fault(entry, count + 1, head, torn)
        if entry is None or fault is not None:
            return Verification(count, head if count else None, f"line {place}: {fault or 'is damaged'}")
        count, head, torn = count + 1, entry["hash"], None
        is_noted_there = is_noted_there or head == noted
    head_or_none = head if count else None
    if torn is not None:
        return Verification(count, head_or_none, "the last line is cut off: a crash, or somebody's hand")
    fault = None if is_noted_there else f"no entry has the hash {noted}: the log was cut or written anew"
    return Verification(count, head_or_none, fault)


def parse_entry(line: bytes) -> dict[str, Any] | None:
    """The entry of a whole line; None where it is none."""
    entry = parse_object(line) or {}
    return entry if isinstance(entry.get("number"), int) and isinstance(entry.get("hash"), str) else None


def is_line_of_ours(line: bytes) -> bool:
    """Whether a line is whole JSON, so that no crash can have cut it off."""
    try:
        json.loads(line)
    except (ValueError, RecursionError):
        return False
    return True


def _fault(entry: dict[str, Any] | None, number: int, previous: str, torn: bytes | None) -> str | None:
    if entry is None:
        return "is damaged"
    rest = {name: value for name, value in entry.items() if name != "hash"}
    if _digest(rest) != entry["hash"]:
        return "was changed: its hash is another one"
    if entry["number"] != number or entry.get("previous") != previous:
        return f"does not follow the line before: entry {number} is missing or was moved"
    if torn is not None and entry.get("torn_bytes") != len(torn):
        return "the line before is damaged, and no crash explains it"
    return None


def _digest(entry: Mapping[str, Any]) -> str:
    return hashlib.sha256(_canonical(entry)).hexdigest()


def _canonical(entry: Mapping[str, Any]) -> bytes:
    return json.dumps(entry, sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False).encode()


_log = logging.getLogger("tauscope.audit")
AUDIT_FILE = "audit.jsonl"  # name of the file, in the data folder
_TAIL = 2**20  # where the last entry is looked for; entries are far shorter [bytes]
MOST_WAITING = 10_000  # entries that wait for a disk that does not take them


class AuditLog:
    """Entries chained by their hashes. Several processes may append at the same time."""

    def __init__(self, folder: Path, clock: Callable[[], datetime] = utc_now) -> None:
        self.path = folder / AUDIT_FILE
        self._clock = clock

    def append(self, actor: str, action: str, **details: Any) -> None:
        """Chain an entry to the last one; it is on the disk when this returns. Raises OSError if that cannot be.

        A line that a crash cut off stays, and the next entry says so.
        """
        known = {name: value for name, value in details.items() if value is not None}
        content = {"time": self._clock().isoformat(), "actor": actor, "action": action, **known}
        is_new = not self.path.exists()
        with lock_file(self.path, os.O_APPEND) as descriptor:
            size = os.fstat(descriptor).st_size
            *whole, last = os.pread(descriptor, _TAIL, max(0, size - _TAIL)).split(b"\n")
            if last:
                content["torn_bytes"] = len(last)
            entries = (parse_entry(line) for line in reversed(whole))
            line = chain_line(next((entry for entry in entries if entry is not None), None), content) + b"\n"
            os.write(descriptor, b"\n" + line if last else line)
            os.fsync(descriptor)
        if is_new:
            sync_folder(self.path.parent)

    def verify(self, noted: str | None = None) -> Verification:
        """Check the whole log. Raises NotFoundError if there is no log."""
        try:
            with self.path.open("rb") as file:
                return verify_lines(file, noted)
        except FileNotFoundError:
            raise NotFoundError(f"{self.path}: there is no audit log; name the service's data folder") from None


class AuditTrail:
    """The log as the service writes it: what must not wait for the disk is handed to a thread."""

    def __init__(self, log: AuditLog) -> None:
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
