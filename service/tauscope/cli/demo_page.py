"""The page after the demo: here until Ctrl-C, or in a process of its own for a while.

The second is ``python -m tauscope.cli.demo_page FOLDER SECONDS``; it ends sooner where the folder goes, or another demo
begins in it.
"""

import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum, auto
from pathlib import Path
from typing import IO, cast

import typer

from tauscope.cli.serve_command import run_server
from tauscope.cli.task_run import write_file
from tauscope.errors import ExportError, StoreError, TauscopeError, explain_os_errors
from tauscope.server.http.app import serve
from tauscope.server.http.settings import Settings

MARK = "README.txt"
_FIRST_LINE = "Written by `tauscope demo`, which replaces the files named here when it runs again:"


def prepare_folder(folder: Path, files: Sequence[str]) -> None:
    """Make and mark the folder, without an earlier demo's files. Raises ExportError where a name is taken."""
    with explain_os_errors(ExportError, f"{folder}: cannot be written", "; choose another --out"):
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


def _list_own(mark: Path) -> set[str]:
    """Names that an earlier demo wrote down as its own, the mark included; none where the mark is not its own."""
    if not mark.is_file():
        return set()
    first, *names = mark.read_text(encoding="utf-8", errors="replace").splitlines()[:100] or [""]
    return {MARK, *filter(None, names)} if first == _FIRST_LINE else set()


DATA = "service"  # data folder of a service within the demo's, which holds a campaign on an arm that conceals an effect
PORT = 8000  # where the page is, unless something else is there already
LEFT_FOR_S = 900.0  # how long a page that nobody waits for stays [s]
_LOOK_S = 0.5


class PageShown(Enum):
    HERE = auto()  # The demo itself, until interrupted.
    LEFT = auto()  # A process that the demo leaves behind, for a while.
    NOT = auto()  # Nobody.


def show_page(folder: Path) -> None:
    run_server(folder / DATA, port=_free_port())


@dataclass(frozen=True)
class LeftPage:
    address: str
    process: subprocess.Popen[str]


def leave_page(folder: Path, seconds: float = LEFT_FOR_S) -> LeftPage:
    """Serve the page from another process for so many [s]. Raises StoreError if that process ends instead."""
    process = subprocess.Popen(  # noqa: S603 - this program
        [sys.executable, "-m", __name__, str(folder.resolve()), str(seconds)],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,  # a Ctrl-C that comes later is not meant for it
    )
    first = cast(IO[str], process.stdout).readline().strip()
    if first.startswith("http"):
        return LeftPage(first, process)
    said = [first, *process.communicate()[0].strip().splitlines()]
    raise StoreError(f"the page did not come up ({said[-1]}); try: tauscope serve --data {folder / DATA}")


def _serve_for_a_while(folder: Path, seconds: float) -> None:
    """Serve the page until the time is over, the folder goes or another demo begins in it."""
    threading.Thread(target=_end_in_time, args=(folder / MARK, seconds), daemon=True).start()
    serve(Settings(data_folder=folder / DATA, port=_free_port()), _announce)


def _end_in_time(mark: Path, seconds: float) -> None:
    """Ask this process to end, as Ctrl-C would."""
    begun, last = _identity(mark), time.monotonic() + seconds
    while time.monotonic() < last and _identity(mark) == begun:
        time.sleep(_LOOK_S)
    os.kill(os.getpid(), signal.SIGINT)


def _identity(mark: Path) -> tuple[int, int] | None:
    """What differs once another demo has written the file; None where it is gone."""
    try:
        state = mark.stat()
    except OSError:
        return None
    return state.st_ino, state.st_mtime_ns


def _announce(address: str) -> None:
    """Tell the demo, and nobody from then on: it will not be there to listen."""
    typer.echo(address)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    os.dup2(nowhere, 2)


def _free_port() -> int:
    """`PORT`, or none in particular where that is taken."""
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(("127.0.0.1", PORT))
        except OSError:
            return 0
    return PORT


if __name__ == "__main__":
    try:
        _serve_for_a_while(Path(sys.argv[1]), float(sys.argv[2]))
    except TauscopeError as error:
        sys.exit(str(error))
