"""Logs as JSON lines on standard error, one object a line; what looks like a key never leaves the process."""

import logging
import re
import sys
from collections.abc import MutableMapping
from typing import Any, TextIO

import structlog

_SECRET = re.compile(r"tsk_[0-9a-f]{8}_[\w-]+|(?i:bearer)\s+\S+|\b\d+-[A-Za-z0-9_-]{22}\b")
_HIDDEN = "[hidden]"


def log_as_json(level: int = logging.INFO, stream: TextIO | None = None) -> None:
    """Have everything that this process logs written as JSON."""
    shared = [
        structlog.stdlib.add_log_level,
        structlog.stdlib.add_logger_name,
        structlog.stdlib.ExtraAdder(),
        structlog.processors.TimeStamper(fmt="iso", utc=True),
    ]
    formatter = structlog.stdlib.ProcessorFormatter(
        foreign_pre_chain=shared,
        processors=[
            structlog.stdlib.ProcessorFormatter.remove_processors_meta,
            structlog.processors.format_exc_info,
            without_secrets,
            structlog.processors.JSONRenderer(ensure_ascii=False, default=str),
        ],
    )
    handler = logging.StreamHandler(stream or sys.stderr)
    handler.setFormatter(formatter)
    root = logging.getLogger()
    root.handlers[:] = [handler]
    root.setLevel(logging.WARNING)
    logging.getLogger("tauscope").setLevel(level)
    logging.getLogger("uvicorn.error").setLevel(logging.INFO)


def without_secrets(_logger: Any, _method: str, event: MutableMapping[str, Any]) -> MutableMapping[str, Any]:
    """An event without anything that looks like a key or a token."""
    event.pop("color_message", None)  # uvicorn's, for terminals
    for name, value in event.items():
        if isinstance(value, str):
            event[name] = _SECRET.sub(_HIDDEN, value)
        elif not isinstance(value, int | float | bool | None):
            event[name] = _SECRET.sub(_HIDDEN, str(value))
    return event
