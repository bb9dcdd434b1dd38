"""Recordings on the server: regular files in one folder, known by name, never overwritten."""

import json
import os
import shutil
import stat
import tempfile
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from service.errors import NotFoundError, RecordingError
from service.robot.messages import one_line, shown
from service.store.atomic import sync_folder, write_atomically
from service.store.incoming import KeptFile, hash_file
from service.store.names import FILE_NAME_RULE, is_file_name

_HASHES = ".sha256"
_INCOMING = ".incoming-"


class NameTakenError(RecordingError):
    """Another recording of that name is kept; recordings are never overwritten."""


@dataclass(frozen=True)
class StoredRecording:
    """A recording that lies on the server.

    name : str
        by which requests refer to it
    size : int
        number of bytes
    modified : datetime
        when it was last written, in UTC
    sha256 : str or None
        of its bytes, in hexadecimal; None where it was not computed yet
    """

    name: str
    size: int
    modified: datetime
    sha256: str | None


class RecordingStore:
    """The folder of recordings; files that an operator puts there by hand belong to it too.

    Only regular files are seen: a symbolic link could lead out of the folder.
    """

    def __init__(self, root: Path) -> None:
        """Open the store; its folder is made where it is missing.

        Parameters
        ----------
        root : Path
            holds the recordings
        """
        self.root = root
        (root / _HASHES).mkdir(parents=True, exist_ok=True)

    def stage(self) -> Path:
        """A new hidden folder on the same disk, for a file that is still arriving; `discard` it in the end."""
        return Path(tempfile.mkdtemp(prefix=_INCOMING, dir=self.root))

    def discard(self, staged: Path) -> None:
        """Remove a staged folder and what is in it.

        Parameters
        ----------
        staged : Path
            of `stage`
        """
        shutil.rmtree(staged, ignore_errors=True)

    def keep(self, file: KeptFile) -> tuple[StoredRecording, bool]:
        """Give a file in a staged folder its place among the recordings.

        Parameters
        ----------
        file : KeptFile
            in a folder of `stage`

        Returns
        -------
        StoredRecording
            the recording
        bool
            False where the very same bytes were already kept under that name

        Raises
        ------
        RecordingError
            if the name is not allowed
        NameTakenError
            if other bytes are kept under that name
        """
        if not is_file_name(file.name):
            raise RecordingError(one_line(f"{shown(file.name)}: no name for a recording; {FILE_NAME_RULE}"))
        is_new = self._give_name(file)
        return self.find(file.name), is_new

    def path(self, name: str) -> Path:
        """Where a recording lies.

        Parameters
        ----------
        name : str
            of the recording; any text that a client sent

        Raises
        ------
        NotFoundError
            if no regular file of this name is in the folder
        """
        self._status(name)
        return self.root / name

    def holds(self, name: str) -> bool:
        """Whether there is a recording of a name.

        Parameters
        ----------
        name : str
            any text
        """
        try:
            self._status(name)
        except NotFoundError:
            return False
        return True

    def find(self, name: str) -> StoredRecording:
        """A recording with its sha256, which is computed where it is not known.

        Parameters
        ----------
        name : str
            of the recording

        Raises
        ------
        NotFoundError
            if there is no such recording
        """
        digest = self.digest(name)
        return _described(name, self._status(name), digest)

    def digest(self, name: str) -> str:
        """The sha256 of a recording's bytes, in hexadecimal; computed where it is not known.

        Parameters
        ----------
        name : str
            of the recording

        Raises
        ------
        NotFoundError
            if there is no such recording
        """
        status = self._status(name)
        digest = self._known_hash(name, status)
        if digest is None:
            digest = hash_file(self.root / name)
            self._remember_hash(name, status, digest)
        return digest

    def entries(self) -> list[StoredRecording]:
        """All recordings, by name."""
        found = []
        for entry in sorted(self.root.iterdir()):
            try:
                status = self._status(entry.name)
            except NotFoundError:
                continue
            found.append(_described(entry.name, status, self._known_hash(entry.name, status)))
        return found

    def remove(self, name: str) -> None:
        """Remove a recording.

        Parameters
        ----------
        name : str
            of the recording

        Raises
        ------
        NotFoundError
            if there is no such recording
        """
        self.path(name).unlink(missing_ok=True)
        self._hash_path(name).unlink(missing_ok=True)
        sync_folder(self.root)

    def tidy(self) -> None:
        """Remove uploads that a crash cut off; to be called before anything arrives."""
        for entry in self.root.glob(f"{_INCOMING}*"):
            self.discard(entry)

    def _status(self, name: str) -> os.stat_result:
        """Size and times of a recording, which has to be a regular file directly in the folder."""
        status = None
        if is_file_name(name):
            try:
                status = os.lstat(self.root / name)
            except OSError:
                status = None
        if status is None or not stat.S_ISREG(status.st_mode):
            hint = "check the name, or list the recordings"
            raise NotFoundError(one_line(f"no recording {shown(name)} lies on the server; {hint}"))
        return status

    def _give_name(self, file: KeptFile) -> bool:
        """Link the file to its name, which fails where the name is in use; True where it is new."""
        target = self.root / file.name
        try:
            os.link(file.path, target)
        except FileExistsError:
            if target.is_symlink() or not target.is_file() or hash_file(target) != file.sha256:
                text = f"{file.name}: another recording of this name lies on the server; choose another name"
                raise NameTakenError(text) from None
            return False
        target.chmod(0o640)
        sync_folder(self.root)
        self._remember_hash(file.name, self._status(file.name), file.sha256)
        return True

    def _hash_path(self, name: str) -> Path:
        """Where the sha256 of a recording is remembered."""
        return self.root / _HASHES / f"{name}.json"

    def _known_hash(self, name: str, status: os.stat_result) -> str | None:
        """The remembered sha256, unless the file was written since."""
        try:
            known = json.loads(self._hash_path(name).read_bytes())
            if (known["size"], known["modified_ns"]) == (status.st_size, status.st_mtime_ns):
                return str(known["sha256"])
        except (OSError, ValueError, TypeError, KeyError):
            # Missing or damaged: it is only a memory of what can be computed again.
            return None
        return None

    def _remember_hash(self, name: str, status: os.stat_result, digest: str) -> None:
        """Keep a sha256 with the size and time of the file that it belongs to."""
        known = {"size": status.st_size, "modified_ns": status.st_mtime_ns, "sha256": digest}
        write_atomically(self._hash_path(name), json.dumps(known).encode())


def _described(name: str, status: os.stat_result, digest: str | None) -> StoredRecording:
    """The entry of a file."""
    return StoredRecording(name, status.st_size, datetime.fromtimestamp(status.st_mtime, UTC), digest)
