"""``tauscope identify``: the parameters of an arm from its recordings, shown as tables."""

from pathlib import Path
from typing import Annotated, Any

from rich.console import Console

from tauscope.cli.arguments import (
    Cutoff,
    HeldOut,
    Json,
    ReadingFields,
    Report,
    RobotFile,
    complete_reading,
    name_output,
    name_recordings,
    parse_cutoff,
)
from tauscope.cli.task_run import export_outputs, name_files, run_task
from tauscope.cli.terminal import output, say, table
from tauscope.cli.verbs import OptionsOf, make_request
from tauscope.export.formats import EXPORT_FILES
from tauscope.identification import IdentificationDocument
from tauscope.number_text import counted, percent, significant
from tauscope.report.tables import Table, base_parameter_table, fit_table, friction_table, rotor_table
from tauscope.report.words import band_words, cautions, fit_sentences, masked_samples, noise_words
from tauscope.robot import Robot
from tauscope.tasks import identify as task


def identify(
    robot: RobotFile,
    recordings: Annotated[
        list[Path], name_recordings("Recordings that train the model: CSV, Parquet, NumPy, MATLAB, JSON, MCAP, bag.")
    ],
    *,
    held_out: HeldOut = None,
    cutoff: Cutoff = "auto",
    options: Annotated[dict[str, Any], OptionsOf(task.IdentificationOptions, ("estimator", "rotor_inertia", "prior"))],
    reading: ReadingFields,
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
    fields = {"cutoff_hz": parse_cutoff(cutoff), **complete_reading(reading), **options}
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


def show_identification(console: Console, document: IdentificationDocument, robot: Robot) -> None:
    say(f"Robot {document.robot}: {counted(len(document.joints), 'joint')}, {document.estimator.upper()}", console)
    for sentence in cautions(document):
        say(f"! {sentence}", console)
    console.print(table("Base parameters", base_parameter_table(document)))
    if document.unidentifiable:
        names = ", ".join(document.unidentifiable)
        say(f"No motion of this arm shows {names}", console)
        console.print()
    console.print(table("Friction [SI units]; in brackets: these data cannot tell", friction_table(document)))
    if document.rotor_inertia:
        console.print(table("Rotors", rotor_table(document)))
    console.print(table("Noise and residual", fit_table(document, robot)))
    console.print(table("Whole arm", _whole_arm(document)))
    for sentence in fit_sentences(document):
        say(sentence, console)


def _whole_arm(document: IdentificationDocument) -> Table:
    fit = document.fit
    entries = (*document.conditioning, *document.held_out_conditioning)
    rows = [
        ("relative error", percent(fit.train.relative_error)),
        ("relative error, held out", percent(fit.held_out.relative_error if fit.held_out else None)),
        ("condition number", significant(document.condition_number, 3)),
        ("band", band_words(document)),
        ("noise", noise_words(document.noise_method)),
        ("samples", str(sum(entry.samples for entry in entries))),
        ("masked samples", str(masked_samples(document))),
    ]
    return Table(("figure", "value"), rows, words=2)
