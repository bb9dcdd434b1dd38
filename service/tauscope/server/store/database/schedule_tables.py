"""What is done at set times, and every time that it was due."""

from datetime import datetime
from typing import Any

from sqlalchemy import ForeignKey, Index, UniqueConstraint
from sqlalchemy.orm import Mapped, mapped_column, relationship

from tauscope.server.store.database.base import Base


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
