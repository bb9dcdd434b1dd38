"""``tauscope robot``: its arguments."""

import typer

from tauscope.cli.arguments import RobotFile
from tauscope.cli.verbs import add_verb

robot = typer.Typer(help="Look at robot files.", no_args_is_help=True, rich_markup_mode=None)


@robot.callback()
def _robot() -> None:
    """Make `check` a verb of its own, as a second one will be."""


def check(file: RobotFile) -> None:
    """Show what a robot file says, and everything doubtful in it."""
    from tauscope.cli.robot_summary import show_robot

    show_robot(file)


add_verb(robot, check)
