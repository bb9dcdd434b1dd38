"""``tauscope backup`` and ``tauscope restore``: their arguments."""

from pathlib import Path
from typing import Annotated

import typer

from tauscope.cli.store_command import DatabaseUrl, DataFolder


def backup(
    file: Annotated[Path, typer.Argument(metavar="FILE", dir_okay=False, help="File to make, as in monday.tar.gz.")],
    data: DataFolder = None,
    database: DatabaseUrl = None,
) -> None:
    """Write everything that is kept into one file; a service may work with it meanwhile."""
    from tauscope.cli.backup_run import make_backup

    make_backup(file, data, database)


def restore(
    file: Annotated[Path, typer.Argument(metavar="FILE", exists=True, dir_okay=False, help="Of `tauscope backup`.")],
    data: Annotated[Path, typer.Option(metavar="DIR", file_okay=False, help="Data folder to make.")],
    database: DatabaseUrl = None,
) -> None:
    """Make a data folder from a backup; also where the database was one of the other kind."""
    from tauscope.cli.backup_run import use_backup

    use_backup(file, data, database)
