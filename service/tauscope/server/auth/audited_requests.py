"""Audited requests: each change leaves an entry, and a motion leaves one before anything moves."""

import logging
from typing import cast

from starlette.concurrency import run_in_threadpool
from starlette.datastructures import Headers
from starlette.types import ASGIApp, Message, Receive, Send
from starlette.types import Scope as AsgiScope

from tauscope.server.auth.audit_log import AuditTrail
from tauscope.server.auth.gate import find_caller
from tauscope.server.auth.scopes import Scope, find_needed_scope, is_stop
from tauscope.server.problems import make_problem, problem_answer

_log = logging.getLogger("tauscope.audit")


class AuditedRequests:
    """Notes who asked for what, and what was answered."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: AsgiScope, receive: Receive, send: Send) -> None:
        """Answer a request."""
        if scope["type"] != "http" or not is_audited(scope["method"], scope["path"]):
            return await self.app(scope, receive, send)
        trail = cast(AuditTrail, scope["app"].state.services.audit)
        method, path = scope["method"], scope["path"]
        actor, action = find_caller(scope).name, f"{method} {path[:300]}"
        address = (scope.get("client") or (None,))[0]
        if _is_asked_first(method, path):
            # Where the log takes nothing, nothing moves: the failure ends the request.
            try:
                await run_in_threadpool(trail.log.append, actor, f"asked: {action}", address=address)
            except OSError as error:
                _log.error("the audit log takes no entry: %s", error.strerror)
                text = "the audit log takes no entry, and nothing moves or goes without one; make room on the disk"
                return await problem_answer(make_problem("storage-full", text, path))(scope, receive, send)
        status, subject = 500, None

        async def send_noting(message: Message) -> None:
            nonlocal status, subject
            if message["type"] == "http.response.start":
                status, subject = message["status"], Headers(raw=message["headers"]).get("location")
            await send(message)

        try:
            await self.app(scope, receive, send_noting)
        finally:
            trail.note(actor, action, address=address, status=status, subject=subject)


def is_audited(method: str, path: str) -> bool:
    """Whether a request leaves an entry: not where it only reads, and not for signs of life."""
    return method not in ("GET", "HEAD", "OPTIONS") and not path.endswith("/heartbeat")


def _is_asked_first(method: str, path: str) -> bool:
    """Whether the entry has to be on the disk before the request is looked at; never so for a stop."""
    scope = find_needed_scope(method, path)
    return scope is not None and scope.includes(Scope.MOVE) and not is_stop(method, path)
