"""A data folder: its lock, its identifier, and items as folders that appear and go with all their files at once."""

import fcntl
import json
import os
import secrets
import shutil
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Literal

from tauscope.errors import NotFoundError, StoreError, TauscopeError
from tauscope.files import sync_folder, write_atomically
from tauscope.robot.messages import shown
from tauscope.server.store.files import is_identifier, new_identifier

_STAGED = ".staged-"
_REMOVED = ".removed-"


def utc_now() -> datetime:
    return datetime.now(UTC)


class ItemStore:
    def __init__(self, root: Path, noun: str, clock: Callable[[], datetime] = utc_now) -> None:
        self.root, self.noun, self.clock = root, noun, clock
        root.mkdir(parents=True, exist_ok=True)

    def stage(self) -> Path:
        """A new empty folder that is no item yet; fill it, then `publish` or `discard` it."""
        folder = self.root / f"{_STAGED}{new_identifier(self.clock())}"
        folder.mkdir()
        return folder

    def publish(self, staged: Path) -> str:
        """Make a staged folder an item. Raises OSError if the disk does not take it; the folder stays staged."""
        identifier = staged_identifier(staged)
        published = self.root / identifier
        staged.rename(published)
        try:
            sync_folder(self.root)
        except OSError:
            # Nobody is told of it: an item that is there all the same would have nobody to see to it.
            published.rename(staged)
            raise
        return identifier

    def discard(self, staged: Path) -> None:
        shutil.rmtree(staged, ignore_errors=True)

    def identifiers(self) -> list[str]:
        """All items, the newest first."""
        return sorted((entry.name for entry in self.root.iterdir() if is_identifier(entry.name)), reverse=True)

    def folder(self, identifier: str) -> Path:
        """The folder of an item. Raises NotFoundError if there is no such item."""
        folder = self.root / identifier if is_identifier(identifier) else None
        if folder is None or not folder.is_dir():
            hint = "check the identifier, or list what is kept"
            raise NotFoundError(f"no {self.noun} {shown(identifier)} is kept here; {hint}")
        return folder

    def remove(self, identifier: str) -> None:
        """Remove an item and all its files. Raises NotFoundError if there is no such item."""
        going = self.root / f"{_REMOVED}{identifier}"
        self.folder(identifier).rename(going)
        try:
            sync_folder(self.root)
        finally:
            shutil.rmtree(going, ignore_errors=True)  # also, and above all, where the disk is full

    def tidy(self) -> None:
        """Remove what a crash left half made or half removed; to be called before anything is staged."""
        for entry in self.root.iterdir():
            if entry.name.startswith((_STAGED, _REMOVED)):
                shutil.rmtree(entry, ignore_errors=True)


def staged_identifier(staged: Path) -> str:
    """The identifier that a staged folder will have as an item."""
    return staged.name.removeprefix(_STAGED)


ItemKind = Literal["excitation", "run", "identification", "diagnosis", "rollout", "campaign"]

FOLDERS = {
    "excitation": "excitations",
    "run": "runs",
    "identification": "identifications",
    "diagnosis": "diagnoses",
    "rollout": "rollouts",
    "campaign": "campaigns",
}
"""The folder of each kind of item, below the data folder; its collection has the same name at the API."""
RECORDINGS = "recordings"


def item_stores(data_folder: Path) -> dict[str, ItemStore]:
    """The folders of every kind of item, made where they are missing."""
    return {kind: ItemStore(data_folder / name, kind) for kind, name in FOLDERS.items()}


LOCK_NAME = ".lock"


class FolderLock:
    """Holds a folder for this process; the system lets go of it when the process ends, however it ends."""

    def __init__(self, folder: Path) -> None:
        """Take the folder. Raises TauscopeError if another process holds it."""
        self._descriptor = os.open(folder / LOCK_NAME, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        try:
            fcntl.flock(self._descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            os.close(self._descriptor)
            hint = "stop it, or give this one another data folder"
            raise TauscopeError(f"{folder}: another tauscope service works with this folder; {hint}") from None

    def release(self) -> None:
        os.close(self._descriptor)


FILE_NAME = "site.json"


def site_identifier(data_folder: Path) -> str:
    """The identifier of a data folder, made when it is first opened. Raises StoreError if it is damaged."""
    path = data_folder / FILE_NAME
    try:
        identifier = json.loads(path.read_bytes())["identifier"]
    except FileNotFoundError:
        identifier = secrets.token_hex(8)
        write_atomically(path, json.dumps({"form": "tauscope.site/1", "identifier": identifier}).encode())
    except (ValueError, TypeError, KeyError):
        identifier = None
    if not isinstance(identifier, str) or not identifier.isalnum():
        hint = "restore it from a backup, or remove it: the folder then counts as a new one"
        raise StoreError(f"{path}: is damaged; {hint}")
    return identifier
