"""What happened, line by line: appended by several processes, read by any number of followers, kept over restarts."""

import errno
import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tauscope.server.store.files import lock_file, parse_object

_TAIL = 2**16


@dataclass(frozen=True)
class LoggedEvent:
    """`number`: of the line, from 1."""

    number: int
    content: dict[str, Any]


class EventLog:
    """Lines of JSON, appended under a lock; one that a full disk cut off keeps its number and is passed over."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def append(self, content: Mapping[str, Any]) -> None:
        """Add a line; a crash may lose the last ones. Raises OSError if it cannot be written as a whole."""
        line = json.dumps(content, ensure_ascii=False, allow_nan=False).encode() + b"\n"
        with lock_file(self.path, os.O_APPEND, 0o640) as descriptor:
            size = os.fstat(descriptor).st_size
            is_torn = size > 0 and os.pread(descriptor, 1, size - 1) != b"\n"
            line = b"\n" + line if is_torn else line
            if os.write(descriptor, line) < len(line):
                raise OSError(errno.ENOSPC, "the disk took a part of a line only", str(self.path))

    def last(self) -> dict[str, Any] | None:
        """The content of the last whole line; None where there is none or it is damaged."""
        try:
            with self.path.open("rb") as file:
                size = file.seek(0, os.SEEK_END)
                file.seek(max(0, size - _TAIL))
                lines = file.read().split(b"\n")
        except OSError:
            return None
        return parse_object(lines[-2]) if len(lines) > 1 else None

    def follow(self, after: int = 0) -> "LogFollower":
        return LogFollower(self.path, after)


class LogFollower:
    """Reads a log from where it last ended; holds no file open between two readings."""

    def __init__(self, path: Path, after: int) -> None:
        self._path, self._after = path, after
        self._number = 0
        self._offset = 0

    def read(self) -> list[LoggedEvent]:
        try:
            with self._path.open("rb") as file:
                file.seek(self._offset)
                content = file.read()
        except FileNotFoundError:
            return []
        whole = content[: content.rfind(b"\n") + 1]
        self._offset += len(whole)
        events = []
        for line in whole.split(b"\n")[:-1]:
            self._number += 1
            parsed = parse_object(line) if self._number > self._after else None
            if parsed is not None:
                events.append(LoggedEvent(self._number, parsed))
        return events
