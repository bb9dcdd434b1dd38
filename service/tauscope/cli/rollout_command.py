"""``tauscope rollout``: its arguments."""

from pathlib import Path
from typing import Annotated

import typer

from tauscope.cli.arguments import (
    Columns,
    Decimal,
    Delimiter,
    Rate,
    RobotFile,
    Topic,
    TrustUnits,
    Units,
    reading_fields,
)

Recordings = Annotated[
    list[Path],
    typer.Argument(
        metavar="RECORDING",
        exists=True,
        help="Recordings with commands (qref), or with torque: CSV, Parquet, MCAP or rosbag2.",
        show_default=False,
    ),
]


def rollout(
    robot: RobotFile,
    recordings: Recordings,
    *,
    model: Annotated[
        Path | None,
        typer.Option(
            metavar="MODEL.json",
            exists=True,
            dir_okay=False,
            help="Model that identify or diagnose wrote with --model: rolled out without and with its findings.",
        ),
    ] = None,
    refine: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="RECORDING...",
            exists=True,
            help="Recordings with commands by which the model is refined; the others judge it. All files up to the"
            " next option, or up to --, belong to it.",
            show_default=False,
        ),
    ] = None,
    units: Units = None,
    rate: Rate = None,
    trust_units: TrustUnits = False,
    columns: Columns = None,
    decimal: Decimal = None,
    delimiter: Delimiter = None,
    topic: Topic = None,
    json: Annotated[
        Path | None, typer.Option(metavar="OUT", dir_okay=False, help="Write the result as JSON; - is standard output.")
    ] = None,
    report: Annotated[
        Path | None, typer.Option(metavar="OUT.html", dir_okay=False, help="Write a page to read, figures included.")
    ] = None,
) -> None:
    """Say how far the simulated arm strays from the real one.

    MuJoCo gets the commands of each recording through the loops that the robot file states (joints[].actuator).
    Without loops or commands it gets the recorded torque, and a weak stabiliser holds it.

    Parameters
    ----------
    rate : float or None
        samples a second where t counts samples [Hz]
    """
    fields = reading_fields(columns, units, rate, trust_units, decimal, delimiter, topic)
    from tauscope.cli.rollout_summary import show_rollout
    from tauscope.cli.task_run import make_request, run_task
    from tauscope.cli.terminal import output
    from tauscope.tasks import rollout as task
    from tauscope.tasks.task import ReadingOptions

    options = make_request(ReadingOptions, **fields)
    request = task.Request(
        robot=str(robot),
        recordings=tuple(map(str, recordings)),
        refine=tuple(map(str, refine or ())),
        model=None if model is None else str(model),
        options=options,
    )
    outputs = [(json, "result.json"), (report, "report.html")]
    shown = str(json) == "-"
    inputs = (*recordings, *(refine or ()), *([] if model is None else [model]))
    run_task(task, request, outputs, inputs, None if shown else lambda result: show_rollout(output(), result.document))
