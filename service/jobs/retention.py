"""What is kept for how long: old items go, and what is still relied upon stays."""

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime, timedelta

from service.jobs.index_keeper import IndexKeeper
from service.jobs.item_facts import DAMAGED
from service.store import ItemStore, RecordingStore
from service.store.database import ItemEntry, ItemQuery, ModelHistory

_ALL = 10**9


@dataclass(frozen=True)
class RetentionRule:
    """What may go.

    older_than : timedelta
        items that ended, and recordings that were written, longer ago than this
    kinds : frozenset of str
        kinds of items that may go
    recordings : bool
        whether recordings may go too that no item which stays was made from
    """

    older_than: timedelta
    kinds: frozenset[str]
    recordings: bool = False


@dataclass(frozen=True)
class Removal:
    """What goes.

    items : tuple of ItemEntry
        with all their files
    recordings : tuple of str
        names of recordings
    """

    items: tuple[ItemEntry, ...]
    recordings: tuple[str, ...]


def plan_removal(
    keeper: IndexKeeper, history: ModelHistory, recordings: RecordingStore, rule: RetentionRule, now: datetime
) -> Removal:
    """What a rule lets go.

    The identification of an active model, or of one that drift is counted from, stays; so does what goes on, and what
    is damaged: somebody should look at it.

    Parameters
    ----------
    keeper : IndexKeeper
        knows the items
    history : ModelHistory
        knows the models
    recordings : RecordingStore
        recordings on the server
    rule : RetentionRule
        what may go
    now : datetime
        the present moment

    Raises
    ------
    StoreError
        if the database does not answer
    """
    keeper.sync(thorough=True)
    relied_upon = history.relied_upon()
    going = [
        entry
        for entry in keeper.index.search(ItemQuery(site=keeper.index.site, limit=_ALL))
        if entry.kind in rule.kinds
        and entry.ended is not None
        and entry.ended < now - rule.older_than
        and entry.state != DAMAGED
        and not (entry.kind == "identification" and entry.identifier in relied_upon)
    ]
    names: tuple[str, ...] = ()
    if rule.recordings:
        used = keeper.index.recordings_used(except_by={(entry.kind, entry.identifier) for entry in going})
        old = (entry for entry in recordings.entries() if entry.modified < now - rule.older_than)
        names = tuple(entry.name for entry in old if entry.name not in used)
    return Removal(tuple(going), names)


def remove(removal: Removal, items: Mapping[str, ItemStore], recordings: RecordingStore, keeper: IndexKeeper) -> None:
    """Remove what was planned; no service may work with the folder.

    Parameters
    ----------
    removal : Removal
        of `plan_removal`
    items : mapping of str to ItemStore
        folders of each kind of item
    recordings : RecordingStore
        recordings on the server
    keeper : IndexKeeper
        brought up to date afterwards

    Raises
    ------
    OSError
        if something cannot be removed; what was removed before is gone
    """
    for entry in removal.items:
        items[entry.kind].remove(entry.identifier)
    for name in removal.recordings:
        recordings.remove(name)
    keeper.sync(thorough=True)
