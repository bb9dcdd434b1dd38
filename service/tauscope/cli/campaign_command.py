"""``tauscope campaign``: its arguments."""

from pathlib import Path
from typing import Annotated, Any

import typer

from tauscope.cli.arguments import RobotFile
from tauscope.cli.driver_choice import DEFAULT_BACKEND, check_backend


def _step(words: str) -> Any:
    """An option that holds the options of a step."""
    return typer.Option(metavar="JSON", help=f"{words}: an object as in the REST API, or none.")


def campaign(
    robot: RobotFile,
    *,
    out: Annotated[
        Path, typer.Option(metavar="DIR", file_okay=False, help="New folder for motions, recordings and results.")
    ],
    backend: Annotated[
        str, typer.Option(metavar="[{backends}|JSON]", help="What moves the arm, by name or as in the REST API.")
    ] = DEFAULT_BACKEND,
    excitation: Annotated[str, _step("How the training motion is designed")] = "{}",
    held_out: Annotated[str, _step("The motion that the model is judged by")] = "{}",
    run: Annotated[str, _step("How the motions are run")] = "{}",
    identification: Annotated[str, _step("How the arm is identified")] = "{}",
    diagnosis: Annotated[str, _step("How what the model leaves out is diagnosed")] = "none",
) -> None:
    """Go from a robot to its model: design a motion, run it, run a second one, identify and diagnose.

    Ctrl-C stops the arm; motions and recordings made until then are kept.
    """
    import json

    from tauscope.cli.campaign_run import run_campaign

    named = backend if backend.lstrip().startswith("{") else json.dumps({"name": check_backend(backend)})
    steps = {
        "backend": named,
        "excitation": excitation,
        "held_out": held_out,
        "run": run,
        "identification": identification,
        "diagnosis": diagnosis,
    }
    run_campaign(robot, steps, out)
