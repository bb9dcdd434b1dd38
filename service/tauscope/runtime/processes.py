"""Processes of our own: their environment, their identity, and the lock on the folder of their run."""

import fcntl
import os
import time
from pathlib import Path

from tauscope.errors import AcquisitionError

_THREAD_SETTINGS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def child_environment() -> dict[str, str]:
    """Environment of a child process: it imports the modules that this process has, and computes in one thread."""
    source = str(Path(__file__).resolve().parents[2])
    known = os.environ.get("PYTHONPATH")
    threads = dict.fromkeys(_THREAD_SETTINGS, "1")
    return {**os.environ, **threads, "PYTHONPATH": f"{source}{os.pathsep}{known}" if known else source}


def read_process_start(pid: int) -> int | None:
    """When a process was started, in the kernel's ticks; None where there is no such process."""
    try:
        status = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return None
    # The name before it stands in parentheses and may hold anything.
    fields = status.rpartition(")")[2].split()
    return None if fields[0] in "ZX" else int(fields[19])


LOCK_FILE = ".lock"
_POLL_S = 0.02


class RunLock:
    def __init__(self, folder: Path) -> None:
        """Take the folder. Raises AcquisitionError where another process holds it."""
        self._descriptor = os.open(folder / LOCK_FILE, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        try:
            fcntl.flock(self._descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            os.close(self._descriptor)
            raise AcquisitionError(f"{folder}: another process carries this run out; wait for it or stop it") from None

    def release(self) -> None:
        os.close(self._descriptor)


def wait_for_lock(folder: Path, patience_s: float) -> RunLock | None:
    """Take a folder as soon as nobody holds it; None where it is still held after `patience_s` [s]."""
    deadline = time.monotonic() + patience_s
    while True:
        try:
            return RunLock(folder)
        except AcquisitionError:
            if time.monotonic() >= deadline:
                return None
            time.sleep(_POLL_S)
