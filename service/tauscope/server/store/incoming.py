"""A file that is still arriving: written and hashed piece by piece, so that its size does not matter to the memory."""

import hashlib
import os
import tempfile
from dataclasses import dataclass
from pathlib import Path

from tauscope.errors import LimitExceededError

_PIECE = 2**20


@dataclass(frozen=True)
class KeptFile:
    """A file that arrived as a whole.

    sha256 : str
        of its bytes, in hexadecimal
    """

    path: Path
    name: str
    size: int
    sha256: str


class IncomingFile:
    """A file that is being written under a hidden name, until `finish` or `discard`."""

    def __init__(self, folder: Path, name: str, limit: int) -> None:
        """Begin an empty file.

        Parameters
        ----------
        limit : int
            largest size that is accepted [bytes]
        """
        descriptor, path = tempfile.mkstemp(dir=folder, prefix=".incoming-")
        self._file = os.fdopen(descriptor, "wb")
        self._hash = hashlib.sha256()
        self.path = Path(path)
        self.name = name
        self.limit = limit
        self.size = 0

    def write(self, piece: bytes) -> None:
        """Append some bytes.

        Raises
        ------
        LimitExceededError
            if the file grows beyond its limit; nothing more is written then
        """
        self.size += len(piece)
        if self.size > self.limit:
            raise LimitExceededError(f"{self.name}: is larger than the {self.limit} bytes accepted here; send less")
        self._hash.update(piece)
        self._file.write(piece)

    def finish(self) -> KeptFile:
        """Bring the bytes to the disk and close the file; it keeps its hidden name."""
        self._file.flush()
        os.fsync(self._file.fileno())
        self._file.close()
        return KeptFile(self.path, self.name, self.size, self._hash.hexdigest())

    def discard(self) -> None:
        """Close and remove the file; may be called twice."""
        self._file.close()
        self.path.unlink(missing_ok=True)


def hash_file(path: Path) -> str:
    """The sha256 of a file's bytes, in hexadecimal."""
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while piece := file.read(_PIECE):
            digest.update(piece)
    return digest.hexdigest()
