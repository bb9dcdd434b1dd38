"""``tauscope serve``: its arguments."""

from pathlib import Path
from typing import Annotated

import typer


def serve(
    host: Annotated[
        str, typer.Option(help="Address to listen at; others can reach it unless it is loopback.")
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port to listen at; 0 takes any free one.")] = 8000,
    data: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR", file_okay=False, help="Folder of everything that is kept; the user's own by default."
        ),
    ] = None,
) -> None:
    """Offer identification over HTTP.

    REST under /api/v1, its documentation under /docs.

    Parameters
    ----------
    host : str
        address to listen at
    port : int
        port to listen at
    data : Path or None
        folder of everything that is kept
    """
    from service.cli.serving import run_server

    run_server(host, port, data)
