"""Every request is counted, timed and logged under a number of its own, without its query, headers and body."""

import logging
import time
import uuid
from typing import cast

from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from tauscope.server.auth.gate import caller_of
from tauscope.server.http.operations.metrics import Metrics

_log = logging.getLogger("tauscope.requests")

REQUEST_ID = "X-Request-Id"


class Observed:
    """Counts, times and logs requests."""

    def __init__(self, app: ASGIApp) -> None:
        """Wrap an application."""
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request."""
        if scope["type"] != "http":
            return await self.app(scope, receive, send)
        number, began, status, answered = uuid.uuid4().hex, time.monotonic(), 500, None

        async def send_observed(message: Message) -> None:
            nonlocal status, answered
            if message["type"] == "http.response.start":
                status, answered = message["status"], time.monotonic()
                MutableHeaders(scope=message)[REQUEST_ID] = number
            await send(message)

        try:
            await self.app(scope, receive, send_observed)
        finally:
            seconds = (answered or time.monotonic()) - began
            metrics = cast(Metrics, scope["app"].state.services.metrics)
            route = _pattern(scope)
            metrics.requests.labels(scope["method"], route, str(status)).inc()
            metrics.request_seconds.labels(scope["method"], route).observe(seconds)
            details = {"request": number, "method": scope["method"], "path": scope["path"], "status": status}
            _log.info("answered", extra={**details, "seconds": round(seconds, 4), "caller": caller_of(scope).name})


def _pattern(scope: Scope) -> str:
    """The path with its parameters' names in place of their values, of which there may be any number."""
    if scope.get("route") is None:
        return "none"
    path = scope["path"]
    for name, value in reversed(scope.get("path_params", {}).items()):
        before, _, after = path.rpartition(f"/{value}")
        path = f"{before}/{{{name}}}{after}"
    return path
