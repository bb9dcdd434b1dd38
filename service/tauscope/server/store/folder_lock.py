"""One service a data folder: two would each take the other's running work for abandoned."""

import fcntl
import os
from pathlib import Path

from tauscope.errors import TauscopeError

LOCK_NAME = ".lock"


class FolderLock:
    """Holds a folder for this process; the system lets go of it when the process ends, however it ends."""

    def __init__(self, folder: Path) -> None:
        """Take the folder.

        Raises
        ------
        TauscopeError
            if another process holds it
        """
        self._descriptor = os.open(folder / LOCK_NAME, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        try:
            fcntl.flock(self._descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            os.close(self._descriptor)
            hint = "stop it, or give this one another data folder"
            raise TauscopeError(f"{folder}: another tauscope service works with this folder; {hint}") from None

    def release(self) -> None:
        """Let go of the folder."""
        os.close(self._descriptor)
