"""The size of bodies, and what becomes of a body that nobody wants to read."""

import anyio
from starlette.datastructures import Headers
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from tauscope.errors import LimitExceededError
from tauscope.server.problems import make_problem, problem_answer

LONGEST_WAIT_S = 30.0
"""How long a client that has its answer may go on sending."""


class BodyLimit:
    """Ends a request whose body is larger than allowed, by its own word or by count, with problem `limit-exceeded`.

    Whenever a request is answered before its body was read, the rest is read and dropped: else a client that is still
    sending would see a broken connection in place of the answer.
    """

    def __init__(self, app: ASGIApp, limit: int) -> None:
        """Wrap an application.

        Parameters
        ----------
        limit : int
            largest body [bytes]
        """
        self.app = app
        self.limit = limit

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, as far as its body is not too large."""
        if scope["type"] != "http":
            return await self.app(scope, receive, send)
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
    """The body of a request on its way to the application."""

    def __init__(self, headers: Headers, receive: Receive, limit: int) -> None:
        self._receive = receive
        self._limit = limit
        self._count = 0
        announced = headers.get("content-length", "")
        length = int(announced) if announced.isdecimal() else 0
        self.is_exceeded = length > limit
        # A client that waits for leave to send its body does not send it after an answer.
        self.is_pending = (length > 0 or "transfer-encoding" in headers) and "expect" not in headers

    async def receive(self) -> Message:
        """The next part, unless it is one too many."""
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
        """The next part, counted."""
        message = await self._receive()
        self._count += len(message.get("body", b""))
        self.is_pending = self.is_pending and bool(message.get("more_body", False))
        return message
