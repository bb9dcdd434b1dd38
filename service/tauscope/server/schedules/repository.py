"""The schedule repository: one service alone claims a firing, however many share the database."""

from dataclasses import dataclass
from datetime import datetime
from typing import Any

from sqlalchemy import ColumnElement, delete, or_, select, update
from sqlalchemy.orm import Session

from tauscope.errors import NotFoundError
from tauscope.robot.messages import nearest, shown
from tauscope.server.store.database.database import Database
from tauscope.server.store.database.tables import Firing, Item, Schedule
from tauscope.strict_model import take_fields

UNDECIDED = ("asked", "claimed")  # states of a firing that will become another one


@dataclass(frozen=True)
class FiringEntry:
    """`item`: kind and identifier of what was started."""

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


def firing_entry(session: Session, row: Firing) -> FiringEntry:
    """What is given out of a firing, and where that stands which it started."""
    kind, identifier = row.item_kind, row.item_identifier
    item = None if kind is None or identifier is None else (kind, identifier)
    state, is_final = None, row.state not in UNDECIDED
    if item is not None:
        query = select(Item.state, Item.is_final).where(
            Item.site == row.site, Item.kind == item[0], Item.identifier == item[1]
        )
        found = session.execute(query).one_or_none()
        # What is not in the index yet goes on; what is not in it any more was removed, which is told by the folder.
        state, is_final = (None, False) if found is None else (found[0], found[1])
    told = {"item": item, "item_state": state, "is_final": is_final}
    return take_fields(FiringEntry, row, number=row.id, schedule=row.schedule.name, **told)


class ScheduleRepository:
    """Schedules and their firings, as one site sees them. Every method is one short transaction."""

    def __init__(self, database: Database, site: str, boot: str) -> None:
        self._database, self.site, self._boot = database, site, boot

    def put(self, schedule: Schedule) -> None:
        """Set a schedule up, or replace one of the same name; its firings stay."""
        with self._database.writing() as session:
            known = session.scalar(select(Schedule).where(Schedule.name == schedule.name))
            if known is not None:
                schedule.id, schedule.created = known.id, known.created
            session.merge(schedule)

    def remove(self, name: str) -> None:
        """Remove a schedule and its firings; what they started stays. Raises NotFoundError if there is none."""
        with self._database.writing() as session:
            session.execute(delete(Schedule).where(Schedule.id == _schedule(session, name).id))

    def find(self, name: str) -> Schedule:
        """A schedule. Raises NotFoundError if there is none."""
        with self._database.reading() as session:
            return _schedule(session, name)

    def schedules(self) -> list[Schedule]:
        return self._database.fetch(select(Schedule).order_by(Schedule.name))

    def due(self, now: datetime) -> list[Schedule]:
        """Schedules that this site may do and that are due, the longest first."""
        query = select(Schedule).where(Schedule.next_due <= now, self._is_mine()).order_by(Schedule.next_due)
        return self._database.fetch(query)

    def claim(self, schedule: Schedule, next_due: datetime | None, now: datetime) -> int | None:
        """Number of the firing of a due schedule; None where another service has it, or it was changed."""
        with self._database.writing() as session:
            moved = session.execute(
                update(Schedule)
                .where(Schedule.name == schedule.name, Schedule.next_due == schedule.next_due)
                .values(next_due=next_due)
                .returning(Schedule.id)
            ).scalar_one_or_none()
            if moved is None:
                return None
            firing = Firing(schedule_id=moved, due=schedule.next_due, is_asked=False, state="claimed")
            firing.claimed, firing.site, firing.boot = now, self.site, self._boot
            session.add(firing)
            session.flush()
            return firing.id

    def ask(self, name: str, now: datetime) -> int:
        """Ask the service of a schedule's site to do it now. Raises NotFoundError if there is no such schedule."""
        with self._database.writing() as session:
            firing = Firing(schedule_id=_schedule(session, name).id, due=now, is_asked=True, state="asked")
            session.add(firing)
            session.flush()
            return firing.id

    def claim_asked(self, now: datetime, number: int | None = None) -> tuple[int, Schedule] | None:
        """Number and schedule of a firing that was asked for and is taken now; None where there is none."""
        query = select(Firing).join(Schedule).where(Firing.state == "asked", self._is_mine()).order_by(Firing.id)
        if number is not None:
            query = query.where(Firing.id == number)
        with self._database.writing() as session:
            firing = session.scalars(query.limit(1).with_for_update(of=Firing, skip_locked=True)).first()
            if firing is None:
                return None
            firing.state, firing.claimed, firing.site, firing.boot = "claimed", now, self.site, self._boot
            return firing.id, firing.schedule

    def withdraw(self, number: int) -> bool:
        """Take back what was asked for; False where somebody has taken it on."""
        return self._move(Firing.id == number, "asked", state="withdrawn", reason="nobody took it on in time") > 0

    def finish(self, number: int, state: str, reason: str | None = None, item: tuple[str, str] | None = None) -> None:
        """Write down what came of a firing. `item`: (str, str), kind and identifier of what was started."""
        kind, identifier = item or (None, None)
        values = {"reason": reason, "item_kind": kind, "item_identifier": identifier}
        self._move(Firing.id == number, "claimed", state=state, **values)

    def interrupt_claims(self) -> int:
        """Give firings an end that an earlier start of this site's service left undecided; none of them is repeated."""
        reason = "the service ended while it was being started; look whether it was, nothing is repeated by itself"
        mine = (Firing.site == self.site) & (Firing.boot != self._boot)
        return self._move(mine, "claimed", state="interrupted", reason=reason)

    def firing(self, number: int) -> FiringEntry:
        """A firing. Raises NotFoundError if there is none."""
        with self._database.reading() as session:
            firing = session.get(Firing, number)
            if firing is None:
                raise NotFoundError(f"there is no firing {number}; list those of the schedule")
            return firing_entry(session, firing)

    def firings(self, name: str, limit: int) -> list[FiringEntry]:
        """The firings of a schedule, the newest first. Raises NotFoundError if there is no such schedule."""
        with self._database.reading() as session:
            query = select(Firing).where(Firing.schedule_id == _schedule(session, name).id)
            rows = session.scalars(query.order_by(Firing.id.desc()).limit(limit)).all()
            return [firing_entry(session, row) for row in rows]

    def _is_mine(self) -> ColumnElement[bool]:
        return or_(Schedule.site == self.site, Schedule.site.is_(None))

    def _move(self, where: ColumnElement[bool], before: str, **values: Any) -> int:
        statement = update(Firing).where(where, Firing.state == before).values(**values).returning(Firing.id)
        with self._database.writing() as session:
            return len(session.scalars(statement).all())


def _schedule(session: Session, name: str) -> Schedule:
    row = session.scalar(select(Schedule).where(Schedule.name == name))
    if row is None:
        known = session.scalars(select(Schedule.name).order_by(Schedule.name).limit(1000)).all()
        hint = nearest(name, known) if known else "there are none yet"
        raise NotFoundError(f"no schedule {shown(name)}; {hint}")
    return row
