"""``tauscope fleet``: its arguments."""

import os
from pathlib import Path
from typing import Annotated

import typer

from tauscope.cli.verbs import add_verb

fleet = typer.Typer(
    help="The same analysis for many robots, results in one table.", no_args_is_help=True, rich_markup_mode=None
)

CORES = os.cpu_count() or 1

Manifest = Annotated[
    Path,
    typer.Argument(
        metavar="MANIFEST",
        exists=True,
        dir_okay=False,
        help="CSV with the columns name,robot,recordings,held_out; recordings separated by ';', paths relative to it.",
    ),
]
Out = Annotated[
    Path, typer.Option(metavar="DIR", file_okay=False, help="Folder of the results: table.csv, and NAME.json for each.")
]
Workers = Annotated[
    int,
    typer.Option(
        min=1, max=1024, metavar="N", help="Processes; a Dask cluster has its own (DASK_SCHEDULER_ADDRESS).",
        show_default="one a core",
    ),
]  # fmt: skip


def identify(manifest: Manifest, out: Out, workers: Workers = CORES) -> None:
    """Identify every robot of a manifest. A failure is a row of the table; exit status 1 where there is any."""
    from tauscope.cli.fleet_run import run_fleet

    run_fleet("identify", manifest, out, workers)


def diagnose(manifest: Manifest, out: Out, workers: Workers = CORES) -> None:
    """Diagnose every robot of a manifest. A failure is a row of the table; exit status 1 where there is any."""
    from tauscope.cli.fleet_run import run_fleet

    run_fleet("diagnose", manifest, out, workers)


add_verb(fleet, identify)
add_verb(fleet, diagnose)
