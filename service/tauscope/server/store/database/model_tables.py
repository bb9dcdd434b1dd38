"""The models of each robot over time: what they say, how they were judged, and which of them is the active one."""

from datetime import datetime
from typing import Any

from sqlalchemy import ForeignKey, Index, UniqueConstraint, text
from sqlalchemy.orm import Mapped, mapped_column, relationship

from tauscope.server.store.database.base import Base
from tauscope.server.store.database.tables import Robot

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
