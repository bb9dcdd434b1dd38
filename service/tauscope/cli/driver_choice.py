"""Options whose choices are the registered drivers: a command reads them when it is called or asked for its help."""

from collections.abc import Collection
from typing import Annotated

import typer
from typer.core import TyperArgument, TyperCommand, TyperOption

DEFAULT_BACKEND = "sim"
"""As `tauscope.runtime.drivers` has it, which is not loaded for a line of help."""


class DriverCommand(TyperCommand):
    """A command whose metavars and help name ``{backends}``, ``{buses}`` or ``{ports}``."""

    def get_params(self, ctx: typer.Context) -> list:
        """The parameters, with the names that the registry has now."""
        params = super().get_params(ctx)
        for param in params:
            if isinstance(param, TyperArgument | TyperOption):  # not --help itself
                param.metavar, param.help = _fill(param.metavar), _fill(param.help)
        return params


def _fill(text: str | None) -> str | None:
    """A text with the names of the drivers."""
    if text is None or "{" not in text:
        return text
    from tauscope.runtime.drivers import bus_drivers, driver_names

    if "{backends}" in text:
        return text.replace("{backends}", "|".join(driver_names()))
    buses = bus_drivers()
    ports = ", ".join(f"{bus.port_help} ({name})" for name, bus in buses.items())
    return text.replace("{buses}", "|".join(buses)).replace("{ports}", ports)


def check_backend(name: str) -> str:
    """Read the name of a driver. Raises typer.BadParameter where there is no such driver."""
    from tauscope.runtime.drivers import driver_names

    return _check(name, driver_names())


def check_bus(name: str) -> str:
    """Read the name of a field bus. Raises typer.BadParameter where there is no such bus."""
    from tauscope.runtime.drivers import bus_drivers

    return _check(name, bus_drivers())


def require_options(backend: str, options: Collection[str]) -> None:
    """Refuse options that a driver does not have. Raises typer.BadParameter naming the drivers that have the option."""
    from tauscope.runtime.drivers import driver_names, find_driver

    for option in options:
        owners = [name for name in driver_names() if option in find_driver(name).option_names]
        if backend not in owners:
            raise typer.BadParameter(f"--{option.replace('_', '-')} belongs to --backend {' or '.join(owners)}")


def _check(name: str, known: Collection[str]) -> str:
    if name not in known:
        raise typer.BadParameter(f"{name!r} is not one of {', '.join(map(repr, known))}.")
    return name


BusOption = Annotated[
    str | None,
    typer.Option(
        parser=check_bus,
        metavar="[{buses}]",
        help="Field bus; the one that the robot file's drives speak of by default.",
    ),
]
"""Which bus, where a robot file's drives do not say it."""
