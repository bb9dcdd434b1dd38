"""The application behind a socket."""

import socket
from collections.abc import Callable

import uvicorn
from fastapi import FastAPI

from service.api.app import create_app
from service.api.services import Services, require_data_folder
from service.api.settings import Settings
from service.errors import TauscopeError

GRACE_S = 5
"""How long open requests may take when the service is asked to stop."""


def serve(settings: Settings, announce: Callable[[str], None]) -> None:
    """Answer requests until SIGINT or SIGTERM.

    Parameters
    ----------
    settings : Settings
        of the operator
    announce : callable
        told the service's address once it listens

    Raises
    ------
    TauscopeError
        if the address is not loopback or cannot be had, or another service works with the data folder
    """
    settings.require_loopback()
    require_data_folder(settings)
    with _listening(settings) as listener:
        app = create_app(settings)
        config = uvicorn.Config(
            app,
            log_level="warning",
            server_header=False,
            proxy_headers=False,
            timeout_graceful_shutdown=GRACE_S,
        )
        host, port = listener.getsockname()[:2]
        announce(f"http://{f'[{host}]' if ':' in host else host}:{port}")
        _Server(config, app).run(sockets=[listener])


class _Server(uvicorn.Server):
    """Stops the arms as soon as it is asked to end, before it waits for open requests."""

    def __init__(self, config: uvicorn.Config, app: FastAPI) -> None:
        super().__init__(config)
        self._app = app

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Stop the arms, then everything else."""
        services: Services | None = getattr(self._app.state, "services", None)
        if services is not None:
            services.begin_to_close()
        await super().shutdown(sockets)


def _listening(settings: Settings) -> socket.socket:
    """A socket that listens at the address."""
    family = socket.AF_INET6 if ":" in settings.host else socket.AF_INET
    listener = socket.socket(family, socket.SOCK_STREAM)
    try:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind((settings.host.strip("[]"), settings.port))
        listener.listen()
    except OSError as error:
        listener.close()
        where = f"{settings.host}:{settings.port}"
        raise TauscopeError(f"{where}: cannot listen there ({error.strerror}); give another port") from None
    return listener
