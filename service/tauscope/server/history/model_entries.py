"""What the history of models gives out, as plain data."""

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from tauscope.server.history import Gate


@dataclass(frozen=True)
class ModelEntry:
    """A model of a robot."""

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
    """Something about a robot that people should know."""

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
