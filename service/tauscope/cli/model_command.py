"""``tauscope model``: the history of models on the terminal."""

from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from tauscope.cli.store_command import DatabaseUrl, DataFolder, open_database
from tauscope.cli.terminal import output, say, table
from tauscope.cli.verbs import make_group
from tauscope.errors import StoreError
from tauscope.number_text import ABSENT, counted, significant
from tauscope.report.tables import Table
from tauscope.server.history.drift import parameter_trends
from tauscope.server.history.model_history import ModelEntry, ModelHistory

RobotName = Annotated[str, Argument(metavar="ROBOT", help="Name of the robot, as in its file.")]
Identifier = Annotated[str, Argument(metavar="MODEL", help="Identifier of the identification.")]
Reason = Annotated[str, Option(metavar="TEXT", help="Why; kept with the choice.")]
Count = Annotated[int, Option("--limit", min=1, max=1000, metavar="N", help="Most rows.")]


def list_models(robot: RobotName, data: DataFolder = None, database: DatabaseUrl = None, limit: Count = 20) -> None:
    """Show the models of a robot, the newest first, and why those that were refused were."""
    with open_database(data, database) as opened:
        history = ModelHistory(opened)
        history.policy(robot)
        models = history.models(robot, limit)
    rows = [(entry.identifier, _state(entry), entry.source, _reason(entry)) for entry in models]
    output().print(table(f"Models of {robot}", Table(("model", "state", "measured", "because"), rows, words=4)))


def show_trend(robot: RobotName, data: DataFolder = None, database: DatabaseUrl = None) -> None:
    """Show how every parameter of a robot has changed, from the first active model to the present one."""
    with open_database(data, database) as opened:
        trends = parameter_trends(ModelHistory(opened).documents(robot))
    rows = []
    for trend in trends:
        first, last, line = trend.points[0], trend.points[-1], trend.line
        slope = ABSENT if line is None else f"{significant(line.slope, 3)} ± {significant(line.slope_std, 2)}"
        rows.append((trend.name, str(len(trend.points)), *(significant(end.value, 4) for end in (first, last)), slope))
    columns = ("parameter", "models", "first [SI]", "last [SI]", "change a week")
    output().print(table(f"Parameters of {robot}", Table(columns, rows)))


def show_events(robot: RobotName, data: DataFolder = None, database: DatabaseUrl = None, limit: Count = 20) -> None:
    """Show the drifts of a robot that nobody has taken note of. Exit status 1 where there are any."""
    with open_database(data, database) as opened:
        history = ModelHistory(opened)
        history.policy(robot)
        events = history.events(robot, only_open=True, limit=limit)
    if not events:
        say(f"{robot}: nothing has drifted beyond its bounds")
        return
    for event in events:
        say(event.text)
    hint = "look at the arm; `tauscope model reference` counts from a new model on"
    raise StoreError(f"{robot}: {counted(len(events), 'parameter')} drifted beyond the bounds; {hint}")


def activate_model(
    identifier: Identifier, reason: Reason, data: DataFolder = None, database: DatabaseUrl = None
) -> None:
    """Make a model the active one, also one that was refused; the one before is kept."""
    _choose(identifier, "active", reason, data, database)


def make_reference(
    identifier: Identifier, reason: Reason, data: DataFolder = None, database: DatabaseUrl = None
) -> None:
    """Count drift from this model on, say after maintenance; drifts that are open are closed."""
    _choose(identifier, "reference", reason, data, database)


def _choose(identifier: str, role: str, reason: str, data: Path | None, database: str | None) -> None:
    with open_database(data, database) as opened:
        entry = ModelHistory(opened).activate(identifier, role, reason, datetime.now(UTC))
    noun = "active model" if role == "active" else "reference"
    say(f"{entry.identifier} is the {noun} of {entry.robot}")


def _state(entry: ModelEntry) -> str:
    return f"{entry.state}, reference" if entry.is_reference else entry.state


def _reason(entry: ModelEntry) -> str:
    failed = [f"{gate.name}: {gate.reason}" for gate in entry.gates if not gate.passed]
    return "; ".join(failed) or (ABSENT if entry.state == "unreadable" else "all gates passed")


model = make_group(
    list=list_models,
    trend=show_trend,
    events=show_events,
    activate=activate_model,
    reference=make_reference,
)
