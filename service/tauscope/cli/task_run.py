"""What every verb does around its task: check the files, perform, write the outputs, show the result."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

import typer

from tauscope.cli.output_files import STANDARD_OUTPUT, require_distinct, require_free, write_file
from tauscope.cli.terminal import Told, say, show_progress
from tauscope.errors import one_line
from tauscope.export.formats import SUFFIXES, ExportFile, ExportFormat
from tauscope.robot import Robot, Severity, read_robot
from tauscope.tasks.task import LocalFiles


def run_task(
    task: ModuleType, request: Any, asked: Sequence[tuple[Path | None, str]], show: Callable[[Any], None] | None = None
) -> Any:
    """Perform a task; `asked`: files to write, each with its output. Raises typer.BadParameter or TauscopeError."""
    outputs = [(path, name) for path, name in asked if path is not None]
    paths, robot_file = tuple(path for path, _ in outputs), Path(request.robot)
    inputs = [Path(name) for names in getattr(request, "inputs", {}).values() for name in names]
    require_distinct(inputs)
    require_free(paths, (robot_file, *inputs))
    robot = read_robot(robot_file)
    require_free(paths, [path for _, path in robot.files])
    with show_progress() as progress:
        result, written = write_outputs(task, request, dict(outputs), progress)
    if show is not None:
        show(result)
    if STANDARD_OUTPUT not in paths:
        for path in written:
            say(f"wrote {path}")
    _show_warnings(robot, result, summarised=show is not None)
    return result


def name_files(paths: Iterable[Path] | None) -> tuple[str, ...]:
    return tuple(map(str, paths or ()))


def write_outputs(
    task: ModuleType, request: Any, outputs: Mapping[Path, str], progress: Told
) -> tuple[Any, Iterable[Path]]:
    """The result, and the files that were written: all, or none. Raises TauscopeError if one cannot be made."""
    result = task.perform(request, LocalFiles({name: path for path, name in outputs.items()}), progress)
    progress("make outputs")
    made = result.outputs
    content = {path: made[name] for path, name in outputs.items() if name in made}
    progress("write files")
    for path, data in content.items():
        write_file(path, data)
    return result, content


def export_outputs(paths: Sequence[Path], files: Mapping[ExportFormat, ExportFile]) -> list[tuple[Path, str]]:
    """Outputs of ``--export`` by their suffixes. Raises typer.BadParameter where one names no format."""
    return [(path, files[parse_export_format(path, files, "'--export'")].output) for path in paths]


def parse_export_format(path: Path, files: Mapping[ExportFormat, ExportFile], option: str) -> ExportFormat:
    """The format that the suffix of a file names. Raises typer.BadParameter where it names none."""
    kind = SUFFIXES.get(path.suffix.lower())
    if kind is None or kind not in files:
        known = ", ".join(suffix for suffix, kind in SUFFIXES.items() if kind in files)
        raise typer.BadParameter(f"{str(path)!r}: the suffix names no format; use {known}", param_hint=option)
    return kind


def _show_warnings(robot: Robot, result: Any, *, summarised: bool) -> None:
    """Warnings of a robot file and of a result on standard error; a summary shows the result's own first."""
    for finding in robot.findings:
        if finding.severity is Severity.WARNING:
            typer.echo(one_line(f"warning: {finding.where}: {finding.text}"), err=True)
    warnings = getattr(getattr(result, "document", None), "warnings", None)
    if warnings is None:
        warnings = robot.warnings
    elif summarised:
        warnings = []
    for warning in warnings:
        typer.echo(one_line(f"warning: {warning.sentence} ({warning.code})"), err=True)
