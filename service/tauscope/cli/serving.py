"""``tauscope serve``: the HTTP service in this process."""

from pathlib import Path
from typing import Any

import typer
from pydantic import ValidationError

from tauscope.server.http.server import serve
from tauscope.server.http.settings import Settings, default_data_folder


def run_server(data: Path | None, **choices: Any) -> None:
    """Serve until interrupted.

    Raises typer.BadParameter if a setting is out of its range. Raises TauscopeError if the address cannot be listened
    at, or is one that others could reach without a key.
    """
    try:
        settings = Settings(data_folder=data or default_data_folder(), **choices)
    except ValidationError as error:
        first = error.errors()[0]
        raise typer.BadParameter(f"{first['loc'][0]}: {first['msg']}") from error
    serve(settings, lambda address: _announce(settings, address))


def _announce(settings: Settings, address: str) -> None:
    """Say where the service is, and who could listen."""
    if not settings.is_local and settings.tls_certificate is None:
        hint = "give --tls-certificate, or put a proxy in front that does TLS (deploy/)"
        typer.echo(f"warning: whoever listens on the network of {settings.host} sees keys and data; {hint}", err=True)
    typer.echo(f"Tauscope at {address}, documentation at {address}/docs; Ctrl-C ends it")
