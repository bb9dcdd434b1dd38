"""``tauscope doctor``, ``tauscope release`` and ``tauscope bus``: their arguments."""

from pathlib import Path
from typing import Annotated

import typer

from tauscope.cli.arguments import RobotFile
from tauscope.cli.driver_choice import BusOption, DriverCommand, check_bus
from tauscope.cli.verbs import add_verb

DoctorRobotFile = Annotated[
    Path | None,
    typer.Argument(
        metavar="ROBOT",
        exists=True,
        dir_okay=False,
        help="Robot file (YAML) whose drives are looked at; without one, the adapters of this machine.",
        show_default=False,
    ),
]


def doctor(
    robot: DoctorRobotFile = None,
    *,
    backend: BusOption = None,
) -> None:
    """Look at adapters and drives, and say what keeps an arm from running well, each with its remedy.

    Moves nothing and writes nothing. Exit status 1 where something keeps the arm from running.
    """
    from tauscope.cli.device_run import show_findings

    show_findings(robot, backend)


def release(
    robot: RobotFile,
    *,
    backend: BusOption = None,
    supported: Annotated[
        bool, typer.Option("--supported", help="State that the arm is supported; else you are asked.")
    ] = False,
) -> None:
    """Let go of an arm that holds: its drives give no torque any more.

    Support the arm first: joints without a brake fall. Settings that a run changed in servos' EEPROM are put back.
    """
    from tauscope.cli.device_run import release_arm

    release_arm(robot, backend, is_supported=supported)


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
    """
    from tauscope.cli.device_run import show_devices

    show_devices(backend, port, bit_rate)


add_verb(bus, scan, DriverCommand)
