"""What the book of schedules gives out: schedules, and the times that they were due."""

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from tauscope.server.store.database.schedule_tables import Firing, Schedule
from tauscope.server.store.database.tables import Item

UNDECIDED = ("asked", "claimed")
"""States of a firing that will become another one."""


@dataclass(frozen=True)
class ScheduleEntry:
    """A schedule.

    site : str or None
        of the data folder whose service does it; None for whichever comes first
    """

    name: str
    site: str | None
    definition: Mapping[str, Any]
    order: Mapping[str, Any]
    files: Mapping[str, str]
    created: datetime
    next_due: datetime | None


@dataclass(frozen=True)
class FiringEntry:
    """One time that a schedule was due.

    item : (str, str) or None
        kind and identifier of what was started
    """

    number: int
    schedule: str
    due: datetime
    is_asked: bool
    state: str
    reason: str | None
    site: str | None
    item: tuple[str, str] | None
    item_state: str | None
    is_final: bool


def schedule_entry(row: Schedule) -> ScheduleEntry:
    """What is given out of a schedule."""
    return ScheduleEntry(row.name, row.site, row.definition, row.order, row.files, row.created, row.next_due)


def firing_entry(session: Session, row: Firing) -> FiringEntry:
    """What is given out of a firing, and where that stands which it started."""
    item = None
    if row.item_kind is not None and row.item_identifier is not None:
        item = row.item_kind, row.item_identifier
    state, is_final = None, row.state not in UNDECIDED
    if item is not None:
        query = select(Item.state, Item.is_final).where(
            Item.site == row.site, Item.kind == item[0], Item.identifier == item[1]
        )
        found = session.execute(query).one_or_none()
        # What is not in the index yet goes on; what is not in it any more was removed, which is told by the folder.
        state, is_final = (None, False) if found is None else (found[0], found[1])
    return FiringEntry(
        row.id, row.schedule.name, row.due, row.is_asked, row.state, row.reason, row.site, item, state, is_final
    )
