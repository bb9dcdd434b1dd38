"""Middleware before every route: request log, safe headers, host and origin, body size, and concurrent readers."""

import asyncio
import logging
import time
import uuid
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from typing import cast
from urllib.parse import urlsplit

import anyio
from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from typing_extensions import override

from tauscope.errors import LimitExceededError
from tauscope.server.auth.gate import HttpMiddleware, find_caller
from tauscope.server.http.metrics import Metrics
from tauscope.server.problems import ProblemError, make_problem, problem_answer

_request_log = logging.getLogger("tauscope.requests")
REQUEST_ID = "X-Request-Id"


class RequestLog(HttpMiddleware):
    @override
    async def answer(self, scope: Scope, receive: Receive, send: Send) -> None:
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
            _request_log.info(
                "answered", extra={**details, "seconds": round(seconds, 4), "caller": find_caller(scope).name}
            )


def _pattern(scope: Scope) -> str:
    """The path with its parameters' names in place of their values, of which there may be any number."""
    if scope.get("route") is None:
        return "none"
    path = scope["path"]
    for name, value in reversed(scope.get("path_params", {}).items()):
        before, _, after = path.rpartition(f"/{value}")
        path = f"{before}/{{{name}}}{after}"
    return path


_log = logging.getLogger("tauscope.api")

HEADERS: Mapping[str, str] = {
    "X-Content-Type-Options": "nosniff",
    "Cache-Control": "no-store",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    # The page is made of files of our own; nothing inline is run or styled, whatever a robot is called.
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:;"
    " font-src 'self'; connect-src 'self'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'",
    "X-Frame-Options": "DENY",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Permissions-Policy": "camera=(), geolocation=(), microphone=(), usb=(), serial=()",
}


class ResponseProtection(HttpMiddleware):
    """Adds the headers of every answer, and turns an unforeseen exception into a problem without internals."""

    @override
    async def answer(self, scope: Scope, receive: Receive, send: Send) -> None:
        has_begun = False

        async def send_safely(message: Message) -> None:
            nonlocal has_begun
            if message["type"] == "http.response.start":
                has_begun = True
                headers = MutableHeaders(scope=message)
                for name, value in HEADERS.items():
                    headers.setdefault(name, value)
            await send(message)

        try:
            await self.app(scope, receive, send_safely)
        except Exception:
            _log.exception("%s %s failed for an unforeseen reason", scope["method"], scope["path"])
            if has_begun:
                raise
            detail = "the request met a fault of Tauscope's own; the service's log has the details"
            await self.refuse(ProblemError("internal", detail), scope, receive, send_safely)


class OriginCheck(HttpMiddleware):
    """Turns away requests for other host names (DNS rebinding) and those that a page of another origin makes."""

    def __init__(self, app: ASGIApp, answers_for: Callable[[str | None], bool]) -> None:
        super().__init__(app)
        self.answers_for = answers_for

    @override
    async def answer(self, scope: Scope, receive: Receive, send: Send) -> None:
        if reason := self._reason(Headers(scope=scope)):
            return await self.refuse(ProblemError(*reason), scope, receive, send)
        return await self.app(scope, receive, send)

    def _reason(self, headers: Headers) -> tuple[str, str] | None:
        host, origin = headers.get("host", ""), headers.get("origin")
        if not self.answers_for(_host_name(f"//{host}")):
            return "host", f"this service does not answer for the host {host!r}; call it by the address it listens at"
        own = origin is None or origin.lower() in (f"http://{host.lower()}", f"https://{host.lower()}")
        if not own or headers.get("sec-fetch-site", "none") not in ("none", "same-origin"):
            return "origin", "a page of another origin made this request; open the service's own address"
        return None


def _host_name(address: str) -> str | None:
    """Host name or address of a URL, in lower case; None where it makes no sense."""
    try:
        parts = urlsplit(address)
        has_junk = bool(parts.path or parts.query or parts.fragment or parts.username is not None)
        return None if has_junk or (parts.port is not None and parts.port < 0) else parts.hostname
    except ValueError:
        return None


LONGEST_WAIT_S = 30.0  # how long a client that has its answer may go on sending


