"""Keeps the index like the folders: whatever wrote, moved or removed them, and whatever was killed meanwhile."""

import logging
import threading
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime

from tauscope.errors import NotFoundError
from tauscope.server.history.item_metadata import DAMAGED, changed_file, read_facts, stamp
from tauscope.server.store.database.index import Index
from tauscope.server.store.items import ItemStore
from tauscope.server.store.names import identifier_time
from tauscope.server.store.recordings import RecordingStore

_log = logging.getLogger("tauscope.jobs")


@dataclass(frozen=True)
class ChangedItem:
    """An item of which a file is not what it was when the item ended; or a recording that is not what was kept."""

    kind: str
    identifier: str
    path: str


class Indexer:
    """Compares the folders with the index. The folders are right, always; nothing here writes to them.

    Jobs and runs know nothing of the index: a database that is locked or gone holds up none of them, and what was
    missed meanwhile is made up for by the next comparison.
    """

    def __init__(self, index: Index, items: Mapping[str, ItemStore], recordings: RecordingStore) -> None:
        """Prepare; nothing is read yet."""
        self.index = index
        self._items = items
        self._recordings = recordings
        self._lock = threading.Lock()
        self._known: dict[str, dict[str, tuple[str, bool]]] = {}
        self._seen_recordings: object = None

    def sync(self, *, thorough: bool = False) -> None:
        """Bring the index up to date.

        Raises
        ------
        StoreError
            if the database does not answer; the next call goes on where this one ended
        """
        with self._lock:
            if thorough or not self._known:
                self._known = {kind: self.index.stamps(kind) for kind in self._items}
            for kind, store in self._items.items():
                self._sync_kind(kind, store, thorough=thorough)
            self._sync_recordings()

    def check(self, *, deep: bool = True) -> list[ChangedItem]:
        """Compare the files of every ended item, and every recording, with the hashes kept of them."""
        self.sync(thorough=True)
        found = [ChangedItem("recording", name, "") for name in self._recordings.damaged(deep=deep)]
        for kind, store in self._items.items():
            damaged = self.index.damaged(kind)
            for identifier, (_, is_final) in sorted(self._known[kind].items()):
                if is_final:
                    found += self._checked(kind, store, identifier, damaged, deep=deep)
        return found

    def _checked(
        self, kind: str, store: ItemStore, identifier: str, damaged: Collection[str], *, deep: bool
    ) -> list[ChangedItem]:
        """The file of an item that changed, if there is one; a damaged item that was put right is read anew."""
        try:
            folder = store.folder(identifier)
        except NotFoundError:
            return []
        path = changed_file(folder, self.index.artefacts(kind, identifier), deep=deep)
        if path is not None:
            hint = "restore it from a backup, or remove the item"
            self.index.mark_damaged(kind, identifier, f"{identifier}: {path} is not what it was; {hint}")
            return [ChangedItem(kind, identifier, path)]
        if identifier not in damaged:
            return []
        facts = read_facts(kind, folder)
        if facts.state == DAMAGED or not deep:
            return [ChangedItem(kind, identifier, "")]
        self.index.put(facts)
        return []

    def _sync_kind(self, kind: str, store: ItemStore, *, thorough: bool) -> None:
        """Items of a kind that are new, gone, or go on."""
        known, present = self._known[kind], store.identifiers()
        gone = known.keys() - set(present)
        if gone:
            self.index.forget(kind, gone)
            for identifier in gone:
                del known[identifier]
        for identifier in reversed(present):
            indexed = known.get(identifier)
            if indexed is not None and indexed[1] and not thorough:
                continue
            self._sync_item(kind, store, identifier, indexed)

    def _sync_item(self, kind: str, store: ItemStore, identifier: str, indexed: tuple[str, bool] | None) -> None:
        """One item, where its state is another than the indexed one."""
        try:
            identifier_time(identifier)
            folder = store.folder(identifier)
        except (NotFoundError, ValueError):
            return
        if indexed is not None and indexed[0] == stamp(kind, folder):
            return
        facts = read_facts(kind, folder)
        if folder.is_dir():
            self.index.put(facts)
            self._known[kind][identifier] = (facts.stamp, facts.is_final)

    def _sync_recordings(self) -> None:
        """The recordings, where any of them changed."""
        entries = self._recordings.entries()
        if entries != self._seen_recordings:
            self.index.put_recordings(entries)
            self._seen_recordings = entries


def open_index(index: Index, items: Mapping[str, ItemStore], recordings: RecordingStore, label: str) -> Indexer:
    """Open the index of a data folder, and fill it from the folders; an old folder is upgraded so.

    Raises
    ------
    StoreError
        if the database does not answer
    """
    index.register(label, datetime.now(UTC))
    keeper = Indexer(index, items, recordings)
    keeper.sync(thorough=True)
    return keeper
