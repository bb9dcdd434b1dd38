"""``tauscope prove``: its arguments, and the way to the trials, which only a clone of the repository has."""

import os
import sys
from pathlib import Path
from typing import Annotated, NoReturn

from typer import Option

from tauscope.errors import NotFoundError

REPOSITORY = Path(__file__).resolve().parents[2]
REPORTING = 1_000_000  # first seed of reports: seeds below 10,000 were looked at while the diagnosis was made


def prove(
    *,
    full: Annotated[bool, Option("--full", help="The full set instead of the quick one; takes an hour.")] = False,
    first_seed: Annotated[int, Option(metavar="N", min=0, help="First seed; 10000 or more.")] = REPORTING,
    jobs: Annotated[int | None, Option(metavar="N", min=1, help="Trials at a time; default: one a core.")] = None,
    scheduler: Annotated[str | None, Option(metavar="ADDRESS", help="Dask scheduler that makes the trials.")] = None,
    out: Annotated[Path, Option(metavar="DIR", file_okay=False, help="Folder of outcomes.")] = Path("proof-output"),
    page: Annotated[
        Path | None, Option(metavar="PAGE.md", dir_okay=False, help="Page, in place of one in DIR.")
    ] = None,
) -> None:
    """Put the diagnosis to the test: conceal effects, seal the truth, diagnose, open it, count.

    Works in a clone of the repository. Outcomes are kept one by one, so that an interrupted set goes on. Uses all
    cores, or a Dask cluster: the one of --scheduler, else of DASK_SCHEDULER_ADDRESS.
    """
    words = ["--out", str(out), "--first-seed", str(first_seed)]
    words += ["--full"] if full else []
    words += [] if jobs is None else ["--jobs", str(jobs)]
    words += [] if scheduler is None else ["--scheduler", scheduler]
    words += [] if page is None else ["--page", str(page)]
    become_trials(REPOSITORY, words)


def become_trials(repository: Path, words: list[str]) -> NoReturn:
    """Run the trials of a clone in place of this program. Raises NotFoundError where its tests are missing."""
    tests = repository / "tests"
    if not (tests / "concealed").is_dir():
        raise NotFoundError(
            "tauscope prove: the trials (tests/concealed) are not installed with the program: clone the repository and"
            " run `make prove` there"
        )
    path = os.pathsep.join([str(repository), str(tests), *filter(None, [os.environ.get("PYTHONPATH")])])
    sys.stdout.flush()
    command = [sys.executable, "-m", "concealed.proof", *words]
    os.execve(sys.executable, command, {**os.environ, "PYTHONPATH": path})  # noqa: S606 - our own
