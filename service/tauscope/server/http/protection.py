"""What stands before every route: host and origin checks, safe headers, no tracebacks."""

import logging
from collections.abc import Callable, Mapping
from urllib.parse import urlsplit

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from tauscope.server.problems import make_problem, problem_answer

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


class SafeAnswers:
    """Adds the headers of every answer, and turns an unforeseen exception into a problem without internals."""

    def __init__(self, app: ASGIApp) -> None:
        """Wrap an application."""
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request."""
        if scope["type"] != "http":
            return await self.app(scope, receive, send)
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
            answer = problem_answer(make_problem("internal", detail, scope["path"]))
            await answer(scope, receive, send_safely)


class KnownCallers:
    """Turns away requests for other host names (DNS rebinding) and those that a page of another origin makes."""

    def __init__(self, app: ASGIApp, answers_for: Callable[[str | None], bool]) -> None:
        """Wrap an application."""
        self.app = app
        self.answers_for = answers_for

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, or turn it away."""
        if scope["type"] == "http" and (reason := self._reason(Headers(scope=scope))):
            answer = problem_answer(make_problem(*reason, scope["path"]))
            return await answer(scope, receive, send)
        return await self.app(scope, receive, send)

    def _reason(self, headers: Headers) -> tuple[str, str] | None:
        """Code and detail of the problem with the caller, if there is one."""
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
