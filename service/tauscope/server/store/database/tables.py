"""The index of what is kept: every item of every data folder, its robot, its files and its recordings.

The folders are the truth; these tables are made from them, and made again where they are missing.
"""

from datetime import datetime

from sqlalchemy import BigInteger, ForeignKey, Index, UniqueConstraint
from sqlalchemy.orm import Mapped, mapped_column, relationship

from tauscope.server.store.database.base import Base


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
    """A diagnosis and its `verdict`."""

    __mapper_args__ = {"polymorphic_identity": "diagnosis"}  # noqa: RUF012
    verdict: Mapped[str | None] = mapped_column(nullable=True)


class Campaign(Item):
    """A campaign."""

    __mapper_args__ = {"polymorphic_identity": "campaign"}  # noqa: RUF012


ITEM_CLASSES: dict[str, type[Item]] = {
    "excitation": Excitation,
    "run": Run,
    "identification": Identification,
    "diagnosis": Diagnosis,
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
