"""``tauscope store``, ``tauscope backup`` and ``tauscope restore``: a data folder that no service works with."""

from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass
from datetime import timedelta
from enum import StrEnum
from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from tauscope.cli.arguments import name_input
from tauscope.cli.task_run import require_new
from tauscope.cli.terminal import output, say, show_progress, table
from tauscope.cli.verbs import make_group
from tauscope.errors import StoreError, explain_os_errors
from tauscope.number_text import ABSENT, counted
from tauscope.report.tables import Table
from tauscope.server.history.indexer import Indexer, open_index
from tauscope.server.history.model_history import ModelHistory
from tauscope.server.history.retention import RetentionRule, plan_removal, remove
from tauscope.server.http.settings import default_data_folder
from tauscope.server.store.backup import restore_backup, write_backup
from tauscope.server.store.data_folder import FOLDERS, RECORDINGS, FolderLock, item_stores, site_identifier, utc_now
from tauscope.server.store.database.database import FILE_NAME, Database
from tauscope.server.store.database.index import Index
from tauscope.server.store.recordings import RecordingStore
from tauscope.version import tauscope_version

DataFolder = Annotated[
    Path | None, name_input("Data folder; the user's own by default.", "DIR", dir_okay=True, file_okay=False)
]
DatabaseUrl = Annotated[
    str | None,
    Option(
        metavar="URL",
        envvar="TAUSCOPE_DATABASE",
        show_envvar=True,
        show_default=False,
        help="PostgreSQL database; SQLite in the data folder by default.",
    ),
]


class Kind(StrEnum):
    """Kinds of items: a repeated option takes an enumeration, no literal."""

    EXCITATION, RUN, IDENTIFICATION = "excitation", "run", "identification"
    DIAGNOSIS, ROLLOUT, CAMPAIGN = "diagnosis", "rollout", "campaign"


_OWN_FILES = "its state, its order or its result"


@dataclass(frozen=True, eq=False)
class OpenStore:
    folder: Path
    database: Database
    keeper: Indexer


@contextmanager
def open_store(data: Path | None, database: str | None) -> Iterator[OpenStore]:
    """Take a data folder. Raises StoreError if it cannot be used, TauscopeError if a service works with it."""
    folder = data or default_data_folder()
    if not folder.is_dir():
        raise StoreError(f"{folder}: there is no such data folder; name it with --data")
    with ExitStack() as stack:
        stack.callback(FolderLock(folder).release)
        opened = stack.enter_context(closing(Database(database or folder / FILE_NAME)))
        index = Index(opened, site_identifier(folder))
        keeper = open_index(index, item_stores(folder), RecordingStore(folder / RECORDINGS), folder.name)
        keeper.sync(thorough=True)
        yield OpenStore(folder, opened, keeper)


@contextmanager
def open_database(data: Path | None, database: str | None) -> Iterator[Database]:
    """Open the database beside a service. Raises StoreError if there is none, or it cannot be used."""
    path = (data or default_data_folder()) / FILE_NAME
    if database is None and not path.is_file():
        raise StoreError(f"{path}: there is no such database; name the data folder with --data, or serve it once")
    with closing(Database(database or path)) as opened:
        yield opened


def check_store(
    data: DataFolder = None,
    database: DatabaseUrl = None,
    quick: Annotated[bool, Option("--quick", help="Compare sizes only, not every byte.")] = False,
) -> None:
    """Compare every file of every finished item with what it was when the item ended.

    Exit status 1 where a file is missing or is another one. No service may work with the folder meanwhile.
    """
    with show_progress() as progress, open_store(data, database) as store:
        progress(f"compare the files of {store.folder}")
        changed = store.keeper.check(deep=not quick)
        count = sum(len(store.keeper.index.stamps(kind)) for kind in item_stores(store.folder))
        recordings = len(RecordingStore(store.folder / RECORDINGS).entries())
    kept = f"{counted(count, 'item')} and {counted(recordings, 'recording')}"
    if not changed:
        say(f"{store.folder}: {kept}, all as they were")
        return
    own = {"recording": "its bytes"}
    rows = [(item.kind, item.identifier, item.path or own.get(item.kind, _OWN_FILES)) for item in changed]
    output().print(table("Missing or changed", Table(("kind", "item", "file"), rows, words=3)))
    hint = "restore what is damaged from a backup, or remove it"
    raise StoreError(f"{store.folder}: of {kept}, {len(changed)} damaged; {hint}")


def prune_store(
    older_than: Annotated[float, Option("--older-than", min=0.0, metavar="DAYS", help="What is older may go.")],
    data: DataFolder = None,
    database: DatabaseUrl = None,
    kind: Annotated[list[Kind] | None, Option(help="Kind that may go; repeatable; default: every kind.")] = None,
    recordings: Annotated[bool, Option("--recordings", help="Recordings too that nothing else uses.")] = False,
    dry_run: Annotated[bool, Option("--dry-run", help="Say what would go, and remove nothing.")] = False,
) -> None:
    """Remove what is old. Identifications of active models, and whatever is damaged, stay.

    No service may work with the folder meanwhile.
    """
    rule = RetentionRule(timedelta(days=older_than), frozenset(kind or FOLDERS), recordings)
    with open_store(data, database) as store:
        kept = RecordingStore(store.folder / RECORDINGS)
        removal = plan_removal(store.keeper, ModelHistory(store.database), kept, rule, utc_now())
        if not dry_run:
            removers = {kind: items.remove for kind, items in item_stores(store.folder).items()}
            with explain_os_errors(StoreError, f"{store.folder}: cannot be removed from"):
                removal = remove(removal, removers, kept, store.keeper)
    rows = [(entry.kind, entry.identifier, entry.robot or ABSENT) for entry in removal.items]
    rows += [("recording", name, ABSENT) for name in removal.recordings]
    done = "would go" if dry_run else "removed"
    if rows:
        output().print(table(done.capitalize(), Table(("kind", "item", "robot"), rows, words=3)))
    say(f"{store.folder}: {counted(len(rows), 'item')} {done}")


def backup(
    file: Annotated[Path, Argument(metavar="FILE", dir_okay=False, help="File to make, as in monday.tar.gz.")],
    data: DataFolder = None,
    database: DatabaseUrl = None,
) -> None:
    """Write everything that is kept into one file; a service may work with it meanwhile."""
    require_new(file)
    folder = data or default_data_folder()
    with show_progress() as progress, open_database(folder, database) as opened:
        progress(f"copy {folder}")
        with explain_os_errors(StoreError, f"{file}: cannot be written", "; choose another place"):
            count = write_backup(folder, opened, file, tauscope_version())
    say(f"wrote {file}: {counted(count, 'file')} and the database")


def restore(
    file: Annotated[Path, name_input("Of `tauscope backup`.", "FILE", Argument)],
    data: Annotated[Path, Option(metavar="DIR", file_okay=False, help="Data folder to make.")],
    database: DatabaseUrl = None,
) -> None:
    """Make a data folder from a backup; also where the database was one of the other kind."""
    with show_progress() as progress:
        progress(f"unpack {file}")
        with explain_os_errors(StoreError, f"{data}: cannot be written", "; choose another place"):
            count = restore_backup(file, data, database)
    say(f"restored {data}: {counted(count, 'file')} and the database")


store = make_group(check=check_store, prune=prune_store)
