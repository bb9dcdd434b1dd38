"""``tauscope serve``: the HTTP service in this process."""

import os
from pathlib import Path
from typing import Annotated, Any

import typer
from pydantic import SecretStr, ValidationError
from typer import Option

from tauscope.cli.access_command import DataFolder
from tauscope.cli.store_command import DatabaseUrl, Kind
from tauscope.cli.verbs import OptionsOf
from tauscope.server.http import app
from tauscope.server.http.settings import Settings, default_data_folder

# Settings whose options have the same name.
_DIRECT = (
    *("host", "port", "backend", "sim_time", "sim_socket", "tls_certificate", "tls_key"),
    *("log_format", "require_lease", "prune_recordings"),
)


def serve(
    *,
    options: Annotated[dict[str, Any], OptionsOf(Settings, _DIRECT)],
    data: DataFolder = None,
    database: DatabaseUrl = None,
    workers: Annotated[int | None, Option(min=1, show_default="one a core", help="Analyses at a time.")] = None,
    name: Annotated[list[str] | None, Option(metavar="HOST", help="Further host name; may be repeated.")] = None,
    trusted_proxy: Annotated[
        list[str] | None,
        Option(metavar="ADDRESS", help="Reverse proxy that tells the client's address; may be repeated."),
    ] = None,
    requests_per_second: Annotated[
        float | None, Option(min=0.1, help="How often a caller may call; 200 with API keys, else unlimited.")
    ] = None,
    prune_older_than: Annotated[
        float | None,
        Option(min=0.0, metavar="DAYS", help="Remove what ended longer ago, as `tauscope store prune` does."),
    ] = None,
    prune_kind: Annotated[
        list[Kind] | None, Option(help="Kind that may go so; repeatable; default: every kind.")
    ] = None,
) -> None:
    """Offer everything over HTTP.

    REST under /api/v1, its documentation under /docs. When it ends, arms that move are stopped first.
    """
    if prune_older_than is None and (prune_kind or options["prune_recordings"]):
        raise typer.BadParameter("--prune-kind and --prune-recordings need --prune-older-than")
    run_server(
        data,
        database=None if database is None else SecretStr(database),
        workers=workers or len(os.sched_getaffinity(0)),
        names=tuple(name or ()),
        trusted_proxies=tuple(trusted_proxy or ()),
        requests_per_s=requests_per_second,
        prune_older_than_days=prune_older_than,
        prune_kinds=tuple(kind.value for kind in prune_kind or ()),
        **options,
    )


def run_server(data: Path | None, **choices: Any) -> None:
    """Serve until interrupted. Raises typer.BadParameter or TauscopeError if a setting is not possible."""
    try:
        settings = Settings(data_folder=data or default_data_folder(), **choices)
    except ValidationError as error:
        first = error.errors()[0]
        raise typer.BadParameter(f"{first['loc'][0]}: {first['msg']}") from error
    app.serve(settings, lambda address: _announce(settings, address))


def _announce(settings: Settings, address: str) -> None:
    if not settings.is_local and settings.tls_certificate is None:
        hint = "give --tls-certificate, or put a proxy in front that does TLS (deploy/)"
        typer.echo(f"warning: whoever listens on the network of {settings.host} sees keys and data; {hint}", err=True)
    typer.echo(f"Tauscope at {address}, documentation at {address}/docs; Ctrl-C ends it")
