"""What every request passes before its route: who calls, whether they may, not too often; each change is audited."""

import logging
import math
import time
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import cast

from starlette.concurrency import run_in_threadpool
from starlette.datastructures import Headers
from starlette.types import ASGIApp, Message, Receive, Send
from starlette.types import Scope as AsgiScope
from typing_extensions import override

from tauscope.server.auth.audit_log import AuditTrail
from tauscope.server.auth.keys import LOCAL, Caller, KeyRing, Scope, find_needed_scope, is_stop
from tauscope.server.problems import ProblemError, make_problem, problem_answer

MOST_CALLERS = 10_000  # callers that are remembered; the one that was silent longest is forgotten first


class RateLimit:
    """Token buckets. Used by the event loop only, so that it needs no lock."""

    def __init__(self, per_second: float, burst: float, clock: Callable[[], float] = time.monotonic) -> None:
        """Begin with full buckets. `per_second`: how often a caller may call in the long run [1/s]."""
        self._rate, self._burst, self._clock = per_second, burst, clock
        self._buckets: OrderedDict[str, tuple[float, float]] = OrderedDict()

    def take(self, caller: str) -> float:
        """Count a call. Returns float: 0 where the call may pass; else the time after which the next one may [s]."""
        now = self._clock()
        tokens, then = self._buckets.pop(caller, (self._burst, now))
        tokens = min(self._burst, tokens + (now - then) * self._rate)
        wait = 0.0 if tokens >= 1.0 else (1.0 - tokens) / self._rate
        self._buckets[caller] = (tokens if wait else tokens - 1.0, now)
        if len(self._buckets) > MOST_CALLERS:
            self._buckets.popitem(last=False)
        return wait

    def charge(self, caller: str, amount: float) -> None:
        """Count what a call has used beyond itself; who used too much waits before the next one."""
        tokens, then = self._buckets.get(caller, (self._burst, self._clock()))
        self._buckets[caller] = (tokens - amount, then)


CALLER = "tauscope.caller"  # where the request's ASGI scope holds its `Caller`
FAILURES_PER_S, FAILURE_BURST = 0.5, 20.0
"""How often an address may come with a wrong key before it is told to wait; right keys always pass."""


@dataclass(frozen=True, eq=False)
class Access:
    ring: KeyRing
    rate: RateLimit
    limits_local: bool = False
    uploads: RateLimit | None = None
    failures: RateLimit = field(default_factory=lambda: RateLimit(FAILURES_PER_S, FAILURE_BURST))


class HttpMiddleware:
    """Answers requests over HTTP; whatever else comes to the application passes."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: AsgiScope, receive: Receive, send: Send) -> None:
        await (self.answer if scope["type"] == "http" else self.app)(scope, receive, send)

    async def answer(self, scope: AsgiScope, receive: Receive, send: Send) -> None:
        raise NotImplementedError

    async def refuse(self, problem: ProblemError, scope: AsgiScope, receive: Receive, send: Send) -> None:
        answer = problem_answer(make_problem(problem.code, problem.detail, scope["path"]), problem.headers)
        await answer(scope, receive, send)


class Gate(HttpMiddleware):
    @override
    async def answer(self, scope: AsgiScope, receive: Receive, send: Send) -> None:
        outcome = _admit(cast(Access, scope["app"].state.services.access), scope)
        if isinstance(outcome, ProblemError):
            _note_refusal(scope, outcome)
            return await self.refuse(outcome, scope, receive, send)
        scope[CALLER] = outcome
        return await self.app(scope, receive, send)


def find_caller(scope: AsgiScope) -> Caller:
    return cast(Caller, scope.get(CALLER, LOCAL))


def _admit(access: Access, scope: AsgiScope) -> Caller | ProblemError:
    method, path = scope["method"], scope["path"]
    needed = find_needed_scope(method, path)
    if needed is None:
        return LOCAL
    stops = is_stop(method, path)
    caller = access.ring.caller(_key(Headers(scope=scope)), may_be_expired=stops)
    if isinstance(caller, str):
        wait = access.failures.take((scope.get("client") or ("",))[0])
        return (
            _too_often(wait) if wait else ProblemError("unauthorized", caller, headers={"WWW-Authenticate": "Bearer"})
        )
    if not caller.scope.includes(needed):
        text = f"{method} {path} needs a key of scope {needed}; the one of {caller.name} has {caller.scope}"
        return ProblemError("forbidden", text)
    # Whoever wants to stop an arm is never told to wait.
    if stops or (caller.key is None and not access.limits_local):
        return caller
    wait = access.rate.take(caller.key or caller.name)
    return _too_often(wait) if wait else caller


def _note_refusal(scope: AsgiScope, refusal: ProblemError) -> None:
    """Have it known who tried what; whoever only has to wait is not worth an entry."""
    if refusal.code != "rate-limited":
        audit, address = cast(AuditTrail, scope["app"].state.services.audit), (scope.get("client") or (None,))[0]
        action = f"refused: {scope['method']} {scope['path'][:300]}"
        audit.note("somebody", action, address=address, reason=refusal.code)


def _key(headers: Headers) -> str | None:
    """The key of a request; a header that came twice is none."""
    values = headers.getlist("authorization")
    scheme, _, key = values[0].partition(" ") if len(values) == 1 else ("", "", "")
    return key.strip() if scheme.lower() == "bearer" and key.strip() else None


def require_upload_quota(scope: AsgiScope) -> Callable[[int], None]:
    """Counts what a caller sends [bytes]. Raises ProblemError if it has sent enough for now."""
    access, caller = cast(Access, scope["app"].state.services.access), find_caller(scope)
    quota, key = access.uploads, caller.key or caller.name
    if quota is None or (caller.key is None and not access.limits_local):
        return lambda _: None
    wait = quota.take(key)
    if wait:
        text = f"{caller.name} has sent as much as it may in a day; go on after {math.ceil(wait)} s"
        raise ProblemError("rate-limited", text, headers={"Retry-After": str(math.ceil(wait))})
    return partial(quota.charge, key)


def _too_often(wait_s: float) -> ProblemError:
    seconds = max(1, math.ceil(wait_s))
    headers = {"Retry-After": str(seconds)}
    return ProblemError("rate-limited", f"too many requests; go on after {seconds} s", headers=headers)


_log = logging.getLogger("tauscope.audit")


class AuditedRequests(HttpMiddleware):
    @override
    async def answer(self, scope: AsgiScope, receive: Receive, send: Send) -> None:
        if not is_audited(scope["method"], scope["path"]):
            return await self.app(scope, receive, send)
        trail = cast(AuditTrail, scope["app"].state.services.audit)
        method, path = scope["method"], scope["path"]
        actor, action = find_caller(scope).name, f"{method} {path[:300]}"
        address = (scope.get("client") or (None,))[0]
        needed = find_needed_scope(method, path)
        # Never so for a stop. Where the log takes nothing, nothing moves: the failure ends the request.
        if needed is not None and needed.includes(Scope.MOVE) and not is_stop(method, path):
            try:
                await run_in_threadpool(trail.log.append, actor, f"asked: {action}", address=address)
            except OSError as error:
                _log.error("the audit log takes no entry: %s", error.strerror)
                text = "the audit log takes no entry, and nothing moves or goes without one; make room on the disk"
                return await self.refuse(ProblemError("storage-full", text), scope, receive, send)
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
