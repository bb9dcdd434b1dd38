"""``tauscope rollout``: its arguments."""

from pathlib import Path
from typing import Annotated

import typer

from tauscope.cli.arguments import Json, ReadingArguments, Report, RobotFile, name_recordings


def rollout(
    robot: RobotFile,
    recordings: Annotated[
        list[Path],
        name_recordings("Recordings with commands (qref), or with torque: CSV, Parquet, MCAP or rosbag2."),
    ],
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
    reading: ReadingArguments,
    json: Json = None,
    report: Report = None,
) -> None:
    """Say how far the simulated arm strays from the real one.

    MuJoCo gets the commands of each recording through the loops that the robot file states (joints[].actuator).
    Without loops or commands it gets the recorded torque, and a weak stabiliser holds it.
    """
    options = reading.options()
    from tauscope.cli.result_summary import show_rollout
    from tauscope.cli.task_run import name_files, run_task
    from tauscope.cli.terminal import output
    from tauscope.tasks import rollout as task

    request = task.Request(
        robot=str(robot),
        recordings=name_files(recordings),
        refine=name_files(refine),
        model=None if model is None else str(model),
        options=options,
    )
    show = None if str(json) == "-" else lambda result: show_rollout(output(), result.document)
    run_task(task, request, [(json, "result.json"), (report, "report.html")], show)
