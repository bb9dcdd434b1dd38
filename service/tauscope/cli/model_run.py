"""``tauscope model``: the history of models on the terminal."""

from datetime import UTC, datetime
from pathlib import Path

from tauscope.cli.store_run import open_database
from tauscope.cli.terminal import output, plain, table
from tauscope.errors import StoreError
from tauscope.number_text import ABSENT, counted, significant
from tauscope.report.tables import Table
from tauscope.server.history.model_history import ModelEntry, ModelHistory
from tauscope.server.history.trend import parameter_trends


def list_models(robot: str, data: Path | None, database: str | None, limit: int) -> None:
    """Show the models of a robot.

    Raises NotFoundError if nothing is kept about this robot. Raises StoreError if the database cannot be used.
    """
    with open_database(data, database) as opened:
        history = ModelHistory(opened)
        history.policy(robot)
        models = history.models(robot, limit)
    rows = [(entry.identifier, _state(entry), entry.source, _reason(entry)) for entry in models]
    output().print(table(f"Models of {robot}", Table(("model", "state", "measured", "because"), rows, words=4)))


def show_trend(robot: str, data: Path | None, database: str | None) -> None:
    """Show how every parameter of a robot has changed.

    Raises NotFoundError if nothing is kept about this robot. Raises StoreError if the database cannot be used.
    """
    with open_database(data, database) as opened:
        trends = parameter_trends(ModelHistory(opened).documents(robot))
    rows = []
    for trend in trends:
        first, last, line = trend.points[0][1], trend.points[-1][1], trend.line
        slope = ABSENT if line is None else f"{significant(line.slope, 3)} ± {significant(line.slope_std, 2)}"
        rows.append(
            (trend.name, str(len(trend.points)), significant(first.value, 4), significant(last.value, 4), slope)
        )
    columns = ("parameter", "models", "first [SI]", "last [SI]", "change a week")
    output().print(table(f"Parameters of {robot}", Table(columns, rows)))


def show_events(robot: str, data: Path | None, database: str | None, limit: int) -> None:
    """Show the drifts of a robot that nobody has taken note of.

    Raises NotFoundError if nothing is kept about this robot. Raises StoreError if there are any, or the database cannot
    be used.
    """
    with open_database(data, database) as opened:
        history = ModelHistory(opened)
        history.policy(robot)
        events = history.events(robot, only_open=True, limit=limit)
    if not events:
        output().print(plain(f"{robot}: nothing has drifted beyond its bounds"), soft_wrap=True)
        return
    for event in events:
        output().print(plain(event.text), soft_wrap=True)
    hint = "look at the arm; `tauscope model reference` counts from a new model on"
    raise StoreError(f"{robot}: {counted(len(events), 'parameter')} drifted beyond the bounds; {hint}")


def choose_model(identifier: str, role: str, reason: str, data: Path | None, database: str | None) -> None:
    """Make a model the active one, or the one that drift is counted from.

    Raises NotFoundError if there is no such model. Raises StoreError if the database cannot be used.
    """
    with open_database(data, database) as opened:
        entry = ModelHistory(opened).activate(identifier, role, reason, datetime.now(UTC))
    noun = "active model" if role == "active" else "reference"
    output().print(plain(f"{entry.identifier} is the {noun} of {entry.robot}"), soft_wrap=True)


def _state(entry: ModelEntry) -> str:
    """Where a model stands."""
    return f"{entry.state}, reference" if entry.is_reference else entry.state


def _reason(entry: ModelEntry) -> str:
    """Which gates a model did not pass, and why."""
    failed = [f"{gate.name}: {gate.reason}" for gate in entry.gates if not gate.passed]
    return "; ".join(failed) or (ABSENT if entry.state == "unreadable" else "all gates passed")
