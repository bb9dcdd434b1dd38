"""``tauscope campaign``: perform the task in a new folder, write what came of it, and show it."""

import json
from collections.abc import Mapping
from pathlib import Path

import typer
from pydantic import ValidationError

from tauscope.cli.diagnose_summary import show_diagnosis
from tauscope.cli.output_files import write_file
from tauscope.cli.result_summary import show_identification
from tauscope.cli.terminal import output, plain, shown_progress
from tauscope.errors import ExportError
from tauscope.tasks import campaign
from tauscope.tasks.task import LocalFiles


def run_campaign(robot: Path, steps: Mapping[str, str], out: Path) -> None:
    """Run a campaign on the arm of a robot file.

    Raises typer.BadParameter where an option is not valid. Raises TauscopeError where a step has no result, or the
    folder exists.

    `steps`: JSON by field of the request.
    """
    request = _request(robot, steps)
    try:
        out.mkdir()
    except OSError as error:
        raise ExportError(f"{out}: cannot be made ({error.strerror}); name a new folder") from error
    with shown_progress() as progress:
        result = campaign.perform(request, LocalFiles({"campaign": out}), progress)
        progress("write files")
        outputs = result.outputs
        for name in outputs:
            _write(out / name, outputs, name)
    show_identification(output(), result.identification.document, result.identification.robot)
    if result.diagnosis is not None:
        show_diagnosis(output(), result.diagnosis.document)
    output().print(plain(f"wrote {out}"), soft_wrap=True)


def _request(robot: Path, steps: Mapping[str, str]) -> campaign.Request:
    fields = ", ".join(f'"{name}": {"null" if text == "none" else text}' for name, text in steps.items())
    try:
        return campaign.Request.model_validate_json(f'{{"robot": {json.dumps(str(robot))}, {fields}}}')
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
        output().print(plain(f"! {error}"), soft_wrap=True)
