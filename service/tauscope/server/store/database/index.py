"""The index of items, recordings and robots in the database, and the plain data that it takes and gives out."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime

from pydantic import Field
from sqlalchemy import ColumnElement, delete, insert, select, update
from sqlalchemy.orm import Session

from tauscope.server.store.database.database import Database
from tauscope.server.store.database.tables import Artefact, Item, Recording, RecordingUse, Robot, Site
from tauscope.server.store.recordings import StoredRecording
from tauscope.strict_model import entry, take_fields


@dataclass(frozen=True)
class FileMetadata:
    """`sha256`: of its bytes, in hexadecimal."""

    path: str
    size: int
    sha256: str


@dataclass(frozen=True)
class RecordingRole:
    role: str
    name: str
    origin: str
    sha256: str


@dataclass(frozen=True)
class ItemMetadata:
    """`problem`: code and detail, why it has no result."""

    kind: str
    identifier: str
    state: str
    is_final: bool
    stamp: str
    created: datetime
    ended: datetime | None = None
    robot: str | None = None
    problem: tuple[str, str] | None = None
    figures: Mapping[str, str | float | None] = field(default_factory=dict)
    recordings: tuple[RecordingRole, ...] = ()
    artefacts: tuple[FileMetadata, ...] = ()


@dataclass(frozen=True)
class ItemEntry:
    kind: str
    identifier: str
    site: str
    state: str
    created: datetime
    ended: datetime | None
    robot: str | None
    problem_code: str | None
    problem_detail: str | None
    figures: Mapping[str, str | float | None]


@dataclass(frozen=True)
class ItemQuery:
    """What is searched for; None where anything will do."""

    kind: str | None = None
    state: str | None = None
    robot: str | None = None
    site: str | None = None
    recording_sha256: str | None = None
    before: datetime | None = None
    limit: int = 100


@entry
class RobotEntry:
    name: str = Field(description="as in its file")
    first_seen: datetime = Field(description="when the first item about it was handed in, UTC")
    last_seen: datetime = Field(description="when the last one was, UTC")


FIGURES: Mapping[str, tuple[str, ...]] = {
    "run": ("backend",),
    "identification": ("relative_error", "held_out_error"),
    "diagnosis": ("verdict", "headline"),
}
"""For each kind of item, the columns of its own."""


class Index:
    """The part of the index that one data folder fills, and the search over all of it."""

    def __init__(self, database: Database, site: str) -> None:
        self._database, self.site = database, site

    def register(self, label: str, now: datetime) -> None:
        """Make the site known, before anything of it is put into the index."""
        with self._database.writing() as session:
            session.merge(Site(identifier=self.site, label=label, last_seen=now))

    def stamps(self, kind: str) -> dict[str, tuple[str, bool]]:
        """Stamp of each item of this site, and whether it is final, by identifier."""
        query = select(Item.identifier, Item.stamp, Item.is_final).where(Item.site == self.site, Item.kind == kind)
        with self._database.reading() as session:
            return {identifier: (stamp, is_final) for identifier, stamp, is_final in session.execute(query)}

    def put(self, facts: Sequence[ItemMetadata]) -> None:
        """Index items of one kind, in place of what was known of them; all of them, or none."""
        if not facts:
            return
        kind, site = facts[0].kind, self.site
        identifiers = [each.identifier for each in facts]
        query = select(Item).where(Item.site == site, Item.kind == kind, Item.identifier.in_(identifiers))
        with self._database.writing() as session:
            rows = {row.identifier: row for row in session.scalars(query)}
            known = [row.id for row in rows.values()]
            for table in (Artefact, RecordingUse) if known else ():
                session.execute(delete(table).where(table.item_id.in_(known)))
            robots = _find_robots(session, facts)
            for each in facts:
                row = rows.get(each.identifier)
                if row is None:
                    row = rows[each.identifier] = Item(site=site, kind=kind, identifier=each.identifier)
                    session.add(row)
                row.state, row.is_final, row.stamp = each.state, each.is_final, each.stamp
                row.created, row.ended = each.created, each.ended
                row.problem_code, row.problem_detail = each.problem or (None, None)
                for column in FIGURES.get(kind, ()):
                    setattr(row, column, each.figures.get(column))
                row.robot_id = None if each.robot is None else robots[each.robot]
            session.flush()
            owned = [(rows[each.identifier].id, each) for each in facts]
            files = [{"item_id": owner, **vars(file)} for owner, each in owned for file in each.artefacts]
            uses = [{"item_id": owner, **vars(use)} for owner, each in owned for use in each.recordings]
            for table, values in ((Artefact, files), (RecordingUse, uses)):
                if values:
                    session.execute(insert(table), values)

    def forget(self, kind: str, identifiers: Collection[str]) -> None:
        with self._database.writing() as session:
            for identifier in identifiers:
                session.execute(delete(Item).where(*self._match(kind, identifier)))

    def damaged(self, kind: str) -> frozenset[str]:
        query = select(Item.identifier).where(Item.site == self.site, Item.kind == kind, Item.state == "damaged")
        return frozenset(self._database.fetch(query))

    def mark_damaged(self, kind: str, identifier: str, detail: str) -> None:
        values = {"state": "damaged", "problem_code": "damaged", "problem_detail": detail}
        with self._database.writing() as session:
            session.execute(update(Item).where(*self._match(kind, identifier)).values(**values))

    def artefacts(self, kind: str, identifier: str) -> tuple[FileMetadata, ...]:
        query = select(Artefact).join(Item).where(*self._match(kind, identifier))
        return tuple(take_fields(FileMetadata, row) for row in self._database.fetch(query.order_by(Artefact.path)))

    def _match(self, kind: str, identifier: str) -> tuple[ColumnElement[bool], ...]:
        return Item.site == self.site, Item.kind == kind, Item.identifier == identifier

    def put_recordings(self, entries: Iterable[StoredRecording]) -> None:
        """Index the recordings of this site; those that are not among them any more are forgotten."""
        present = {each.name: each for each in entries}
        with self._database.writing() as session:
            known = {row.name: row for row in session.scalars(select(Recording).where(Recording.site == self.site))}
            for name in known.keys() - present.keys():
                session.delete(known[name])
            for name, found in present.items():
                row = known.get(name)
                if row is None:
                    row = Recording(site=self.site, name=name)
                    session.add(row)
                row.size, row.modified, row.sha256 = found.size, found.modified, found.sha256

    def list_used_recordings(self, except_by: Collection[tuple[str, str]] = ()) -> frozenset[str]:
        """Recordings on the server that items of this site use, `except_by` those of some kinds and identifiers."""
        query = select(Item.kind, Item.identifier, RecordingUse.name).join(RecordingUse)
        query = query.where(Item.site == self.site, RecordingUse.origin == "server")
        with self._database.reading() as session:
            uses = session.execute(query)
            return frozenset(name for kind, identifier, name in uses if (kind, identifier) not in except_by)

    def list_users(self, recording: str) -> frozenset[str]:
        query = select(Item.identifier).join(RecordingUse).where(Item.site == self.site)
        query = query.where(RecordingUse.origin == "server", RecordingUse.name == recording)
        return frozenset(self._database.fetch(query))

    def search(self, query: ItemQuery) -> list[ItemEntry]:
        columns = (Item.kind, Item.state, Item.site, Robot.name)
        values = (query.kind, query.state, query.site, query.robot)
        wanted = (column == value for column, value in zip(columns, values, strict=True) if value is not None)
        statement = select(Item).outerjoin(Robot).where(*wanted)
        if query.before is not None:
            statement = statement.where(Item.created < query.before)
        if query.recording_sha256 is not None:
            statement = statement.where(Item.recordings.any(RecordingUse.sha256 == query.recording_sha256))
        statement = statement.order_by(Item.created.desc(), Item.identifier.desc()).limit(query.limit)
        return [_entry(row) for row in self._database.fetch(statement)]

    def robots(self) -> list[RobotEntry]:
        return [take_fields(RobotEntry, row) for row in self._database.fetch(select(Robot).order_by(Robot.name))]


def _find_robots(session: Session, facts: Sequence[ItemMetadata]) -> dict[str, int]:
    """The rows of the robots that items are about, made where they are missing."""
    seen: dict[str, list[datetime]] = {}
    for each in facts:
        if each.robot is not None:
            seen.setdefault(each.robot, []).append(each.created)
    robots = {row.name: row for row in session.scalars(select(Robot).where(Robot.name.in_(seen)))}
    for name, times in seen.items():
        robot = robots.get(name)
        if robot is None:
            robot = robots[name] = Robot(name=name, first_seen=min(times), last_seen=max(times))
            session.add(robot)
        robot.first_seen, robot.last_seen = min(robot.first_seen, *times), max(robot.last_seen, *times)
    session.flush()
    return {name: row.id for name, row in robots.items()}


def _entry(row: Item) -> ItemEntry:
    figures = {column: getattr(row, column) for column in FIGURES.get(row.kind, ())}
    return take_fields(ItemEntry, row, robot=row.robot and row.robot.name, figures=figures)
