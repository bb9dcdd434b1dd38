"""``tauscope diagnose``: its arguments."""

from pathlib import Path
from typing import Annotated, Any

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
from tauscope.cli.identify_command import Cutoff, HeldOut, parse_cutoff

Recordings = Annotated[
    list[Path],
    typer.Argument(
        metavar="RECORDING",
        exists=True,
        help="Recordings of the real arm that are to be explained: CSV, Parquet, NumPy, MCAP or a bag.",
        show_default=False,
    ),
]
Against = Annotated[
    list[str],
    typer.Option(
        default_factory=lambda: ["identified"],
        show_default=False,
        metavar="identified|model|MODEL.json|SIM...",
        help="What the recordings are compared with: the best model that the data allow (default), the robot file's"
        " model block, a model that --model wrote, or recordings made in your own simulator.",
    ),
]


TRAJECTORIES = (".json", ".csv")


def _output(words: str, metavar: str = "OUT") -> Any:
    """An option that names a file to write."""
    return typer.Option(metavar=metavar, dir_okay=False, help=words)


def diagnose(
    robot: RobotFile,
    recordings: Recordings,
    *,
    held_out: HeldOut = None,
    against: Against,
    cutoff: Cutoff = "auto",
    units: Units = None,
    rate: Rate = None,
    trust_units: TrustUnits = False,
    columns: Columns = None,
    decimal: Decimal = None,
    delimiter: Delimiter = None,
    topic: Topic = None,
    headroom: Annotated[
        bool, typer.Option("--headroom", help="Train a black box, and say what it still predicts of held-out motion.")
    ] = False,
    json: Annotated[Path | None, _output("Write the result as JSON; - is standard output.")] = None,
    report: Annotated[Path | None, _output("Write a page with verdict, findings and residuals.", "OUT.html")] = None,
    next_trajectory: Annotated[
        Path | None, _output("Write the motion to record next: what best separates, or shows, what is open.")
    ] = None,
    model: Annotated[
        Path | None, _output("Write the model with all findings, for export and --against.", "OUT.json")
    ] = None,
    export: Annotated[
        list[Path] | None, _output("Write the model with all findings, by suffix as in tauscope export.", "FILE")
    ] = None,
    scenario: Annotated[Path | None, _output("Write the findings for the simulated arm.", "OUT.yaml")] = None,
    improved_robot: Annotated[
        Path | None, _output("Write the robot file with identified links and friction.", "OUT.yaml")
    ] = None,
) -> None:
    """Say what an arm's model leaves out.

    Where recordings and model differ, which physics is missing, how sure that is, how large it is, what it had been
    hiding in the other parameters, and how much better recordings that were held out are then predicted.

    Parameters
    ----------
    cutoff : str
        ``auto``, ``none`` or a frequency [Hz], for the identification
    rate : float or None
        samples a second where t counts samples [Hz]
    """
    cutoff_hz = parse_cutoff(cutoff)
    fields = reading_fields(columns, units, rate, trust_units, decimal, delimiter, topic)
    if next_trajectory is not None and next_trajectory.suffix.lower() not in TRAJECTORIES:
        text = f"{str(next_trajectory)!r}: a trajectory file ends in .json or .csv"
        raise typer.BadParameter(text, param_hint="--next-trajectory")
    from tauscope.cli.diagnose_summary import show_diagnosis
    from tauscope.cli.task_run import export_outputs, make_request, run_task
    from tauscope.cli.terminal import output
    from tauscope.export.formats import CODE_FILES, EXPORT_FILES
    from tauscope.tasks import diagnose as task

    what, simulated, saved = parse_against(against)
    options = make_request(
        task.DiagnosisOptions,
        against=what,
        cutoff_hz=cutoff_hz,
        next_trajectory=next_trajectory is not None,
        headroom=headroom,
        **fields,
    )
    held, compared = held_out or [], [*simulated, *([] if saved is None else [saved])]
    request = task.Request(
        robot=str(robot),
        recordings=tuple(map(str, recordings)),
        held_out=tuple(map(str, held)),
        simulated=tuple(map(str, simulated)),
        model=None if saved is None else str(saved),
        options=options,
    )
    outputs = [
        (model, "model.json"),
        *export_outputs(export or (), {**EXPORT_FILES, **CODE_FILES}),
        (scenario, "scenario.yaml"),
        (improved_robot, "improved-robot.yaml"),
        (next_trajectory, f"trajectory{next_trajectory.suffix.lower()}" if next_trajectory else ""),
        (report, "report.html"),
        (json, "result.json"),
    ]
    inputs = (*recordings, *held, *compared)
    result = run_task(
        task, request, outputs, inputs, None if json else lambda result: show_diagnosis(output(), result.document)
    )
    if result.refusal is not None:  # what was found is kept
        raise result.refusal


def parse_against(words: list[str]) -> tuple[str, list[Path], Path | None]:
    """Read the values of ``--against``.

    Returns
    -------
    str
        what is compared with, as the request names it
    list of Path
        recordings of a simulator
    Path or None
        a model that was saved before

    Raises
    ------
    typer.BadParameter
        for a file that does not exist
    """
    if words in (["identified"], ["model"]):
        return words[0], [], None
    paths = [Path(word) for word in words]
    for path in paths:
        if not path.exists():
            text = f"{str(path)!r} is neither identified, model, a recording nor a saved model"
            raise typer.BadParameter(text, param_hint="'--against'")
    if len(paths) == 1 and paths[0].suffix.lower() == ".json":
        return "saved", [], paths[0]
    return "simulation", paths, None
