"""The application, routes, problems and protection put together, and the server that runs it."""

import gc
import logging
import re
import socket
import ssl
import sys
from collections.abc import AsyncIterator, Callable, MutableMapping
from concurrent.futures import Executor
from contextlib import AsyncExitStack, asynccontextmanager
from typing import Any, TextIO

import structlog
import uvicorn
from fastapi import Depends, FastAPI
from uvicorn.config import LOGGING_CONFIG

from tauscope.errors import TauscopeError
from tauscope.server.auth.gate import AuditedRequests, Gate
from tauscope.server.control.run_manager import StartControl
from tauscope.server.http import (
    analyses,
    campaigns,
    excitations,
    health,
    history,
    items,
    leases,
    pages,
    recordings,
    robots,
    runs,
    schedules,
)
from tauscope.server.http.answers import ROOT
from tauscope.server.http.openapi import install_openapi
from tauscope.server.http.problem_handlers import install_problem_handlers, require_known_query
from tauscope.server.http.protection import BodyLimit, ConcurrencyLimiter, OriginCheck, RequestLog, ResponseProtection
from tauscope.server.http.readiness import notify_systemd
from tauscope.server.http.repeated_requests import IdempotentRequests
from tauscope.server.http.services import Services, open_services, require_data_folder
from tauscope.server.http.settings import Settings
from tauscope.server.page.router import router as page

API_VERSION = "1.26.0"
"""Of the interface, not of the package; a change of tests/server/http/openapi.json goes with a change here."""
VERBS = (
    *(module.router for module in (campaigns, excitations, runs, recordings)),
    *analyses.routers,
    *(module.router for module in (robots, items, history, schedules, leases)),
    *(recordings.mapping_router, leases.stop_router),
)
"""Routers of everything that a client may ask for, below `ROOT`."""
PAGES = (health.router, pages.router, page)


def create_app(settings: Settings, executor: Executor | None = None, start: StartControl | None = None) -> FastAPI:
    """The application; it takes the data folder when it starts and lets go of it when it stops."""

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        with open_services(settings, executor, start) as services:
            app.state.services = services
            async with services.heartbeat.keep_beating(), notify_systemd():
                yield

    def is_closing() -> bool:
        return app.state.services.closing.is_set()

    app = FastAPI(
        title="Tauscope",
        summary="Finds a robot arm's true dynamics from its own motion.",
        description="Every failed request is answered with a problem (RFC 9457). SI units; joint numbers start at 1.",
        version=API_VERSION,
        lifespan=lifespan,
        generate_unique_id_function=lambda route: route.name,  # generated clients call their functions so
        docs_url=None,
        redoc_url=None,
    )
    for router in VERBS:
        app.include_router(router, prefix=ROOT, dependencies=[Depends(require_known_query)])
    for router in PAGES:
        app.include_router(router)
    install_problem_handlers(app)
    install_openapi(app)
    # The last one added is the first to see a request.
    app.add_middleware(IdempotentRequests)
    app.add_middleware(AuditedRequests)
    app.add_middleware(Gate)
    app.add_middleware(BodyLimit, limit=settings.max_upload_bytes)
    app.add_middleware(OriginCheck, answers_for=settings.answers_for)
    app.add_middleware(ConcurrencyLimiter, is_closing=is_closing)
    app.add_middleware(RequestLog)
    app.add_middleware(ResponseProtection)
    return app


_SECRET = re.compile(r"tsk_[0-9a-f]{8}_[\w-]+|(?i:bearer)\s+\S+|\b\d+-[A-Za-z0-9_-]{22}\b")
_HIDDEN = "[hidden]"


def log_as_json(level: int = logging.INFO, stream: TextIO | None = None) -> None:
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
            hide_secrets,
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


def hide_secrets(_logger: Any, _method: str, event: MutableMapping[str, Any]) -> MutableMapping[str, Any]:
    """An event without anything that looks like a key or a token."""
    event.pop("color_message", None)  # uvicorn's, for terminals
    for name, value in event.items():
        if not isinstance(value, int | float | bool | None):
            event[name] = _SECRET.sub(_HIDDEN, str(value))
    return event


