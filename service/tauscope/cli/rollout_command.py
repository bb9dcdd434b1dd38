"""``tauscope rollout``: how far the simulated arm strays from the real one, shown as tables."""

from pathlib import Path
from typing import Annotated

from rich.console import Console

from tauscope.cli.arguments import Json, ReadingFields, Report, RobotFile, complete_reading, name_input, name_recordings
from tauscope.cli.task_run import name_files, run_task
from tauscope.cli.terminal import output, say, table
from tauscope.cli.verbs import make_request
from tauscope.closed_loop import RolloutDocument
from tauscope.closed_loop.tables import recording_table, refinement_table, rollout_sentences, summary_table
from tauscope.number_text import counted
from tauscope.tasks import rollout as task
from tauscope.tasks.task import ReadingOptions


def rollout(
    robot: RobotFile,
    recordings: Annotated[
        list[Path], name_recordings("Recordings with commands (qref) or torque: CSV, Parquet, MCAP.")
    ],
    *,
    model: Annotated[
        Path | None,
        name_input(
            "Model that identify or diagnose wrote with --model: rolled out without and with its findings.",
            "MODEL.json",
        ),
    ] = None,
    refine: Annotated[
        list[Path] | None,
        name_input(
            "Recordings with commands by which the model is refined; the others judge it. All files up to the"
            " next option, or up to --, belong to it.",
            "RECORDING...",
            dir_okay=True,
        ),
    ] = None,
    reading: ReadingFields,
    json: Json = None,
    report: Report = None,
) -> None:
    """Say how far the simulated arm strays from the real one.

    MuJoCo gets the commands of each recording through the loops that the robot file states (joints[].actuator).
    Without loops or commands it gets the recorded torque, and a weak stabiliser holds it.
    """
    request = task.Request(
        robot=str(robot),
        recordings=name_files(recordings),
        refine=name_files(refine),
        model=None if model is None else str(model),
        options=make_request(ReadingOptions, **complete_reading(reading)),
    )
    show = None if str(json) == "-" else lambda result: show_rollout(output(), result.document)
    run_task(task, request, [(json, "result.json"), (report, "report.html")], show)


def show_rollout(console: Console, document: RolloutDocument) -> None:
    joints, recordings = len(document.joints), len(document.recordings)
    say(f"Robot {document.robot}: {counted(joints, 'joint')}, {counted(recordings, 'recording')}", console)
    for warning in document.warnings:
        say(f"! {warning.sentence}", console)
    console.print(table("Position error, real against simulated motion", summary_table(document)))
    console.print(table("Error by time between restarts [mrad, mm]", recording_table(document)))
    if document.refinement is not None:
        console.print(table("Refined parameters", refinement_table(document.refinement)))
    for sentence in rollout_sentences(document):
        say(sentence, console)
