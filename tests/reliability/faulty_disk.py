"""A disk that fails, or on which the process dies, at a counted step: any call that changes a file below a folder."""

import errno
import os
import signal
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

_AUDITED = {"os.mkdir", "os.rename", "os.link"}
_WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT


def full() -> None:
    """What a write to a full disk ends in."""
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def die() -> None:
    """The process is killed in the middle of whatever it does."""
    os.kill(os.getpid(), signal.SIGKILL)


class FaultyDisk:
    """Counts the steps of this process: opening for writing, making folders, renaming, linking, writing, syncing.

    SQLite writes below Python; a database fills up by a bound on its pages, see `reliability.service_life`.
    """

    def __init__(self, root: Path) -> None:
        self._root = str(root)
        self._lock = threading.Lock()
        self._fault: Callable[[], None] | None = None
        self._before = 0
        self._lasts = False
        self.has_struck = False

    def install(self) -> None:
        """Watch this process from now on; for processes of their own only, since nothing takes it back."""
        sys.addaudithook(self._audited)
        os.fsync = self._watched(os.fsync)
        os.write = self._watched_write(os.write)

    def arm(self, fault: Callable[[], None], before: int, *, lasts: bool) -> None:
        """Let so many steps be good; the next one is not, nor are those behind it where the fault lasts."""
        with self._lock:
            self._fault, self._before, self._lasts, self.has_struck = fault, before, lasts, False

    def disarm(self) -> None:
        """All steps are good again."""
        with self._lock:
            self._fault = None

    @property
    def is_full(self) -> bool:
        """Whether nothing can be written any more."""
        return self._fault is full and self._lasts and self.has_struck

    def _step(self) -> Callable[[], None] | None:
        """The fault of this step, if it has one."""
        with self._lock:
            fault = self._fault
            if fault is None:
                return None
            if self._before > 0:
                self._before -= 1
                return None
            self.has_struck = True
            if not self._lasts:
                self._fault = None
            return fault

    def _audited(self, event: str, arguments: tuple[Any, ...]) -> None:
        """Called by the interpreter before it does what the event names; what is raised here is raised there."""
        if self._fault is None:
            return
        if event == "open":
            if isinstance(arguments[0], int) or not arguments[2] & _WRITING:
                return
        elif event not in _AUDITED:
            return
        path = arguments[0]
        if (os.fsdecode(path) if isinstance(path, bytes) else str(path)).startswith(self._root):
            fault = self._step()
            if fault is not None:
                fault()

    def _is_watched(self, descriptor: int) -> bool:
        return self._fault is not None and os.readlink(f"/proc/self/fd/{descriptor}").startswith(self._root)

    def _watched(self, call: Callable[[int], None]) -> Callable[[int], None]:
        def watched(descriptor: int) -> None:
            if self._is_watched(descriptor) and (fault := self._step()) is not None:
                fault()
            call(descriptor)

        return watched

    def _watched_write(self, write: Callable[..., int]) -> Callable[..., int]:
        """A write that the fault meets puts half of its bytes on the disk, as a disk that fills up does."""

        def watched(descriptor: int, data: bytes) -> int:
            if not self._is_watched(descriptor) or (fault := self._step()) is None:
                return write(descriptor, data)
            half = write(descriptor, data[: len(data) // 2]) if len(data) > 1 else 0
            if fault is full and half > 0:
                return half
            fault()
            return half

        return watched
