"""``tauscope store``, ``tauscope backup`` and ``tauscope restore``: their arguments."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from tauscope.cli.verbs import add_verb

store = typer.Typer(help="Look after what is kept.", no_args_is_help=True, rich_markup_mode=None)

DataFolder = Annotated[
    Path | None,
    typer.Option(metavar="DIR", exists=True, file_okay=False, help="Data folder; the user's own by default."),
]
DatabaseUrl = Annotated[
    str | None,
    typer.Option(
        metavar="URL",
        envvar="TAUSCOPE_DATABASE",
        show_envvar=True,
        show_default=False,
        help="PostgreSQL database; SQLite in the data folder by default.",
    ),
]


class Kind(StrEnum):
    """Kinds of items."""

    EXCITATION = "excitation"
    RUN = "run"
    IDENTIFICATION = "identification"
    DIAGNOSIS = "diagnosis"
    ROLLOUT = "rollout"
    CAMPAIGN = "campaign"


def check(
    data: DataFolder = None,
    database: DatabaseUrl = None,
    quick: Annotated[bool, typer.Option("--quick", help="Compare sizes only, not every byte.")] = False,
) -> None:
    """Compare every file of every finished item with what it was when the item ended.

    Exit status 1 where a file is missing or is another one. No service may work with the folder meanwhile.
    """
    from tauscope.cli.store_run import check_store

    check_store(data, database, quick=quick)


def prune(
    older_than: Annotated[
        float, typer.Option("--older-than", min=0.0, metavar="DAYS", help="What ended longer ago may go.")
    ],
    data: DataFolder = None,
    database: DatabaseUrl = None,
    kind: Annotated[
        list[Kind] | None, typer.Option(help="Kind of item that may go, once for each; every kind by default.")
    ] = None,
    recordings: Annotated[
        bool, typer.Option("--recordings", help="Recordings too that nothing which stays was made from.")
    ] = False,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Say what would go, and remove nothing.")] = False,
) -> None:
    """Remove what is old. Identifications of active models, and whatever is damaged, stay.

    No service may work with the folder meanwhile.
    """
    from tauscope.cli.store_run import prune_store

    prune_store(data, database, older_than, [each.value for each in kind or []], recordings=recordings, dry_run=dry_run)


add_verb(store, check)
add_verb(store, prune)


def backup(
    file: Annotated[Path, typer.Argument(metavar="FILE", dir_okay=False, help="File to make, as in monday.tar.gz.")],
    data: DataFolder = None,
    database: DatabaseUrl = None,
) -> None:
    """Write everything that is kept into one file; a service may work with it meanwhile."""
    from tauscope.cli.store_run import make_backup

    make_backup(file, data, database)


def restore(
    file: Annotated[Path, typer.Argument(metavar="FILE", exists=True, dir_okay=False, help="Of `tauscope backup`.")],
    data: Annotated[Path, typer.Option(metavar="DIR", file_okay=False, help="Data folder to make.")],
    database: DatabaseUrl = None,
) -> None:
    """Make a data folder from a backup; also where the database was one of the other kind."""
    from tauscope.cli.store_run import use_backup

    use_backup(file, data, database)