class BodyLimit(HttpMiddleware):
    """Ends a request whose body is too large; reads the rest, else a client that sends sees a broken connection."""

    def __init__(self, app: ASGIApp, limit: int) -> None:
        super().__init__(app)
        self.limit = limit

    @override
    async def answer(self, scope: Scope, receive: Receive, send: Send) -> None:
        body = _CountedBody(Headers(scope=scope), receive, self.limit)

        async def send_unless_exceeded(message: Message) -> None:
            # Whatever the application makes of the broken body, the client is told what broke it.
            if not body.is_exceeded:
                await self._send(message, body, send)

        if not body.is_exceeded:
            try:
                await self.app(scope, body.receive, send_unless_exceeded)
            except LimitExceededError:
                if not body.is_exceeded:
                    raise
        if body.is_exceeded:
            detail = f"the body is larger than the {self.limit} bytes accepted here; send fewer or shorter recordings"
            answer = problem_answer(make_problem("limit-exceeded", detail, scope["path"]), {"Connection": "close"})
            await send({"type": "http.response.start", "status": answer.status_code, "headers": answer.raw_headers})
            await self._send({"type": "http.response.body", "body": answer.body}, body, send)

    async def _send(self, message: Message, body: "_CountedBody", send: Send) -> None:
        """Send a part of an answer; before the answer ends, the request's body does."""
        if message["type"] == "http.response.body" and not message.get("more_body", False) and body.is_pending:
            await send({**message, "more_body": True})
            with anyio.move_on_after(LONGEST_WAIT_S):
                await body.swallow()
            message = {"type": "http.response.body", "body": b""}
        await send(message)


class _CountedBody:
    def __init__(self, headers: Headers, receive: Receive, limit: int) -> None:
        self._receive, self._limit = receive, limit
        self._count = 0
        announced = headers.get("content-length", "")
        length = int(announced) if announced.isdecimal() else 0
        self.is_exceeded = length > limit
        # A client that waits for leave to send its body does not send it after an answer.
        self.is_pending = (length > 0 or "transfer-encoding" in headers) and "expect" not in headers

    async def receive(self) -> Message:
        message = await self._next()
        if self._count > self._limit:
            self.is_exceeded = True
            raise LimitExceededError("the body is too large")
        return message

    async def swallow(self) -> None:
        """Read on until the body ends, the client is gone, or as much again as is allowed has come."""
        while self.is_pending and self._count <= 2 * self._limit:
            await self._next()

    async def _next(self) -> Message:
        message = await self._receive()
        self._count += len(message.get("body", b""))
        self.is_pending = self.is_pending and bool(message.get("more_body", False))
        return message


READERS = 2  # reading requests at a time: more threads of one interpreter read no faster
SLOT_TIMEOUT_S = 0.5  # a reader that a disk or a lock holds up loses its slot after this time [s]
_READING = ("GET", "HEAD")
_PROBES = ("/healthz", "/readyz")
"""Probes have a slot of their own: a supervisor that gets no answer restarts the service, which stops its arms."""


class ConcurrencyLimiter(HttpMiddleware):
    """Admits a few readers at a time, until their answers begin: a stream keeps nobody waiting; others pass."""

    def __init__(
        self,
        app: ASGIApp,
        readers: int = READERS,
        slot_timeout_s: float = SLOT_TIMEOUT_S,
        is_closing: Callable[[], bool] = lambda: False,
    ) -> None:
        """Admit `readers` at a time; one that is stuck keeps its slot for `slot_timeout_s` [s]."""
        super().__init__(app)
        self._is_closing = is_closing
        self._slots, self._probes = asyncio.Semaphore(readers), asyncio.Semaphore(1)
        self._slot_timeout_s = slot_timeout_s

    @override
    async def answer(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["method"] not in _READING:
            return await self.app(scope, receive, send)
        slots = self._probes if scope["path"] in _PROBES else self._slots
        await slots.acquire()
        if slots is self._slots and self._is_closing():  # hundreds that wait would hold up the end
            slots.release()
            text = "the service is ending; ask again when it has started"
            problem = ProblemError("not-ready", text, headers={"Retry-After": "5"})
            return await self.refuse(problem, scope, receive, send)
        slot = ExitStack()  # let go of once, however often that is asked for
        slot.callback(slots.release)
        timer = asyncio.get_running_loop().call_later(self._slot_timeout_s, slot.close)

        async def send_and_free_slot(message: Message) -> None:
            slot.close()
            await send(message)

        try:
            await self.app(scope, receive, send_and_free_slot)
        finally:
            timer.cancel()
            slot.close()