GRACE_S = 5  # how long open requests may take when the service is asked to stop
SWITCH_S = 0.0005
"""How long a thread computes while the event loop waits for the interpreter [s]; Python's own 5 ms add up in a stop."""


def serve(settings: Settings, announce: Callable[[str], None]) -> None:
    """Answer requests until SIGINT or SIGTERM. Raises TauscopeError if the service cannot start."""
    _check_certificate(settings)
    require_data_folder(settings)
    if settings.log_format == "json":
        log_as_json()
    with _listen(settings) as listener:
        app = create_app(settings)
        config = uvicorn.Config(
            app,
            log_level="warning" if settings.log_format == "text" else None,
            log_config=LOGGING_CONFIG if settings.log_format == "text" else None,
            access_log=False,
            server_header=False,
            # Nobody's word on an address is believed but that of proxies that the operator named.
            proxy_headers=bool(settings.trusted_proxies),
            forwarded_allow_ips=list(settings.trusted_proxies),
            ssl_certfile=settings.tls_certificate,
            ssl_keyfile=settings.tls_key,
            timeout_graceful_shutdown=GRACE_S,
            lifespan="off",  # `_Server` opens the services: uvicorn would log a traceback for a foreseen failure
        )
        host, port = listener.getsockname()[:2]
        scheme = "http" if settings.tls_certificate is None else "https"
        # What there is now stays until the end: to look through all of it again and again would hold up everything, a
        # stop too, for a fifth of a second each time.
        gc.collect()
        gc.freeze()
        sys.setswitchinterval(SWITCH_S)
        address = f"{scheme}://{f'[{host}]' if ':' in host else host}:{port}"
        _Server(config, app, lambda: announce(address)).run(sockets=[listener])


class _Server(uvicorn.Server):
    """Opens the services before it answers, and stops the arms as soon as it is asked to end."""

    def __init__(self, config: uvicorn.Config, app: FastAPI, announce: Callable[[], None]) -> None:
        super().__init__(config)
        self._app, self._announce = app, announce
        self._open = AsyncExitStack()

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Announce only once the services are open and answer. Raises TauscopeError if they cannot be opened."""
        await self._open.enter_async_context(self._app.router.lifespan_context(self._app))
        try:
            await super().startup(sockets)
            if self.started:
                self._announce()
        except BaseException:
            await self._open.aclose()
            raise
        if not self.started:  # it was asked to end meanwhile
            await self._open.aclose()

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        services: Services | None = getattr(self._app.state, "services", None)
        if services is not None:
            services.begin_to_close()
        await super().shutdown(sockets)
        await self._open.aclose()


def _check_certificate(settings: Settings) -> None:
    if (settings.tls_certificate is None) != (settings.tls_key is None):
        raise TauscopeError("TLS: certificate and key belong together; give --tls-certificate and --tls-key")
    if settings.tls_certificate is None:
        return
    try:
        ssl.create_default_context(ssl.Purpose.CLIENT_AUTH).load_cert_chain(settings.tls_certificate, settings.tls_key)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise TauscopeError(f"{settings.tls_certificate}: no usable certificate with its key ({reason})") from None


def _listen(settings: Settings) -> socket.socket:
    family = socket.AF_INET6 if ":" in settings.host else socket.AF_INET
    # With the protocol named, answers are sent at once (TCP_NODELAY); asyncio would let them wait for each other else.
    listener = socket.socket(family, socket.SOCK_STREAM, socket.IPPROTO_TCP)
    try:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind((settings.host.strip("[]"), settings.port))
        listener.listen()
    except OSError as error:
        listener.close()
        where = f"{settings.host}:{settings.port}"
        raise TauscopeError(f"{where}: cannot listen there ({error.strerror}); give another port") from None
    return listener
