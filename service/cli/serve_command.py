"""``tauscope serve``: its arguments."""

from pathlib import Path
from typing import Annotated, Literal

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
    backend: Annotated[
        Literal["sim", "dynamixel", "canopen"], typer.Option(help="What moves the arm where a request does not say.")
    ] = "sim",
    sim_time: Annotated[
        Literal["virtual", "real"], typer.Option(help="Of the simulated arm, where a request does not say.")
    ] = "virtual",
    sim_socket: Annotated[
        Path | None,
        typer.Option(metavar="SOCKET", help="Where a simulated arm that runs by the clock listens; else one a run."),
    ] = None,
) -> None:
    """Offer everything over HTTP.

    REST under /api/v1, its documentation under /docs. When it ends, arms that move are stopped first.

    Parameters
    ----------
    host : str
        address to listen at
    port : int
        port to listen at
    data : Path or None
        folder of everything that is kept
    backend : str
        ``sim``, ``dynamixel`` or ``canopen``
    sim_time : str
        ``virtual`` or ``real``
    sim_socket : Path or None
        where a simulated arm that runs by the clock listens
    """
    from service.cli.serving import run_server

    run_server(host, port, data, backend=backend, sim_time=sim_time, sim_socket=sim_socket)
