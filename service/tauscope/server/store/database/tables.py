"""The tables of the database: the index, made from the folders, the models of robots, and schedules."""

from datetime import UTC, datetime
from typing import Any, ClassVar

from sqlalchemy import JSON, BigInteger, DateTime, Dialect, ForeignKey, Index, MetaData, UniqueConstraint, text
from sqlalchemy.dialects.postgresql import JSONB
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column, relationship
from sqlalchemy.types import TypeDecorator

PLAIN = JSON().with_variant(JSONB(), "postgresql")  # plain data: what JSON can hold


class Moment(TypeDecorator[datetime]):
    """A moment in UTC; SQLite knows no time zones, so it keeps the bare UTC time."""

    impl = DateTime(timezone=True)
    cache_ok = True

    def process_bind_param(self, value: datetime | None, dialect: Dialect) -> Any:
        """The moment as it is kept. Raises ValueError for a time without time zone: it could be any moment."""
        if value is None:
            return None
        if value.tzinfo is None:
            raise ValueError(f"{value} has no time zone")
        moment = value.astimezone(UTC)
        return moment.replace(tzinfo=None) if dialect.name == "sqlite" else moment

    def process_result_value(self, value: Any, dialect: Dialect) -> datetime | None:
        if value is None:
            return None
        return value.replace(tzinfo=UTC) if value.tzinfo is None else value.astimezone(UTC)


_NAMES = {
    "ix": "ix_%(table_name)s_%(column_0_N_name)s",
    "uq": "uq_%(table_name)s_%(column_0_N_name)s",
    "ck": "ck_%(table_name)s_%(constraint_name)s",
    "fk": "fk_%(table_name)s_%(column_0_name)s",
    "pk": "pk_%(table_name)s",
}


class Base(DeclarativeBase):
    """Base of every table; `type_annotation_map` says how Python's types are kept."""

    metadata = MetaData(naming_convention=_NAMES)
    type_annotation_map: ClassVar[dict[Any, Any]] = {datetime: Moment, dict[str, Any]: PLAIN, list[Any]: PLAIN}


class Site(Base):
    """A data folder: its kept `identifier`, the `label` that people call it by, and when it was last opened."""

    __tablename__ = "sites"

    identifier: Mapped[str] = mapped_column(primary_key=True)
    label: Mapped[str]
    last_seen: Mapped[datetime]


class Robot(Base):
    __tablename__ = "robots"

    id: Mapped[int] = mapped_column(primary_key=True)
    name: Mapped[str] = mapped_column(unique=True)
    first_seen: Mapped[datetime]
    last_seen: Mapped[datetime]


class Item(Base):
    """`is_final`: whether its state stays; `stamp` changes with its folder.

    Columns that only some kinds have, such as `verdict`, are null elsewhere.
    """

    __tablename__ = "items"
    __table_args__ = (
        UniqueConstraint("site", "kind", "identifier"),
        Index(None, "kind", "created"),
        Index(None, "robot_id", "created"),
    )

    id: Mapped[int] = mapped_column(primary_key=True)
    site: Mapped[str] = mapped_column(ForeignKey("sites.identifier"))
    kind: Mapped[str]
    identifier: Mapped[str]
    robot_id: Mapped[int | None] = mapped_column(ForeignKey("robots.id"))
    state: Mapped[str]
    is_final: Mapped[bool]
    stamp: Mapped[str]
    created: Mapped[datetime]
    ended: Mapped[datetime | None]
    problem_code: Mapped[str | None]
    problem_detail: Mapped[str | None]
    backend: Mapped[str | None]
    relative_error: Mapped[float | None]
    held_out_error: Mapped[float | None]
    verdict: Mapped[str | None]
    headline: Mapped[str | None]
    robot: Mapped[Robot | None] = relationship(lazy="joined")
    recordings: Mapped[list["RecordingUse"]] = relationship(cascade="all, delete-orphan", passive_deletes=True)


class Artefact(Base):
    __tablename__ = "artefacts"

    item_id: Mapped[int] = mapped_column(ForeignKey("items.id", ondelete="CASCADE"), primary_key=True)
    path: Mapped[str] = mapped_column(primary_key=True)
    size: Mapped[int] = mapped_column(BigInteger)
    sha256: Mapped[str]


class RecordingUse(Base):
    __tablename__ = "recording_uses"

    item_id: Mapped[int] = mapped_column(ForeignKey("items.id", ondelete="CASCADE"), primary_key=True)
    role: Mapped[str] = mapped_column(primary_key=True)
    name: Mapped[str] = mapped_column(primary_key=True)
    origin: Mapped[str]
    sha256: Mapped[str] = mapped_column(index=True)


