"""A data folder: its lock, its identifier, and the folder of each kind of item."""

import fcntl
import json
import os
import secrets
from pathlib import Path

from tauscope.errors import StoreError, TauscopeError
from tauscope.files import write_atomically
from tauscope.server.store.items import ItemStore

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
        """Let go of the folder."""
        os.close(self._descriptor)


FILE_NAME = "site.json"


def site_identifier(data_folder: Path) -> str:
    """The identifier of a data folder; given to it when it is opened for the first time, and kept with it.

    Raises StoreError if its ``site.json`` is damaged.
    """
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
