"""Items that are folders: each appears with all its files at once, and goes at once."""

import shutil
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

from tauscope.errors import NotFoundError
from tauscope.files import sync_folder
from tauscope.robot.messages import one_line, shown
from tauscope.server.store.files import is_identifier, new_identifier

_STAGED = ".staged-"
_REMOVED = ".removed-"


def utc_now() -> datetime:
    """The present moment in UTC."""
    return datetime.now(UTC)


class ItemStore:
    """Folders named by identifiers, below one folder."""

    def __init__(self, root: Path, noun: str, clock: Callable[[], datetime] = utc_now) -> None:
        """Open the store; its folder is made where it is missing."""
        self.root = root
        self.noun = noun
        self.clock = clock
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
        """Remove a staged folder; nothing happens where it was published."""
        shutil.rmtree(staged, ignore_errors=True)

    def identifiers(self) -> list[str]:
        """All items, the newest first."""
        return sorted((entry.name for entry in self.root.iterdir() if is_identifier(entry.name)), reverse=True)

    def folder(self, identifier: str) -> Path:
        """The folder of an item. Raises NotFoundError if there is no such item."""
        folder = self.root / identifier if is_identifier(identifier) else None
        if folder is None or not folder.is_dir():
            hint = "check the identifier, or list what is kept"
            raise NotFoundError(one_line(f"no {self.noun} {shown(identifier)} is kept here; {hint}"))
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
