"""``tauscope serve``: its arguments."""

import os
from pathlib import Path
from typing import Annotated, Literal

import typer

from tauscope.cli.driver_choice import DEFAULT_BACKEND, check_backend
from tauscope.cli.store_command import Kind


def serve(
    *,
    host: Annotated[
        str, typer.Option(help="Address to listen at; one that others can reach needs an API key (tauscope key add).")
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port to listen at; 0 takes any free one.")] = 8000,
    data: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR", file_okay=False, help="Folder of everything that is kept; the user's own by default."
        ),
    ] = None,
    database: Annotated[
        str | None,
        typer.Option(
            metavar="URL",
            envvar="TAUSCOPE_DATABASE",
            show_default=False,
            help="PostgreSQL database; SQLite in the data folder by default.",
        ),
    ] = None,
    backend: Annotated[
        str,
        typer.Option(
            parser=check_backend, metavar="[{backends}]", help="What moves the arm where a request does not say."
        ),
    ] = DEFAULT_BACKEND,
    sim_time: Annotated[
        Literal["virtual", "real"], typer.Option(help="Of the simulated arm, where a request does not say.")
    ] = "virtual",
    sim_socket: Annotated[
        Path | None,
        typer.Option(metavar="SOCKET", help="Where a simulated arm that runs by the clock listens; else one a run."),
    ] = None,
    workers: Annotated[
        int | None, typer.Option(min=1, show_default="one a core", help="Analyses that are worked on at a time.")
    ] = None,
    name: Annotated[
        list[str] | None, typer.Option(metavar="HOST", help="Host name by which it is called too; may be repeated.")
    ] = None,
    tls_certificate: Annotated[
        Path | None, typer.Option(metavar="FILE", dir_okay=False, help="Certificate (PEM); else plain HTTP.")
    ] = None,
    tls_key: Annotated[
        Path | None, typer.Option(metavar="FILE", dir_okay=False, help="Private key of the certificate (PEM).")
    ] = None,
    trusted_proxy: Annotated[
        list[str] | None,
        typer.Option(metavar="ADDRESS", help="Reverse proxy that tells the client's address; may be repeated."),
    ] = None,
    log_format: Annotated[
        Literal["text", "json"], typer.Option(help="Of standard error; json: one object a line, requests included.")
    ] = "text",
    require_lease: Annotated[
        bool, typer.Option("--require-lease", help="Move arms by a lease only, as with API keys, without them too.")
    ] = False,
    requests_per_second: Annotated[
        float | None, typer.Option(min=0.1, help="How often a caller may call; 200 with API keys, else unlimited.")
    ] = None,
    prune_older_than: Annotated[
        float | None,
        typer.Option(min=0.0, metavar="DAYS", help="Remove what ended longer ago, as `tauscope store prune` does."),
    ] = None,
    prune_kind: Annotated[
        list[Kind] | None, typer.Option(help="Kind of item that may go so, once for each; every kind by default.")
    ] = None,
    prune_recordings: Annotated[
        bool, typer.Option("--prune-recordings", help="Recordings too that nothing which stays was made from.")
    ] = False,
) -> None:
    """Offer everything over HTTP.

    REST under /api/v1, its documentation under /docs. When it ends, arms that move are stopped first.
    """
    from pydantic import SecretStr

    from tauscope.cli.serving import run_server

    if prune_older_than is None and (prune_kind or prune_recordings):
        raise typer.BadParameter("--prune-kind and --prune-recordings need --prune-older-than")
    run_server(
        data,
        host=host,
        port=port,
        database=None if database is None else SecretStr(database),
        backend=backend,
        sim_time=sim_time,
        sim_socket=sim_socket,
        workers=workers or len(os.sched_getaffinity(0)),
        names=tuple(name or ()),
        tls_certificate=tls_certificate,
        tls_key=tls_key,
        trusted_proxies=tuple(trusted_proxy or ()),
        log_format=log_format,
        require_lease=require_lease,
        requests_per_s=requests_per_second,
        prune_older_than_days=prune_older_than,
        prune_kinds=tuple(kind.value for kind in prune_kind or ()),
        prune_recordings=prune_recordings,
    )
