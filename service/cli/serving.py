"""``tauscope serve``: the HTTP service in this process."""

from pathlib import Path
from typing import Literal

import typer
from pydantic import ValidationError

from service.api.server import serve
from service.api.settings import Settings, default_data_folder


def run_server(
    host: str,
    port: int,
    data: Path | None,
    *,
    backend: Literal["sim", "dynamixel", "canopen"] = "sim",
    sim_time: Literal["virtual", "real"] = "virtual",
    sim_socket: Path | None = None,
) -> None:
    """Serve until interrupted.

    Parameters
    ----------
    host : str
        address to listen at
    port : int
        port to listen at; 0 takes any free one
    data : Path or None
        folder of everything that is kept; the user's own data folder where None
    backend : str
        what moves the arm where a request does not say
    sim_time : str
        of the simulated arm, where a request does not say
    sim_socket : Path or None
        where a simulated arm that runs by the clock listens; one is started for each run where None

    Raises
    ------
    typer.BadParameter
        if a setting is out of its range
    TauscopeError
        if the address cannot be listened at, or is one that others could reach
    """
    try:
        folder = data or default_data_folder()
        settings = Settings(
            data_folder=folder, host=host, port=port, backend=backend, sim_time=sim_time, sim_socket=sim_socket
        )
    except ValidationError as error:
        first = error.errors()[0]
        raise typer.BadParameter(f"{first['loc'][0]}: {first['msg']}") from error
    serve(
        settings, lambda address: typer.echo(f"Tauscope at {address}, documentation at {address}/docs; Ctrl-C ends it")
    )
