"""Recordings on the server: regular files in one folder, known by name, never overwritten."""

import json
import logging
import os
import shutil
import stat
import tempfile
import threading
import zlib
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Self

from tauscope.errors import NotFoundError, RecordingError
from tauscope.files import sync_folder, write_atomically
from tauscope.robot.messages import shown
from tauscope.server.store.files import FILE_NAME_RULE, KeptFile, hash_file, is_file_name, read_stored
from tauscope.strict_model import StrictModel

_log = logging.getLogger("tauscope.store")


class KnownHash(StrictModel):
    """`sha256`: of the present bytes; `kept`: of those that were sent or recorded, None for an operator's own file."""

    size: int
    modified_ns: int
    sha256: str
    kept: str | None = None
    check: int | None = None

    @classmethod
    def of(cls, status: os.stat_result, sha256: str, kept: str | None) -> Self:
        known = cls(size=status.st_size, modified_ns=status.st_mtime_ns, sha256=sha256, kept=kept)
        return known.model_copy(update={"check": known.compute_check()})

    @property
    def is_damaged(self) -> bool:
        return self.kept not in (None, self.sha256)

    def compute_check(self) -> int:
        """A flipped bit here must not be taken for a damaged recording."""
        return zlib.crc32(json.dumps([self.size, self.modified_ns, self.sha256, self.kept]).encode())


class RecordingHashes:
    """A file a recording, with the size and time that its hash belongs to; only `kept` cannot be computed again."""

    def __init__(self, root: Path) -> None:
        self._root = root
        root.mkdir(parents=True, exist_ok=True)

    def of(self, name: str, status: os.stat_result) -> KnownHash | None:
        """What is known of a recording, unless its file was written since."""
        known = self._read(name)
        is_same = known is not None and (known.size, known.modified_ns) == (status.st_size, status.st_mtime_ns)
        return known if is_same else None

    def was_kept(self, name: str) -> bool:
        return (known := self._read(name)) is not None and known.kept is not None

    def keep(self, name: str, status: os.stat_result, sha256: str) -> None:
        """Write down what is about to be kept. Raises OSError if the disk does not take it."""
        self._write(name, KnownHash.of(status, sha256, kept=sha256))

    def remember(self, name: str, status: os.stat_result, sha256: str) -> KnownHash:
        """Remember the present hash of a recording; a disk that takes nothing costs the memory alone."""
        before = self._read(name)
        known = KnownHash.of(status, sha256, before and before.kept)
        try:
            self._write(name, known)
        except OSError:
            _log.warning("the hash of recording %s could not be remembered", name, exc_info=True)
        return known

    def forget(self, name: str) -> None:
        self._path(name).unlink(missing_ok=True)

    def tidy(self, is_there: Callable[[str], bool]) -> None:
        """Forget recordings that are gone, or never came; to be called before anything arrives."""
        for path in self._root.iterdir():
            if not is_there(path.name.removesuffix(".json")):
                path.unlink(missing_ok=True)

    def _write(self, name: str, known: KnownHash) -> None:
        if known != self._read(name):
            write_atomically(self._path(name), known.model_dump_json().encode())

    def _path(self, name: str) -> Path:
        return self._root / f"{name}.json"

    def _read(self, name: str) -> KnownHash | None:
        known = read_stored(self._path(name), KnownHash)
        # Earlier versions remembered no check.
        return known if known is not None and known.check in (None, known.compute_check()) else None


_HASHES = ".sha256"
_INCOMING = ".incoming-"


class NameTakenError(RecordingError):
    """Another recording of that name is kept; recordings are never overwritten."""


@dataclass(frozen=True)
class StoredRecording:
    """`sha256`: of its bytes, in hexadecimal; None where it was not computed yet."""

    name: str
    size: int
    modified: datetime
    sha256: str | None
    is_damaged: bool = False