class Recording(Base):
    __tablename__ = "recordings"
    __table_args__ = (UniqueConstraint("site", "name"),)

    id: Mapped[int] = mapped_column(primary_key=True)
    site: Mapped[str] = mapped_column(ForeignKey("sites.identifier"))
    name: Mapped[str]
    size: Mapped[int] = mapped_column(BigInteger)
    modified: Mapped[datetime]
    sha256: Mapped[str | None]


_ACTIVE, _REFERENCE, _OPEN = text("is_active"), text("is_reference"), text("closed IS NULL")


class Model(Base):
    """A judged identification; `source`: arm, simulated or uploaded; one of a robot is active, one the reference."""

    __tablename__ = "models"
    __table_args__ = (
        UniqueConstraint("site", "identifier"),
        Index("uq_models_active", "robot_id", unique=True, sqlite_where=_ACTIVE, postgresql_where=_ACTIVE),
        Index("uq_models_reference", "robot_id", unique=True, sqlite_where=_REFERENCE, postgresql_where=_REFERENCE),
        Index(None, "robot_id", "created"),
    )

    id: Mapped[int] = mapped_column(primary_key=True)
    robot_id: Mapped[int] = mapped_column(ForeignKey("robots.id"))
    site: Mapped[str] = mapped_column(ForeignKey("sites.identifier"))
    identifier: Mapped[str] = mapped_column(index=True)
    created: Mapped[datetime]
    considered: Mapped[datetime]
    source: Mapped[str]
    state: Mapped[str]
    gates: Mapped[list[Any]]
    is_active: Mapped[bool]
    is_reference: Mapped[bool]
    document: Mapped[dict[str, Any] | None] = mapped_column(deferred=True)
    robot: Mapped[Robot] = relationship(lazy="joined")


class ModelChoice(Base):
    """That a model was made active or the reference (`role`), when and why."""

    __tablename__ = "model_choices"

    id: Mapped[int] = mapped_column(primary_key=True)
    robot_id: Mapped[int] = mapped_column(ForeignKey("robots.id"), index=True)
    model_id: Mapped[int] = mapped_column(ForeignKey("models.id"))
    role: Mapped[str]
    at: Mapped[datetime]
    reason: Mapped[str]


class ModelEvent(Base):
    """What people should know of a robot, seen first (`raised`), last, and `closed` by somebody with a `note`."""

    __tablename__ = "model_events"
    __table_args__ = (
        Index(
            "uq_model_events_open", "robot_id", "kind", "parameter", unique=True, sqlite_where=_OPEN,
            postgresql_where=_OPEN,
        ),
    )  # fmt: skip

    id: Mapped[int] = mapped_column(primary_key=True)
    robot_id: Mapped[int] = mapped_column(ForeignKey("robots.id"))
    kind: Mapped[str]
    parameter: Mapped[str]
    text: Mapped[str]
    details: Mapped[dict[str, Any]]
    raised: Mapped[datetime]
    last_seen: Mapped[datetime]
    closed: Mapped[datetime | None]
    note: Mapped[str | None]
    robot: Mapped[Robot] = relationship(lazy="joined")


class RobotPolicy(Base):
    __tablename__ = "robot_policies"

    robot_id: Mapped[int] = mapped_column(ForeignKey("robots.id"), primary_key=True)
    document: Mapped[dict[str, Any]]


class Schedule(Base):
    """Repeated work; `site`: whose service does it, null for any; `next_due`: null while not enabled."""

    __tablename__ = "schedules"

    id: Mapped[int] = mapped_column(primary_key=True)
    name: Mapped[str] = mapped_column(unique=True)
    site: Mapped[str | None]
    definition: Mapped[dict[str, Any]]
    order: Mapped[dict[str, Any]]
    files: Mapped[dict[str, Any]]
    created: Mapped[datetime]
    next_due: Mapped[datetime | None] = mapped_column(index=True)


class Firing(Base):
    """One time that a schedule was due or asked for; `claimed` by which start (`boot`) of which service."""

    __tablename__ = "firings"
    __table_args__ = (UniqueConstraint("schedule_id", "due", "is_asked"), Index(None, "state"))

    id: Mapped[int] = mapped_column(primary_key=True)
    schedule_id: Mapped[int] = mapped_column(ForeignKey("schedules.id", ondelete="CASCADE"))
    due: Mapped[datetime]
    is_asked: Mapped[bool]
    claimed: Mapped[datetime | None]
    site: Mapped[str | None]
    boot: Mapped[str | None]
    state: Mapped[str]
    reason: Mapped[str | None]
    item_kind: Mapped[str | None]
    item_identifier: Mapped[str | None]
    schedule: Mapped[Schedule] = relationship(lazy="joined")
