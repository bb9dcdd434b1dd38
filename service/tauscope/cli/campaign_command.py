"""``tauscope campaign``: perform the task in a new folder, write what came of it, and show it."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer
from pydantic import ValidationError
from typer import Option

from tauscope.cli.arguments import RobotFile
from tauscope.cli.diagnose_command import show_diagnosis
from tauscope.cli.identify_command import show_identification
from tauscope.cli.task_run import write_file
from tauscope.cli.terminal import output, say, show_progress
from tauscope.errors import ExportError, explain_os_errors
from tauscope.runtime.drivers import DEFAULT_BACKEND, driver_names
from tauscope.tasks import campaign as task
from tauscope.tasks.task import Files


def _step(words: str) -> Any:
    return Option(metavar="JSON", help=f"{words}: an object as in the REST API, or none.")


def campaign(
    robot: RobotFile,
    *,
    out: Annotated[Path, Option(metavar="DIR", file_okay=False, help="New folder of all results.")],
    backend: Annotated[
        str,
        Option(metavar=f"[{'|'.join(driver_names())}|JSON]", help="What moves the arm: a name, or as in the REST API."),
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
    if not backend.lstrip().startswith("{"):
        if backend not in driver_names():
            raise typer.BadParameter(f"{backend!r} is not one of {', '.join(map(repr, driver_names()))}.")
        backend = json.dumps({"name": backend})
    steps = {"backend": backend, "excitation": excitation, "held_out": held_out, "run": run}
    steps |= {"identification": identification, "diagnosis": diagnosis}
    request = _request(robot, steps)
    with explain_os_errors(ExportError, f"{out}: cannot be made", "; name a new folder"):
        out.mkdir()
    with show_progress() as progress:
        result = task.perform(request, Files({"campaign": out}), progress)
        progress("write files")
        outputs = result.outputs
        for name in outputs:
            _write(out / name, outputs, name)
    show_identification(output(), result.identification.document, result.identification.robot)
    if result.diagnosis is not None:
        show_diagnosis(output(), result.diagnosis.document)
    say(f"wrote {out}")


def _request(robot: Path, steps: Mapping[str, str]) -> task.Request:
    fields = ", ".join(f'"{name}": {"null" if text == "none" else text}' for name, text in steps.items())
    try:
        return task.Request.model_validate_json(f'{{"robot": {json.dumps(str(robot))}, {fields}}}')
    except ValidationError as error:
        fault = error.errors(include_url=False, include_context=False)[0]
        place = ".".join(str(part) for part in fault["loc"])
        option = f"'--{str(fault['loc'][0]).replace('_', '-')}'" if fault["loc"] else None
        raise typer.BadParameter(f"{place}: {fault['msg']}", param_hint=option) from None


def _write(path: Path, outputs: Mapping[str, bytes], name: str) -> None:
    """Write an output, unless its format cannot hold the model."""
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        write_file(path, outputs[name])
    except ExportError as error:
        say(f"! {error}")
