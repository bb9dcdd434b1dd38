"""The tables of the database: the index of all items, the models of each robot, and the schedules.

The folders are the truth; the index is made from them, and made again where it is missing.
"""

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
        """The moment as it is given out, in UTC."""
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
    """A data folder; several services with a folder each may share one database.

    `identifier` is kept with the folder, `label` is what people call it, `last_seen` when it was last opened.
    """

    __tablename__ = "sites"

    identifier: Mapped[str] = mapped_column(primary_key=True)
    label: Mapped[str]
    last_seen: Mapped[datetime]


class Robot(Base):
    """A robot, known by the `name` in its file; `first_seen` and `last_seen` are when items about it were handed in.

    `id` is of this database alone.
    """

    __tablename__ = "robots"

    id: Mapped[int] = mapped_column(primary_key=True)
    name: Mapped[str] = mapped_column(unique=True)
    first_seen: Mapped[datetime]
    last_seen: Mapped[datetime]


class Item(Base):
    """Something that lies in a folder of its own: of which `site` and `kind`, and by which `identifier`.

    `id` is of this database alone. `state` is where it stands, `is_final` whether it stays so by itself; `stamp` tells
    whether the folder changed since it was indexed. `created` and `ended` are when it was handed in and when it ended;
    `problem_code` and `problem_detail` say why it has no result. `robot_id` and `robot` are what it is about,
    `artefacts` its files, `recordings` what it works with.
    """

    __tablename__ = "items"
    __table_args__ = (
        UniqueConstraint("site", "kind", "identifier"),
        Index(None, "kind", "created"),
        Index(None, "robot_id", "created"),
    )
    __mapper_args__ = {"polymorphic_on": "kind"}  # noqa: RUF012 - read by SQLAlchemy when the class is made

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
    robot: Mapped[Robot | None] = relationship(lazy="joined")
    artefacts: Mapped[list["Artefact"]] = relationship(cascade="all, delete-orphan", passive_deletes=True)
    recordings: Mapped[list["RecordingUse"]] = relationship(cascade="all, delete-orphan", passive_deletes=True)


class Excitation(Item):
    """A designed motion."""

    __mapper_args__ = {"polymorphic_identity": "excitation"}  # noqa: RUF012


class Run(Item):
    """A motion of the arm, by a `backend`."""

    __mapper_args__ = {"polymorphic_identity": "run"}  # noqa: RUF012
    backend: Mapped[str | None] = mapped_column(nullable=True)


class Identification(Item):
    """An identification: `relative_error` of its fit, and `held_out_error` on recordings that it was not made from."""

    __mapper_args__ = {"polymorphic_identity": "identification"}  # noqa: RUF012
    relative_error: Mapped[float | None] = mapped_column(nullable=True)
    held_out_error: Mapped[float | None] = mapped_column(nullable=True)


class Diagnosis(Item):
    """A diagnosis, its `verdict`, and its `headline`: the most important result in one sentence."""

    __mapper_args__ = {"polymorphic_identity": "diagnosis"}  # noqa: RUF012
    verdict: Mapped[str | None] = mapped_column(nullable=True)
    headline: Mapped[str | None] = mapped_column(nullable=True)


class Rollout(Item):
    """A rollout."""

    __mapper_args__ = {"polymorphic_identity": "rollout"}  # noqa: RUF012


class Campaign(Item):
    """A campaign."""

    __mapper_args__ = {"polymorphic_identity": "campaign"}  # noqa: RUF012


ITEM_CLASSES: dict[str, type[Item]] = {
    "excitation": Excitation,
    "run": Run,
    "identification": Identification,
    "diagnosis": Diagnosis,
    "rollout": Rollout,
    "campaign": Campaign,
}
"""The table class of each kind of item."""


class Artefact(Base):
    """A file of an item (`item_id`) that ended: its `path` below the item's folder, its `size` and `sha256` then."""

    __tablename__ = "artefacts"

    item_id: Mapped[int] = mapped_column(ForeignKey("items.id", ondelete="CASCADE"), primary_key=True)
    path: Mapped[str] = mapped_column(primary_key=True)
    size: Mapped[int] = mapped_column(BigInteger)
    sha256: Mapped[str]


class RecordingUse(Base):
    """A recording that an item (`item_id`) works with: in which `role`, by which `name` and of which `origin`.

    `sha256` is of its bytes when the item was handed in.
    """

    __tablename__ = "recording_uses"

    item_id: Mapped[int] = mapped_column(ForeignKey("items.id", ondelete="CASCADE"), primary_key=True)
    role: Mapped[str] = mapped_column(primary_key=True)
    name: Mapped[str] = mapped_column(primary_key=True)
    origin: Mapped[str]
    sha256: Mapped[str] = mapped_column(index=True)


class Recording(Base):
    """A recording that lies in the data folder of a `site`: its `name`, `size` [bytes], when it was `modified`.

    `sha256` is of its bytes, where that was computed; `id` is of this database alone.
    """

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
    """An identification that was judged: `identifier` of it, of which `site`, about which robot (`robot_id`, `robot`).

    `id` is of this database alone. `created` is when the identification was handed in, `considered` when it was judged;
    `source` says what was measured: ``arm``, ``simulated`` or ``uploaded``. `state` is ``active``, ``kept`` (it was
    active), ``refused`` or ``unreadable``; `gates` are what it had to show. `is_active` marks the model in use,
    `is_reference` the one that drift is counted from: one of each for a robot. `document` is the identification.
    """

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
    """That a model (`model_id`) of a robot (`robot_id`) was made active or the reference: `role` says which.

    `id` is of this database alone; `at` is when, `reason` why.
    """

    __tablename__ = "model_choices"

    id: Mapped[int] = mapped_column(primary_key=True)
    robot_id: Mapped[int] = mapped_column(ForeignKey("robots.id"), index=True)
    model_id: Mapped[int] = mapped_column(ForeignKey("models.id"))
    role: Mapped[str]
    at: Mapped[datetime]
    reason: Mapped[str]


class ModelEvent(Base):
    """Something about a robot (`robot_id`, `robot`) that people should know: `kind` of it and one line of `text`.

    `id` numbers the events. A drift has a `parameter`, and `details` with its figures; `raised` is when it was seen
    first, `last_seen` when last, `closed` when somebody took note and `note` what they wrote.
    """

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
    """The bounds that were set for a robot (`robot_id`): `document` of a model policy."""

    __tablename__ = "robot_policies"

    robot_id: Mapped[int] = mapped_column(ForeignKey("robots.id"), primary_key=True)
    document: Mapped[dict[str, Any]]


class Schedule(Base):
    """Work that is repeated: its `name`, its `definition`, the `order` of each repetition and the robot's `files`.

    `id` is of this database alone. `site` is the data folder whose service does it; whichever comes first where it is
    null. `next_due` is when it is due next, null while it is not enabled. `created` is when it was set up first.
    """

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
    """One time that a schedule (`schedule_id`, `schedule`) was due: by the clock, or asked for (`is_asked`).

    `id` numbers the firings. `due` is when, `claimed` when a service took it on, which `site` and which start of it
    (`boot`). `state` is ``asked``, ``claimed``, ``started``, ``skipped``, ``missed``, ``failed``, ``interrupted`` or
    ``withdrawn``, `reason` why nothing was started. `item_kind` and `item_identifier` are what was started.
    """

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
