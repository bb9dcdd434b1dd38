"""Files that the program writes: complete or not at all, and never over a file that it read."""

import os
from collections.abc import Iterable, Sequence
from pathlib import Path

import typer

from tauscope.errors import ExportError
from tauscope.files import open_atomically

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
    try:
        if real.exists() and not real.is_file():  # a device or a pipe: there is nothing to replace
            real.write_bytes(content)
        else:
            with open_atomically(real) as file:
                file.write(content)
    except OSError as error:
        raise ExportError(f"{path}: cannot be written ({error.strerror or error}); choose another place") from error
