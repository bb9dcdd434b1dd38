"""``tauscope diagnose``: what an arm's model leaves out, as tables and sentences."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from typer import Option

from tauscope.cli.arguments import (
    Cutoff,
    HeldOut,
    Json,
    ReadingFields,
    RobotFile,
    complete_reading,
    name_output,
    name_recordings,
    parse_cutoff,
)
from tauscope.cli.task_run import export_outputs, name_files, parse_suffix, run_task
from tauscope.cli.terminal import output, say, table
from tauscope.cli.verbs import OptionsOf, make_request
from tauscope.diagnosis import DiagnosisDocument
from tauscope.diagnosis.documents.result import FindingEntry
from tauscope.export.formats import CODE_FILES, EXPORT_FILES
from tauscope.number_text import significant
from tauscope.report.tables import Table, difference_table, headroom_table, residual_table, shift_table
from tauscope.report.words import MOST_FINDINGS, VERDICTS, noise_words, refutations
from tauscope.tasks import diagnose as task

Against = Annotated[
    list[str],
    Option(
        default_factory=lambda: ["identified"],
        show_default=False,
        metavar="identified|model|MODEL.json|SIM...",
        help="What the recordings are compared with: the best model that the data allow (default), the robot file's"
        " model block, a model that --model wrote, or recordings made in your own simulator.",
    ),
]


def diagnose(
    robot: RobotFile,
    recordings: Annotated[
        list[Path],
        name_recordings(
            "Recordings of the real arm that are to be explained: CSV, Parquet, NumPy, MATLAB, JSON, MCAP, bag."
        ),
    ],
    *,
    held_out: HeldOut = None,
    against: Against,
    cutoff: Cutoff = "auto",
    reading: ReadingFields,
    options: Annotated[dict[str, Any], OptionsOf(task.DiagnosisOptions, ("headroom",))],
    json: Json = None,
    report: Annotated[Path | None, name_output("Write a page with verdict, findings, residuals.", "OUT.html")] = None,
    next_trajectory: Annotated[
        Path | None, name_output("Write the motion to record next: what best separates, or shows, what is open.")
    ] = None,
    model: Annotated[Path | None, name_output("Write the model with all findings, for --against.", "OUT.json")] = None,
    export: Annotated[
        list[Path] | None, name_output("Write the model with all findings, by suffix as in tauscope export.", "FILE")
    ] = None,
    scenario: Annotated[Path | None, name_output("Write the findings for the simulated arm.", "OUT.yaml")] = None,
    improved_robot: Annotated[
        Path | None, name_output("Write the robot file with what was identified.", "OUT.yaml")
    ] = None,
) -> None:
    """Say what an arm's model leaves out.

    Where recordings and model differ, which physics is missing, how sure that is, how large it is, what it had been
    hiding in the other parameters, and how much better recordings that were held out are then predicted.
    """
    fields = {"cutoff_hz": parse_cutoff(cutoff), **complete_reading(reading), **options}
    motion: list[tuple[Path, str]] = []
    if next_trajectory is not None:
        suffix = parse_suffix(next_trajectory, (".json", ".csv"), "--next-trajectory")
        motion = [(next_trajectory, f"trajectory{suffix}")]
    compared = parse_against(against)
    fields |= {"against": compared.pop("against"), "next_trajectory": bool(motion)}
    request = task.Request(
        robot=str(robot),
        recordings=name_files(recordings),
        held_out=name_files(held_out),
        options=make_request(task.DiagnosisOptions, **fields),
        **compared,
    )
    outputs = [
        (model, "model.json"),
        *export_outputs(export or (), {**EXPORT_FILES, **CODE_FILES}),
        (scenario, "scenario.yaml"),
        (improved_robot, "improved-robot.yaml"),
        *motion,
        (report, "report.html"),
        (json, "result.json"),
    ]
    show = None if json else lambda result: show_diagnosis(output(), result.document)
    result = run_task(task, request, outputs, show)
    if result.refusal is not None:  # what was found is kept
        raise result.refusal


def parse_against(words: list[str]) -> dict[str, Any]:
    """`against`, and `simulated` or `model` of the request. Raises typer.BadParameter for a missing file."""
    if words in (["identified"], ["model"]):
        return {"against": words[0]}
    for word in words:
        if not Path(word).exists():
            text = f"{word!r} is neither identified, model, a recording nor a saved model"
            raise typer.BadParameter(text, param_hint="'--against'")
    if len(words) == 1 and Path(words[0]).suffix.lower() == ".json":
        return {"against": "saved", "model": str(Path(words[0]))}
    return {"against": "simulation", "simulated": tuple(str(Path(word)) for word in words)}


def show_diagnosis(console: Console, document: DiagnosisDocument) -> None:
    say(f"Robot {document.robot}: {document.headline}", console)
    say(f"Verdict {document.verdict}: {VERDICTS[document.verdict]}", console)
    say(f"Noise: {noise_words(document.noise_method)}", console)
    for warning in document.warnings:
        say(f"! {warning.sentence}.", console)
    console.print()
    _show_findings(console, document.findings)
    if document.tentative:
        say("Tentative: held-out motion does not confirm these", console)
        _show_findings(console, document.tentative)
    for sentence in document.wrong_values:
        say(f"* {sentence}", console)
    if document.wrong_values:
        console.print()
    console.print(table("Mismatch with the nominal model", _mismatch(document)))
    console.print(table("Residual at the recorded rate [Nm or N]", residual_table(document)))
    if document.headroom is not None:
        title = f"Headroom: held-out residual below {significant(document.cutoff_hz, 3)} Hz [Nm or N]"
        console.print(table(title, headroom_table(document)))
        for sentence in refutations(document):
            say(f"* {sentence}", console)
    if document.parameter_differences:
        console.print(table("What the simulation has wrong", difference_table(document)))
    if document.parameter_shifts:
        console.print(table("What the left-out effects had done to the parameters", shift_table(document)))
    invisible = sorted({e.effect + (f"@{e.joint}" if e.joint else "") for e in document.detectable if not e.visible})
    if invisible:
        say(f"No such data can show: {', '.join(invisible)}", console)
    if document.next_experiment is not None:
        say(f"Next: {document.next_experiment.why}", console)


def _show_findings(console: Console, findings: Sequence[FindingEntry]) -> None:
    for finding in findings[:MOST_FINDINGS]:
        say(f"* {finding.statement}", console)
    if len(findings) > MOST_FINDINGS:
        say(f"  and {len(findings) - MOST_FINDINGS} more, see --json", console)
    if findings:
        console.print()


def _mismatch(document: DiagnosisDocument) -> Table:
    rows = []
    for entry in document.mismatch:
        place = entry.where or entry.time
        where = "" if place is None else f"{place.variable} {place.range[0]:.3g} … {place.range[1]:.3g}"
        rows.append((entry.joint, "yes" if entry.significant else "no", where, significant(entry.excess_rms, 3)))
    return Table(("joint", "significant", "mostly at", "excess rms"), rows, words=3)
