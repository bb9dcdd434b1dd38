"""The demo's folder: it writes over its own files, never over somebody else's."""

from collections.abc import Sequence
from pathlib import Path

from tauscope.cli.output_files import write_file
from tauscope.errors import ExportError

MARK = "README.txt"
_FIRST_LINE = "Written by `tauscope demo`, which replaces the files named here when it runs again:"


def prepare_folder(folder: Path, files: Sequence[str]) -> None:
    """Make the folder, mark it, and take away the files that an earlier demo wrote into it; folders stay.

    Raises ExportError where one of these names is taken by a file that no demo wrote, or the folder cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        ours = _list_own(folder / MARK)
        for name in (MARK, *files):
            if name not in ours and (folder / name).exists():
                raise ExportError(
                    f"{folder / name}: was not written by the demo, and is not replaced; choose another --out"
                )
        write_file(folder / MARK, "\n".join([_FIRST_LINE, "", *files, ""]).encode())
        for name in ours.intersection(files):
            if not (folder / name).is_dir():  # a service's data: whoever worked on it since may want it
                (folder / name).unlink(missing_ok=True)
    except OSError as error:
        raise ExportError(f"{folder}: cannot be written ({error.strerror or error}); choose another --out") from error


def _list_own(mark: Path) -> set[str]:
    """Names that an earlier demo wrote down as its own, the mark included; none where the mark is not its own."""
    if not mark.is_file():
        return set()
    first, *names = mark.read_text(encoding="utf-8", errors="replace").splitlines()[:100] or [""]
    return {MARK, *filter(None, names)} if first == _FIRST_LINE else set()
