"""Who moves the arm holds its run's folder; the system lets go of it when that process ends, however it ends."""

import fcntl
import os
import time
from pathlib import Path

from tauscope.errors import AcquisitionError

LOCK_FILE = ".lock"

_POLL_S = 0.02


class RunLock:
    """Holds a run's folder for this process."""

    def __init__(self, folder: Path) -> None:
        """Take the folder.

        Raises
        ------
        AcquisitionError
            another process holds it
        """
        self._descriptor = os.open(folder / LOCK_FILE, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        try:
            fcntl.flock(self._descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            os.close(self._descriptor)
            raise AcquisitionError(f"{folder}: another process carries this run out; wait for it or stop it") from None

    def release(self) -> None:
        """Let go of the folder."""
        os.close(self._descriptor)


def wait_until_free(folder: Path, patience_s: float) -> RunLock | None:
    """Take a folder as soon as nobody holds it.

    Parameters
    ----------
    patience_s : float
        how long to wait [s]

    Returns
    -------
    RunLock or None
        None where it is still held
    """
    deadline = time.monotonic() + patience_s
    while True:
        try:
            return RunLock(folder)
        except AcquisitionError:
            if time.monotonic() >= deadline:
                return None
            time.sleep(_POLL_S)
