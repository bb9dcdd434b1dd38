"""What the history of models gives out, as plain data."""

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from tauscope.server.history import Gate


@dataclass(frozen=True)
class ModelEntry:
    """A model of a robot.

    identifier : str
        of the identification
    site : str
        of the data folder that holds it
    robot : str
        name of the robot
    created : datetime
        when the identification was handed in
    considered : datetime
        when it was judged
    source : str
        ``arm``, ``simulated`` or ``uploaded``
    state : str
        ``active``, ``kept``, ``refused`` or ``unreadable``
    gates : tuple of Gate
        what it had to show
    is_reference : bool
        whether drift is counted from it
    """

    identifier: str
    site: str
    robot: str
    created: datetime
    considered: datetime
    source: str
    state: str
    gates: tuple[Gate, ...]
    is_reference: bool


@dataclass(frozen=True)
class ModelEventEntry:
    """Something about a robot that people should know.

    number : int
        of the event
    robot : str
        name of the robot
    kind : str
        ``drift``, ``activated`` or ``refused``
    parameter : str
        of a drift; else empty
    text : str
        one line
    details : mapping
        figures
    raised, last_seen : datetime
        when it was seen first and last
    closed : datetime or None
        when somebody took note
    note : str or None
        what they wrote
    """

    number: int
    robot: str
    kind: str
    parameter: str
    text: str
    details: Mapping[str, Any]
    raised: datetime
    last_seen: datetime
    closed: datetime | None
    note: str | None
