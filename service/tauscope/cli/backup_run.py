"""``tauscope backup`` and ``tauscope restore``: everything that is kept, in one file and back."""

from pathlib import Path

from tauscope.cli.output_files import require_new
from tauscope.cli.store_run import open_database
from tauscope.cli.terminal import output, plain, shown_progress
from tauscope.errors import StoreError
from tauscope.number_text import counted
from tauscope.server.http.settings import default_data_folder
from tauscope.server.store.backup import restore_backup, write_backup
from tauscope.version import tauscope_version


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
