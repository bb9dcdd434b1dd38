"""``tauscope serve``: the HTTP service in this process."""

from pathlib import Path

import typer
from pydantic import ValidationError

from service.api.server import serve
from service.api.settings import Settings, default_data_folder


def run_server(host: str, port: int, data: Path | None) -> None:
    """Serve until interrupted.

    Parameters
    ----------
    host : str
        address to listen at
    port : int
        port to listen at; 0 takes any free one
    data : Path or None
        folder of everything that is kept; the user's own data folder where None

    Raises
    ------
    typer.BadParameter
        if a setting is out of its range
    TauscopeError
        if the address cannot be listened at, or is one that others could reach
    """
    try:
        settings = Settings(data_folder=data or default_data_folder(), host=host, port=port)
    except ValidationError as error:
        first = error.errors()[0]
        raise typer.BadParameter(f"{first['loc'][0]}: {first['msg']}") from error
    serve(
        settings, lambda address: typer.echo(f"Tauscope at {address}, documentation at {address}/docs; Ctrl-C ends it")
    )
