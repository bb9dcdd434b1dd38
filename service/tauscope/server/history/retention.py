"""What is kept for how long: old items go, and what is still relied upon stays."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import datetime, timedelta

from tauscope.errors import NotFoundError
from tauscope.server.history.indexer import DAMAGED, Indexer
from tauscope.server.history.model_history import ModelHistory
from tauscope.server.store.data_folder import utc_now
from tauscope.server.store.database.index import ItemEntry, ItemQuery
from tauscope.server.store.recordings import RecordingStore

_ALL = 10**9


@dataclass(frozen=True)
class RetentionRule:
    older_than: timedelta
    kinds: frozenset[str]
    recordings: bool = False


Removers = Mapping[str, Callable[[str], object]]  # what removes an item, by its kind


@dataclass(frozen=True)
class Removal:
    items: tuple[ItemEntry, ...]
    recordings: tuple[str, ...]


def plan_removal(
    indexer: Indexer, history: ModelHistory, recordings: RecordingStore, rule: RetentionRule, now: datetime
) -> Removal:
    """What a rule lets go: nothing active, unfinished or damaged, and no reference. Raises StoreError."""
    indexer.sync(thorough=True)
    list_protected = history.list_protected()
    going = [
        entry
        for entry in indexer.index.search(ItemQuery(site=indexer.index.site, limit=_ALL))
        if entry.kind in rule.kinds
        and entry.ended is not None
        and entry.ended < now - rule.older_than
        and entry.state != DAMAGED
        and not (entry.kind == "identification" and entry.identifier in list_protected)
    ]
    names: tuple[str, ...] = ()
    if rule.recordings:
        used = indexer.index.list_used_recordings(except_by={(entry.kind, entry.identifier) for entry in going})
        old = (entry for entry in recordings.entries() if entry.modified < now - rule.older_than)
        names = tuple(entry.name for entry in old if entry.name not in used)
    return Removal(tuple(going), names)


def remove(removal: Removal, removers: Removers, recordings: RecordingStore, indexer: Indexer) -> Removal:
    """Remove what was planned and is still there. Raises OSError if something cannot be removed."""
    items = tuple(entry for entry in removal.items if _is_gone(removers[entry.kind], entry.identifier))
    names = tuple(name for name in removal.recordings if _is_gone(recordings.remove, name))
    indexer.sync(thorough=True)
    return Removal(items, names)


def _is_gone(remove_one: Callable[[str], object], name: str) -> bool:
    try:
        remove_one(name)
    except NotFoundError:
        return False
    return True


def sweep(
    rule: RetentionRule,
    indexer: Indexer,
    history: ModelHistory,
    recordings: RecordingStore,
    removers: Removers,
    on_removed: Callable[[str, str], None],
) -> None:
    """Remove what a rule lets go, as the routes do. Raises StoreError, before anything goes, or OSError."""
    plan = plan_removal(indexer, history, recordings, rule, utc_now())
    gone = remove(plan, removers, recordings, indexer)
    for each in gone.items:
        on_removed(each.kind, each.identifier)
    for name in gone.recordings:
        on_removed("recording", name)
