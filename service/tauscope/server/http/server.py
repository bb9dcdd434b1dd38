"""The application behind a socket, and its logs as JSON."""

import gc
import logging
import re
import socket
import ssl
import sys
from collections.abc import Callable, MutableMapping
from contextlib import AsyncExitStack
from typing import Any, TextIO

import structlog
import uvicorn
from fastapi import FastAPI
from uvicorn.config import LOGGING_CONFIG

from tauscope.errors import TauscopeError
from tauscope.server.http.app import create_app
from tauscope.server.http.services import Services, require_data_folder
from tauscope.server.http.settings import Settings

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
        if isinstance(value, str):
            event[name] = _SECRET.sub(_HIDDEN, value)
        elif not isinstance(value, int | float | bool | None):
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
