"""``tauscope store``: work with a data folder that no service works with."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import timedelta
from pathlib import Path

from tauscope.cli.output_files import require_new
from tauscope.cli.terminal import output, plain, shown_progress, table
from tauscope.errors import StoreError
from tauscope.number_text import ABSENT, counted
from tauscope.report.tables import Table
from tauscope.server.history.indexer import Indexer, open_index
from tauscope.server.history.model_history import ModelHistory
from tauscope.server.history.retention import RetentionRule, plan_removal, remove
from tauscope.server.http.settings import default_data_folder
from tauscope.server.store.backup import restore_backup, write_backup
from tauscope.server.store.data_folder import FOLDERS, RECORDINGS, FolderLock, item_stores, site_identifier
from tauscope.server.store.database.database import FILE_NAME, Database
from tauscope.server.store.database.index import Index
from tauscope.server.store.items import utc_now
from tauscope.server.store.recordings import RecordingStore
from tauscope.version import tauscope_version

_OWN_FILES = "its state, its order or its result"


@dataclass(frozen=True, eq=False)
class OpenStore:
    """A data folder that is this process's own for a while."""

    folder: Path
    database: Database
    keeper: Indexer


@contextmanager
def open_store(data: Path | None, database: str | None) -> Iterator[OpenStore]:
    """Take a data folder.

    Raises StoreError if there is no such folder, or its database cannot be used. Raises TauscopeError if a service
    works with it.
    """
    folder = data or default_data_folder()
    if not folder.is_dir():
        raise StoreError(f"{folder}: there is no such data folder; name it with --data")
    lock = FolderLock(folder)
    try:
        opened = Database(database or folder / FILE_NAME)
        try:
            index = Index(opened, site_identifier(folder))
            keeper = open_index(index, item_stores(folder), RecordingStore(folder / RECORDINGS), folder.name)
            keeper.sync(thorough=True)
            yield OpenStore(folder, opened, keeper)
        finally:
            opened.close()
    finally:
        lock.release()


@contextmanager
def open_database(data: Path | None, database: str | None) -> Iterator[Database]:
    """Open the database alone, beside a service that may work with it.

    Raises StoreError if there is none, or it cannot be used.
    """
    path = (data or default_data_folder()) / FILE_NAME
    if database is None and not path.is_file():
        raise StoreError(f"{path}: there is no such database; name the data folder with --data, or serve it once")
    opened = Database(database or path)
    try:
        yield opened
    finally:
        opened.close()


def check_store(data: Path | None, database: str | None, *, quick: bool) -> None:
    """Compare every file of every finished item with what it was when the item ended.

    Raises StoreError if a file is missing or is another one.
    """
    with shown_progress() as progress, open_store(data, database) as store:
        progress(f"compare the files of {store.folder}")
        changed = store.keeper.check(deep=not quick)
        count = sum(len(store.keeper.index.stamps(kind)) for kind in item_stores(store.folder))
        recordings = len(RecordingStore(store.folder / RECORDINGS).entries())
    kept = f"{counted(count, 'item')} and {counted(recordings, 'recording')}"
    if not changed:
        output().print(plain(f"{store.folder}: {kept}, all as they were"), soft_wrap=True)
        return
    own = {"recording": "its bytes"}
    rows = [(item.kind, item.identifier, item.path or own.get(item.kind, _OWN_FILES)) for item in changed]
    output().print(table("Missing or changed", Table(("kind", "item", "file"), rows, words=3)))
    hint = "restore what is damaged from a backup, or remove it"
    raise StoreError(f"{store.folder}: of {kept}, {len(changed)} damaged; {hint}")


def prune_store(
    data: Path | None,
    database: str | None,
    days: float,
    kinds: Sequence[str],
    *,
    recordings: bool,
    dry_run: bool,
) -> None:
    """Remove what is old.

    Raises StoreError if the database cannot be used, or something cannot be removed.

    `days`: age [days].
    """
    rule = RetentionRule(timedelta(days=days), frozenset(kinds or FOLDERS), recordings)
    with open_store(data, database) as store:
        kept = RecordingStore(store.folder / RECORDINGS)
        removal = plan_removal(store.keeper, ModelHistory(store.database), kept, rule, utc_now())
        if not dry_run:
            try:
                removers = {kind: items.remove for kind, items in item_stores(store.folder).items()}
                removal = remove(removal, removers, kept, store.keeper)
            except OSError as error:
                raise StoreError(f"{store.folder}: cannot be removed from ({error.strerror or error})") from error
    rows = [(entry.kind, entry.identifier, entry.robot or ABSENT) for entry in removal.items]
    rows += [("recording", name, ABSENT) for name in removal.recordings]
    done = "would go" if dry_run else "removed"
    if rows:
        output().print(table(done.capitalize(), Table(("kind", "item", "robot"), rows, words=3)))
    output().print(plain(f"{store.folder}: {counted(len(rows), 'item')} {done}"), soft_wrap=True)


def make_backup(file: Path, data: Path | None, database: str | None) -> None:
    """Write everything that is kept into one file.

    Raises ExportError if the file is there already. Raises StoreError if the database cannot be used, or the file
    cannot be written.
    """
    require_new(file)
    folder = data or default_data_folder()
    with shown_progress() as progress, open_database(folder, database) as opened:
        progress(f"copy {folder}")
        try:
            count = write_backup(folder, opened, file, tauscope_version())
        except OSError as error:
            raise StoreError(f"{file}: cannot be written ({error.strerror or error}); choose another place") from error
    output().print(plain(f"wrote {file}: {counted(count, 'file')} and the database"), soft_wrap=True)


def use_backup(file: Path, data: Path, database: str | None) -> None:
    """Make a data folder from a backup.

    Raises StoreError if the backup is damaged, there is something already, or it cannot be written.
    """
    with shown_progress() as progress:
        progress(f"unpack {file}")
        try:
            count = restore_backup(file, data, database)
        except OSError as error:
            raise StoreError(f"{data}: cannot be written ({error.strerror or error}); choose another place") from error
    output().print(plain(f"restored {data}: {counted(count, 'file')} and the database"), soft_wrap=True)
