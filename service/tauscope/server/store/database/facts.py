"""What the index knows of an item, as plain data: read from its folder, and given out by a search."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime


@dataclass(frozen=True)
class FileMetadata:
    """A file of an item.

    sha256 : str
        of its bytes, in hexadecimal
    """

    path: str
    size: int
    sha256: str


@dataclass(frozen=True)
class RecordingRole:
    """A recording that an item works with."""

    role: str
    name: str
    origin: str
    sha256: str


@dataclass(frozen=True)
class ItemMetadata:
    """An item as its folder shows it.

    problem : (str, str) or None
        code and detail: why it has no result
    """

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
    """An item as a search finds it."""

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


@dataclass(frozen=True)
class RobotEntry:
    """A robot that items are about."""

    name: str
    first_seen: datetime
    last_seen: datetime
