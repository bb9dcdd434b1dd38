"""``tauscope identify``: its arguments."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from tauscope.cli.arguments import (
    Cutoff,
    HeldOut,
    Json,
    ReadingArguments,
    Report,
    RobotFile,
    name_output,
    name_recordings,
    parse_cutoff,
)


def identify(
    robot: RobotFile,
    recordings: Annotated[
        list[Path], name_recordings("Recordings that the model is made from: CSV, Parquet, NumPy, MCAP or a bag.")
    ],
    *,
    held_out: HeldOut = None,
    estimator: Annotated[Literal["ls", "wls"], typer.Option(help="How the joints' equations are weighted.")] = "wls",
    cutoff: Cutoff = "auto",
    rotor_inertia: Annotated[
        bool, typer.Option("--rotor-inertia/--no-rotor-inertia", help="Add rotors where the data ask for them.")
    ] = True,
    prior: Annotated[
        bool,
        typer.Option(
            "--prior/--no-prior", help="Deliver the most probable bodies, or the free least-squares estimate."
        ),
    ] = True,
    reading: ReadingArguments,
    json: Json = None,
    report: Report = None,
    export: Annotated[
        list[Path] | None,
        name_output(
            "Write the model for a controller or a simulator, by suffix: .json .yaml .h .py (friction compensation),"
            " .urdf, .xml (MJCF). May be repeated.",
            "FILE",
        ),
    ] = None,
    model: Annotated[Path | None, name_output("Write the model for tauscope export and --against.", "OUT.json")] = None,
) -> None:
    """Find an arm's parameters from recordings.

    Base parameters, friction and their uncertainty, the nearest physically consistent links, and how well all of it
    explains recordings that were held out.
    """
    fields = {"cutoff_hz": parse_cutoff(cutoff), **reading.fields()}
    from tauscope.cli.result_summary import show_identification
    from tauscope.cli.task_run import export_outputs, make_request, name_files, run_task
    from tauscope.cli.terminal import output
    from tauscope.export.formats import EXPORT_FILES
    from tauscope.tasks import identify as task

    fields |= {"estimator": estimator, "rotor_inertia": rotor_inertia, "prior": prior}
    request = task.Request(
        robot=str(robot),
        recordings=name_files(recordings),
        held_out=name_files(held_out),
        options=make_request(task.IdentificationOptions, **fields),
    )
    outputs = [(json, "result.json"), (report, "report.html"), (model, "model.json")]
    outputs += export_outputs(export or (), EXPORT_FILES)
    show = None if json else lambda result: show_identification(output(), result.document, result.robot)
    run_task(task, request, outputs, show)
