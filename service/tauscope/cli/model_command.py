"""``tauscope model``: its arguments."""

from typing import Annotated

import typer

from tauscope.cli.store_command import DatabaseUrl, DataFolder
from tauscope.cli.verbs import add_verb

model = typer.Typer(
    name="model",
    help="Models of each robot over time: which one is active, and what drifts.",
    no_args_is_help=True,
    rich_markup_mode=None,
)

RobotName = Annotated[str, typer.Argument(metavar="ROBOT", help="Name of the robot, as in its file.")]
Identifier = Annotated[str, typer.Argument(metavar="MODEL", help="Identifier of the identification.")]
Reason = Annotated[str, typer.Option(metavar="TEXT", help="Why; kept with the choice.")]
Count = Annotated[int, typer.Option("--limit", min=1, max=1000, metavar="N", help="Most rows.")]


def list_(robot: RobotName, data: DataFolder = None, database: DatabaseUrl = None, limit: Count = 20) -> None:
    """Show the models of a robot, the newest first, and why those that were refused were."""
    from tauscope.cli.model_run import list_models

    list_models(robot, data, database, limit)


def trend(robot: RobotName, data: DataFolder = None, database: DatabaseUrl = None) -> None:
    """Show how every parameter of a robot has changed, from the first active model to the present one."""
    from tauscope.cli.model_run import show_trend

    show_trend(robot, data, database)


def events(robot: RobotName, data: DataFolder = None, database: DatabaseUrl = None, limit: Count = 20) -> None:
    """Show the drifts of a robot that nobody has taken note of. Exit status 1 where there are any."""
    from tauscope.cli.model_run import show_events

    show_events(robot, data, database, limit)


def activate(identifier: Identifier, reason: Reason, data: DataFolder = None, database: DatabaseUrl = None) -> None:
    """Make a model the active one, also one that was refused; the one before is kept."""
    from tauscope.cli.model_run import choose_model

    choose_model(identifier, "active", reason, data, database)


def reference(identifier: Identifier, reason: Reason, data: DataFolder = None, database: DatabaseUrl = None) -> None:
    """Count drift from this model on, say after maintenance; drifts that are open are closed."""
    from tauscope.cli.model_run import choose_model

    choose_model(identifier, "reference", reason, data, database)


model.command("list", help="Show the models of a robot, and why those that were refused were.")(list_)
for verb in (trend, events, activate, reference):
    add_verb(model, verb)
