"""``tauscope diagnose``: its arguments."""

from pathlib import Path
from typing import Annotated, Any

import typer

from tauscope.cli.arguments import (
    Cutoff,
    HeldOut,
    Json,
    ReadingArguments,
    RobotFile,
    name_output,
    name_recordings,
    parse_cutoff,
)

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


def diagnose(
    robot: RobotFile,
    recordings: Annotated[
        list[Path],
        name_recordings("Recordings of the real arm that are to be explained: CSV, Parquet, NumPy, MCAP or a bag."),
    ],
    *,
    held_out: HeldOut = None,
    against: Against,
    cutoff: Cutoff = "auto",
    reading: ReadingArguments,
    headroom: Annotated[
        bool, typer.Option("--headroom", help="Train a black box, and say what it still predicts of held-out motion.")
    ] = False,
    json: Json = None,
    report: Annotated[
        Path | None, name_output("Write a page with verdict, findings and residuals.", "OUT.html")
    ] = None,
    next_trajectory: Annotated[
        Path | None, name_output("Write the motion to record next: what best separates, or shows, what is open.")
    ] = None,
    model: Annotated[
        Path | None, name_output("Write the model with all findings, for export and --against.", "OUT.json")
    ] = None,
    export: Annotated[
        list[Path] | None, name_output("Write the model with all findings, by suffix as in tauscope export.", "FILE")
    ] = None,
    scenario: Annotated[Path | None, name_output("Write the findings for the simulated arm.", "OUT.yaml")] = None,
    improved_robot: Annotated[
        Path | None, name_output("Write the robot file with identified links and friction.", "OUT.yaml")
    ] = None,
) -> None:
    """Say what an arm's model leaves out.

    Where recordings and model differ, which physics is missing, how sure that is, how large it is, what it had been
    hiding in the other parameters, and how much better recordings that were held out are then predicted.
    """
    fields = {"cutoff_hz": parse_cutoff(cutoff), **reading.fields()}
    motion = [] if next_trajectory is None else [(next_trajectory, f"trajectory{_trajectory_suffix(next_trajectory)}")]
    from tauscope.cli.diagnose_summary import show_diagnosis
    from tauscope.cli.task_run import export_outputs, make_request, name_files, run_task
    from tauscope.cli.terminal import output
    from tauscope.export.formats import CODE_FILES, EXPORT_FILES
    from tauscope.tasks import diagnose as task

    compared = parse_against(against)
    fields |= {"against": compared.pop("against"), "next_trajectory": bool(motion), "headroom": headroom}
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


def _trajectory_suffix(path: Path) -> str:
    """Format of the motion to record next."""
    if path.suffix.lower() not in TRAJECTORIES:
        text = f"{str(path)!r}: a trajectory file ends in .json or .csv"
        raise typer.BadParameter(text, param_hint="--next-trajectory")
    return path.suffix.lower()


def parse_against(words: list[str]) -> dict[str, Any]:
    """Read the values of ``--against``: `against` of the options, and `simulated` or `model` of the request.

    Raises typer.BadParameter for a file that does not exist.
    """
    if words in (["identified"], ["model"]):
        return {"against": words[0]}
    for word in words:
        if not Path(word).exists():
            text = f"{word!r} is neither identified, model, a recording nor a saved model"
            raise typer.BadParameter(text, param_hint="'--against'")
    if len(words) == 1 and Path(words[0]).suffix.lower() == ".json":
        return {"against": "saved", "model": str(Path(words[0]))}
    return {"against": "simulation", "simulated": tuple(str(Path(word)) for word in words)}
