"""What the index knows of an item, as plain data: read from its folder, and given out by a search."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime


@dataclass(frozen=True)
class FileMetadata:
    """A file of an item.

    path : str
        below the item's folder, with ``/``
    size : int
        number of bytes
    sha256 : str
        of its bytes, in hexadecimal
    """

    path: str
    size: int
    sha256: str


@dataclass(frozen=True)
class RecordingRole:
    """A recording that an item works with.

    role : str
        what for: ``recordings``, ``held_out`` or ``simulated``
    name : str
        its file name
    origin : str
        ``uploaded`` with the request, or lying on the ``server``
    sha256 : str
        of its bytes when the item was handed in
    """

    role: str
    name: str
    origin: str
    sha256: str


@dataclass(frozen=True)
class ItemMetadata:
    """An item as its folder shows it.

    kind : str
        a key of `ITEM_CLASSES`
    identifier : str
        name of its folder
    state : str
        where it stands, or ``damaged``
    is_final : bool
        whether it will stay so by itself
    stamp : str
        changes when its state file does
    created : datetime
        when it was handed in
    ended : datetime or None
        when it reached its end
    robot : str or None
        what its robot file calls the robot
    problem : (str, str) or None
        code and detail: why it has no result
    figures : mapping
        what is searched for besides: columns of its kind's table class
    recordings : tuple of RecordingRole
        what it works with
    artefacts : tuple of FileMetadata
        its files, once it has ended
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
    """An item as a search finds it.

    kind, identifier, state : str
        as in `ItemMetadata`
    site : str
        identifier of the data folder that holds it
    created : datetime
        when it was handed in
    ended : datetime or None
        when it reached its end
    robot : str or None
        what its robot file calls the robot
    problem_code, problem_detail : str or None
        why it has no result
    figures : mapping
        columns of its kind
    """

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
    """What is searched for; None where anything will do.

    kind, state, robot, site : str or None
        of the items
    recording_sha256 : str or None
        of a recording that the items were made from or judged by
    before : datetime or None
        items that were handed in earlier than this
    limit : int
        most items that are found, the newest first
    """

    kind: str | None = None
    state: str | None = None
    robot: str | None = None
    site: str | None = None
    recording_sha256: str | None = None
    before: datetime | None = None
    limit: int = 100


@dataclass(frozen=True)
class RobotEntry:
    """A robot that items are about.

    name : str
        as in its file
    first_seen, last_seen : datetime
        when the first and the last item about it was handed in
    """

    name: str
    first_seen: datetime
    last_seen: datetime
