"""Backups: one file with everything of a data folder and its database, also while a service works with them."""

import gzip
import hashlib
import io
import json
import os
import shutil
import tarfile
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import IO, Any

from sqlalchemy import Column, Connection, DateTime, Engine, MetaData, Table, insert, select, text
from sqlalchemy.exc import SQLAlchemyError

from tauscope.errors import StoreError
from tauscope.files import open_atomically, sync_folder
from tauscope.server.store.database import database as store
from tauscope.server.store.files import hash_file

_FORM = "alembic_version"


def dump_lines(engine: Engine) -> Iterator[bytes]:
    """Every row, as one moment shows them; the first line holds the form of the tables."""
    # SQLite shows one moment by itself, PostgreSQL when it is told to.
    options = {"isolation_level": "REPEATABLE READ"} if engine.dialect.name == "postgresql" else {}
    with engine.connect().execution_options(**options) as connection:
        tables = _tables(connection)
        yield _line({"revision": store.present_revision(connection)})
        for table in tables:
            for row in connection.execute(select(table)).mappings():
                yield _line({"table": table.name, "row": {key: _plain(value) for key, value in row.items()}})


def load_lines(engine: Engine, lines: Iterable[bytes]) -> None:
    """Fill an empty database and upgrade it. Raises StoreError if it is not empty, or the lines are newer."""
    rows = (json.loads(line) for line in lines)
    revision = next(rows)["revision"]
    if revision not in store.revisions():
        raise StoreError(f"the backup was made by a newer Tauscope (form {revision}); restore it with that one")
    with engine.connect() as connection:
        if store.present_revision(connection) is not None:
            address = store.show_address(engine)
            raise StoreError(f"{address}: there is something in this database; give the backup an empty one")
    store.upgrade(engine, revision)
    with engine.execution_options(**{store.WRITES: True}).begin() as connection:
        tables = {table.name: table for table in _tables(connection)}
        for entry in rows:
            table = tables[entry["table"]]
            values = {key: _convert_type(table.columns[key], value, connection) for key, value in entry["row"].items()}
            connection.execute(insert(table).values(**values))
        _advance_counters(connection, tables.values())
    store.upgrade(engine)


def _tables(connection: Connection) -> list[Table]:
    metadata = MetaData()
    metadata.reflect(connection)
    return [table for table in metadata.sorted_tables if table.name != _FORM]


def _line(content: dict[str, Any]) -> bytes:
    return json.dumps(content, ensure_ascii=False).encode() + b"\n"


def _plain(value: Any) -> Any:
    """A value as JSON holds it; moments in UTC."""
    if isinstance(value, datetime):
        return (value.replace(tzinfo=UTC) if value.tzinfo is None else value.astimezone(UTC)).isoformat()
    return value


def _convert_type(column: Column[Any], value: Any, connection: Connection) -> Any:
    if value is None or not isinstance(column.type, DateTime):
        return value
    moment = datetime.fromisoformat(value)
    return moment.replace(tzinfo=None) if connection.dialect.name == "sqlite" else moment


def _advance_counters(connection: Connection, tables: Iterable[Table]) -> None:
    """PostgreSQL's counters begin behind the rows that were written with their numbers."""
    if connection.dialect.name != "postgresql":
        return
    for table in tables:
        if "id" in table.columns:
            highest = connection.execute(text(f"SELECT max(id) FROM {table.name}")).scalar()  # noqa: S608 - our own names
            if highest is not None:
                connection.execute(
                    text("SELECT setval(pg_get_serial_sequence(:name, 'id'), :highest)"),
                    {"name": table.name, "highest": highest},
                )


FORM = "tauscope.backup/1"
_DATABASE, _MANIFEST, _DATA = "database.jsonl", "manifest.json", "data"
_STATES = ("state.json", "run.json")
_PIECE = 2**20


def write_backup(data_folder: Path, database: store.Database, target: Path, version: str) -> int:
    """The database first, then each folder's state: copies can only be newer, as after a crash. Raises OSError."""
    hashes: dict[str, dict[str, Any]] = {}
    with (
        open_atomically(target) as file,
        gzip.open(file, "wb", compresslevel=3) as packed,
        tarfile.open(fileobj=packed, mode="w|") as archive,
    ):
        with tempfile.TemporaryFile() as lines:
            lines.writelines(dump_lines(database.engine))
            _add(archive, _DATABASE, lines, hashes)
        for path in _files(data_folder):
            with suppress(FileNotFoundError), path.open("rb") as content:  # else it was removed meanwhile
                name = f"{_DATA}/{path.relative_to(data_folder).as_posix()}"
                _add(archive, name, content, hashes, os.fstat(content.fileno()).st_mtime)
        manifest = {"form": FORM, "created": datetime.now(UTC).isoformat(), "version": version, "files": hashes}
        _add(archive, _MANIFEST, io.BytesIO(json.dumps(manifest, indent=1).encode()), {})
    sync_folder(target.parent)
    return len(hashes) - 1