class RecordingStore:
    """Regular files by name, an operator's too; a symbolic link could lead out of the folder."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self._hashes = RecordingHashes(root / _HASHES)
        self._naming = threading.Lock()

    def stage(self) -> tempfile.TemporaryDirectory[str]:
        """A new hidden folder on the same disk, for a file that is still arriving."""
        return tempfile.TemporaryDirectory(prefix=_INCOMING, dir=self.root, ignore_cleanup_errors=True)

    def keep(self, file: KeptFile) -> tuple[StoredRecording, bool]:
        """Name a staged file; False where the same bytes were kept. Raises RecordingError or NameTakenError."""
        if not is_file_name(file.name):
            raise RecordingError(f"{shown(file.name)}: no name for a recording; {FILE_NAME_RULE}")
        is_new = self._give_name(file)
        return self.find(file.name), is_new

    def path(self, name: str) -> Path:
        self._status(name)
        return self.root / name

    def holds(self, name: str) -> bool:
        with suppress(NotFoundError):
            return self._status(name) is not None
        return False

    def find(self, name: str) -> StoredRecording:
        """A recording with its sha256, computed where it is not known. Raises NotFoundError if there is none."""
        status = self._status(name)
        known = self._hashes.of(name, status)
        if known is None:
            known = self._hashes.remember(name, status, hash_file(self.root / name))
        return _describe(name, status, known)

    def digest(self, name: str) -> str:
        """The sha256 of a recording's bytes. Raises NotFoundError, or RecordingError if it is damaged."""
        found = self.find(name)
        if found.sha256 is None or found.is_damaged:
            hint = "restore it from a backup, or remove it and send it again"
            raise RecordingError(f"{name}: is damaged, its bytes are not those that were kept; {hint}")
        return found.sha256

    def entries(self) -> list[StoredRecording]:
        """All recordings, by name; of those that were sent or recorded, and changed since, the hash is looked at."""
        found = []
        for entry in sorted(self.root.iterdir()):
            with suppress(NotFoundError, FileNotFoundError):  # removed meanwhile, or no recording
                status = self._status(entry.name)
                known = self._hashes.of(entry.name, status)
                if known is None and self._hashes.was_kept(entry.name):
                    found.append(self.find(entry.name))
                else:
                    found.append(_describe(entry.name, status, known))
        return found

    def damaged(self, *, deep: bool) -> list[str]:
        """Names of the recordings that were sent or recorded and whose bytes are not those any more."""
        if deep:
            for entry in self.entries():
                with suppress(NotFoundError, FileNotFoundError):  # removed meanwhile
                    self._hashes.remember(entry.name, self._status(entry.name), hash_file(self.root / entry.name))
        return [entry.name for entry in self.entries() if entry.is_damaged]

    def remove(self, name: str) -> None:
        """Remove a recording. Raises NotFoundError if there is no such recording."""
        self.path(name).unlink(missing_ok=True)
        self._hashes.forget(name)
        sync_folder(self.root)

    def tidy(self) -> None:
        """Remove what a crash left of uploads; to be called before anything arrives."""
        for entry in self.root.glob(f"{_INCOMING}*"):
            shutil.rmtree(entry, ignore_errors=True)
        self._hashes.tidy(self.holds)

    def _status(self, name: str) -> os.stat_result:
        """Size and times of a recording, which has to be a regular file directly in the folder."""
        status = None
        if is_file_name(name):
            with suppress(OSError):
                status = os.lstat(self.root / name)
        if status is None or not stat.S_ISREG(status.st_mode):
            hint = "check the name, or list the recordings"
            raise NotFoundError(f"no recording {shown(name)} lies on the server; {hint}")
        return status

    def _give_name(self, file: KeptFile) -> bool:
        """Link a file to its name, its hash written first; False where the same bytes have that name."""
        target = self.root / file.name
        with self._naming:
            if os.path.lexists(target):
                if target.is_symlink() or not target.is_file() or hash_file(target) != file.sha256:
                    text = f"{file.name}: another recording of this name lies on the server; choose another name"
                    raise NameTakenError(text)
                return False
            file.path.chmod(0o640)
            self._hashes.keep(file.name, file.path.stat(), file.sha256)
            os.link(file.path, target)
            sync_folder(self.root)
        return True


def _describe(name: str, status: os.stat_result, known: KnownHash | None) -> StoredRecording:
    sha256, is_damaged = (None, False) if known is None else (known.sha256, known.is_damaged)
    return StoredRecording(name, status.st_size, datetime.fromtimestamp(status.st_mtime, UTC), sha256, is_damaged)
