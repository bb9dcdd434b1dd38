"""``tauscope release``: its arguments."""

from typing import Annotated

import typer

from tauscope.cli.arguments import RobotFile
from tauscope.cli.driver_choice import BusOption


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
    from tauscope.cli.release_run import release_arm

    release_arm(robot, backend, is_supported=supported)