def restore_backup(source: Path, data_folder: Path, address: str | None) -> int:
    """Make a data folder; nothing appears before all was found sound. Raises StoreError or OSError."""
    if data_folder.exists() and (not data_folder.is_dir() or any(data_folder.iterdir())):
        raise StoreError(f"{data_folder}: there is something already; name a folder that is not there yet")
    data_folder.parent.mkdir(parents=True, exist_ok=True)
    staged = Path(tempfile.mkdtemp(prefix=f".{data_folder.name}-", dir=data_folder.parent))
    try:
        hashes = _unpack(source, staged)
        content = staged / _DATA
        content.mkdir(exist_ok=True)
        _fill_database(staged / _DATABASE, content / store.FILE_NAME if address is None else address)
        if data_folder.exists():
            data_folder.rmdir()
        content.rename(data_folder)
        sync_folder(data_folder.parent)
    finally:
        shutil.rmtree(staged, ignore_errors=True)
    return len(hashes) - 1


def _files(data_folder: Path) -> Iterator[Path]:
    """Regular files, each folder's state first; neither the database nor what is half made."""
    for root, folders, names in os.walk(data_folder):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        for name in sorted(names, key=lambda name: (name not in _STATES, name)):
            path = Path(root) / name
            is_database = Path(root) == data_folder and name.startswith(store.FILE_NAME)
            if not name.startswith(".") and not is_database and not path.is_symlink() and path.is_file():
                yield path


def _add(
    archive: tarfile.TarFile, name: str, file: IO[bytes], hashes: dict[str, dict[str, Any]], modified: float = 0.0
) -> None:
    """Add the bytes of a file up to its present end, and note what they were."""
    size = file.seek(0, os.SEEK_END)
    file.seek(0)
    entry = tarfile.TarInfo(name)
    entry.size, entry.mode, entry.mtime = size, 0o640, modified
    reader = _Hashing(file, size)
    archive.addfile(entry, reader)  # pyright: ignore[reportArgumentType] - `read` is all that is used
    hashes[name] = {"size": size, "sha256": reader.digest(), "modified": modified}


class _Hashing:
    def __init__(self, file: IO[bytes], size: int) -> None:
        self._file, self._left, self._hash = file, size, hashlib.sha256()

    def read(self, count: int) -> bytes:
        """The next bytes; a file that was cut off meanwhile is filled up with zeros, and found damaged later."""
        wanted = min(count, self._left)
        piece = self._file.read(wanted).ljust(wanted, b"\0")
        self._left -= len(piece)
        self._hash.update(piece)
        return piece

    def digest(self) -> str:
        return self._hash.hexdigest()


def _unpack(source: Path, staged: Path) -> dict[str, Any]:
    """Unpack a backup; what it holds is what its manifest says, or nothing of it is used."""
    try:
        found, manifest = {}, None
        with tarfile.open(source, "r|gz") as archive:
            for entry in archive:
                is_foreign = not entry.isreg() or not _is_confined(entry.name) or entry.name in found
                content = None if is_foreign else archive.extractfile(entry)
                if content is None:
                    raise _refuse(source, f"{entry.name}: does not belong there")
                if entry.name == _MANIFEST:
                    manifest = json.loads(content.read())
                else:
                    found[entry.name] = _write(content, staged / entry.name)
    except (tarfile.TarError, EOFError, OSError, ValueError) as error:
        if isinstance(error, OSError) and error.errno is not None and not isinstance(error, gzip.BadGzipFile):
            raise
        raise _refuse(source, str(error)) from None
    if manifest is None or manifest.get("form") != FORM:
        raise _refuse(source, "its manifest is missing, or of another form")
    expected = {name: (entry["size"], entry["sha256"]) for name, entry in manifest["files"].items()}
    wrong = sorted(name for name in expected.keys() | found.keys() if expected.get(name) != found.get(name))
    if wrong:
        raise _refuse(source, f"{wrong[0]} is not what was written")
    for name, entry in manifest["files"].items():
        os.utime(staged / name, (entry["modified"], entry["modified"]))
    return expected


def _write(file: IO[bytes], path: Path) -> tuple[int, str]:
    """Write a file; its size and its sha256."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("xb") as target:
        shutil.copyfileobj(file, target, _PIECE)
        target.flush()
        os.fsync(target.fileno())
    path.chmod(0o640)
    return path.stat().st_size, hash_file(path)


def _is_confined(name: str) -> bool:
    parts = name.split("/")
    return name in (_DATABASE, _MANIFEST) or (
        parts[0] == _DATA and len(parts) > 1 and all(part not in ("", ".", "..") and "\0" not in part for part in parts)
    )


def _fill_database(lines: Path, address: Path | str) -> None:
    engine = store.open_engine(address)
    try:
        with lines.open("rb") as file:
            load_lines(engine, file)
    except SQLAlchemyError as error:
        raise StoreError(f"the database cannot be filled ({str(error).splitlines()[0]}); give an empty one") from None
    finally:
        engine.dispose()


def _refuse(source: Path, reason: str) -> StoreError:
    return StoreError(f"{source}: is damaged or no backup of Tauscope's ({reason}); use another one")
