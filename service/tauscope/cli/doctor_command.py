"""``tauscope doctor``: its arguments."""

from pathlib import Path
from typing import Annotated

import typer

from tauscope.cli.driver_choice import BusOption

RobotFile = Annotated[
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
    robot: RobotFile = None,
    *,
    backend: BusOption = None,
) -> None:
    """Look at adapters and drives, and say what keeps an arm from running well, each with its remedy.

    Moves nothing and writes nothing. Exit status 1 where something keeps the arm from running.
    """
    from tauscope.cli.doctor_summary import show_findings

    show_findings(robot, backend)
