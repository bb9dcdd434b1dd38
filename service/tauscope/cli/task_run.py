"""What every verb does around its task: check the files, perform, write outputs whole or not at all, show."""

import os
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

import typer

from tauscope.cli.terminal import Told, say, show_progress
from tauscope.errors import ExportError, explain_os_errors, one_line
from tauscope.export.formats import SUFFIXES, ExportFile, ExportFormat
from tauscope.files import open_atomically
from tauscope.robot import Robot, Severity, read_robot
from tauscope.tasks.task import Files

STANDARD_OUTPUT = Path("-")  # stands for standard output where a file to write is asked for


def require_distinct(inputs: Sequence[Path]) -> None:
    """Refuse a file that is given twice: it would count twice, or judge itself. Raises typer.BadParameter."""
    seen: set[Path] = set()
    for path in inputs:
        real = path.resolve()
        if real in seen:
            raise typer.BadParameter(f"recording {str(path)!r} is given twice; name each recording once")
        seen.add(real)


def require_free(outputs: Sequence[Path], inputs: Iterable[Path]) -> None:
    """Refuse, before any work, an output that would destroy an input. Raises typer.BadParameter."""
    read = {path.resolve() for path in inputs}
    written: set[Path] = set()
    for path in outputs:
        if path == STANDARD_OUTPUT:
            continue
        real = path.resolve()
        if not read.isdisjoint((real, *real.parents)) or any(
            real.exists() and each.exists() and real.samefile(each) for each in read
        ):
            raise typer.BadParameter(f"output {str(path)!r} is an input of this command; inputs are never written to")
        if real in written:
            raise typer.BadParameter(f"output {str(path)!r} is asked for twice; name each output once")
        if real.is_dir():
            raise typer.BadParameter(f"output {str(path)!r} is a folder; name a file")
        if not real.parent.is_dir():
            raise typer.BadParameter(f"output {str(path)!r}: folder {str(path.parent)!r} does not exist; make it first")
        written.add(real)


def require_new(path: Path) -> None:
    """Refuse, before any work, a file that exists. Raises typer.BadParameter or ExportError."""
    if not path.resolve().parent.is_dir():
        raise typer.BadParameter(f"output {str(path)!r}: folder {str(path.parent)!r} does not exist; make it first")
    if path.exists() or path.is_symlink():
        raise ExportError(f"{path}: exists, and is not replaced; name another file")


def keep_file(source: Path, target: Path) -> None:
    """Name a finished file. Raises ExportError where there is one by now, or it cannot be written."""
    try:
        os.link(source, target)
    except FileExistsError:
        raise ExportError(f"{target}: was made meanwhile, and is not replaced; the file is kept as {source}") from None
    except OSError as error:
        reason = error.strerror or error
        raise ExportError(f"{target}: cannot be written ({reason}); the file is kept as {source}") from error
    source.unlink()


def write_file(path: Path, content: bytes) -> None:
    """Write a file that appears only when it is complete. Raises ExportError where it cannot be written."""
    if path == STANDARD_OUTPUT:
        typer.echo(content, nl=False)
        return
    real = path.resolve()
    with explain_os_errors(ExportError, f"{path}: cannot be written", "; choose another place"):
        if real.exists() and not real.is_file():  # a device or a pipe: there is nothing to replace
            real.write_bytes(content)
        else:
            with open_atomically(real) as file:
                file.write(content)


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
    result = task.perform(request, Files({name: path for path, name in outputs.items()}), progress)
    progress("make outputs")
    made = result.outputs
    content = {path: made[name] for path, name in outputs.items() if name in made}
    progress("write files")
    for path, data in content.items():
        write_file(path, data)
    return result, content


def export_outputs(paths: Sequence[Path], files: Mapping[ExportFormat, ExportFile]) -> list[tuple[Path, str]]:
    """Outputs of ``--export`` by their suffixes. Raises typer.BadParameter where one names no format."""
    return [(path, files[parse_export_format(path, files, "--export")].output) for path in paths]


def parse_export_format(path: Path, files: Mapping[ExportFormat, ExportFile], option: str) -> ExportFormat:
    """The format that the suffix of a file names. Raises typer.BadParameter where it names none."""
    return SUFFIXES[parse_suffix(path, [suffix for suffix, kind in SUFFIXES.items() if kind in files], option)]


def parse_suffix(path: Path, known: Collection[str], option: str) -> str:
    """The suffix of a file in lower case. Raises typer.BadParameter where it is none of those known."""
    suffix = path.suffix.lower()
    if suffix not in known:
        text = f"{str(path)!r}: the suffix names no format; use {', '.join(known)}"
        raise typer.BadParameter(text, param_hint=f"'{option}'")
    return suffix


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
