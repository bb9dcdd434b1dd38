"""``tauscope bus``: its arguments."""

from typing import Annotated

import typer

from tauscope.cli.driver_choice import DriverCommand, check_bus
from tauscope.cli.verbs import add_verb

bus = typer.Typer(help="Look at field buses.", no_args_is_help=True, rich_markup_mode=None)


@bus.callback()
def _bus() -> None:
    """Make `scan` a verb of its own, as a second one will be."""


def scan(
    backend: Annotated[str, typer.Argument(parser=check_bus, metavar="BUS", help="{buses}.")],
    port: Annotated[
        str,
        typer.Argument(metavar="PORT", help="{ports}."),
    ],
    *,
    bit_rate: Annotated[
        list[int] | None,
        typer.Option(metavar="RATE", min=1, help="Bit rate to try; may be repeated. The usual ones by default."),
    ] = None,
) -> None:
    """Show every device that answers on a bus.

    Moves nothing and writes nothing. Exit status 1 where nobody answers.

    Parameters
    ----------
    bit_rate : list of int or None
        to try [bit/s]
    """
    from tauscope.cli.bus_summary import show_devices

    show_devices(backend, port, bit_rate)


add_verb(bus, scan, DriverCommand)
