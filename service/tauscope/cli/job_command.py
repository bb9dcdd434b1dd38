"""``tauscope job``: its arguments."""

from typing import Annotated

import typer

from tauscope.cli.store_command import DatabaseUrl, DataFolder
from tauscope.cli.verbs import add_verb

job = typer.Typer(
    help="Do what a schedule repeats, from a timer of the system or by hand.",
    no_args_is_help=True,
    rich_markup_mode=None,
)


def run(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Name of the schedule.")],
    data: DataFolder = None,
    database: DatabaseUrl = None,
    timeout_s: Annotated[
        float, typer.Option("--timeout", min=1.0, metavar="S", help="How long its end is waited for [s].")
    ] = 6 * 3600.0,
) -> None:
    """Do what a schedule repeats now, and wait for its end: for systemd timers, cron and Kubernetes.

    A service that works with the data folder does it; where there is none, this command does. Exit status 0 where it
    succeeded; 1, with the reason, where it failed or nothing was started. Nothing is repeated by itself.
    """
    from tauscope.cli.job_run import run_job

    run_job(name, data, database, timeout_s)


def list_(data: DataFolder = None, database: DatabaseUrl = None) -> None:
    """Show all schedules, and what came of each the last time."""
    from tauscope.cli.job_run import list_jobs

    list_jobs(data, database)


add_verb(job, run)
add_verb(job, list_, name="list")
