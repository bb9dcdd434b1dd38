"""Backups: what was kept comes back as it was, in either kind of database; a damaged one changes nothing."""

import io
import json
import tarfile
import threading
from collections.abc import Callable
from datetime import timedelta
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import text

from identified import NOON, candidate, identified
from postgres import Postgres
from snapshots import SNAPSHOTS, unpacked
from tauscope.errors import StoreError
from tauscope.server.history.model_history import ModelHistory
from tauscope.server.store.backup import dump_lines, restore_backup, write_backup
from tauscope.server.store.database.database import FILE_NAME, Database
from tauscope.server.store.database.index import Index, ItemMetadata


@pytest.fixture
def data(tmp_path: Path) -> Path:
    return unpacked(SNAPSHOTS[-1], tmp_path)


def fill(database: Database) -> ModelHistory:
    index = Index(database, "here")
    index.register("data", NOON)
    index.put([ItemMetadata("run", "20251103T110000Z-00000002", "finished", True, "9", NOON, robot="arm α")])
    history = ModelHistory(database)
    for day, viscous in ((1, 0.5), (40, 0.8)):
        given = candidate(day, identified({"viscous": viscous}, friction__0__std__viscous=0.01), robot="arm α")
        history.consider(given, given.created + timedelta(minutes=1))
    return history


def bytes_below(folder: Path) -> dict[str, tuple[bytes, int]]:
    return {
        str(path.relative_to(folder)): (path.read_bytes(), int(path.stat().st_mtime))
        for path in sorted(folder.rglob("*"))
        if path.is_file() and not any(part.startswith((".", FILE_NAME)) for part in path.relative_to(folder).parts)
    }


def rows(database: Database) -> list[Any]:
    """All of a database; PostgreSQL keeps the keys of an object in an order of its own, and no sign of zero."""
    return [json.loads(line) for line in dump_lines(database.engine)]


def restored(tmp_path: Path, data: Path, database: Database, address: str | None = None) -> Database:
    write_backup(data, database, tmp_path / "x.tar.gz", "1.2.3")
    restore_backup(tmp_path / "x.tar.gz", tmp_path / "new", address)
    assert bytes_below(tmp_path / "new") == bytes_below(data)
    return Database(address or tmp_path / "new" / FILE_NAME)


def test_everything_comes_back_and_goes_on(database: Database, data: Path, tmp_path: Path) -> None:
    """From either kind of database into SQLite."""
    fill(database)
    new = restored(tmp_path, data, database)
    assert rows(new) == rows(database)
    history = ModelHistory(new)
    given = candidate(41, identified(), robot="arm α")
    assert history.consider(given, given.created).state == "active"
    assert [entry.state for entry in history.models("arm α", 10)] == ["active", "kept", "kept"]
    new.close()


@pytest.mark.system
def test_from_sqlite_to_postgresql(data: Path, tmp_path: Path, postgres: Postgres) -> None:
    database = Database(data / FILE_NAME)
    fill(database)
    new = restored(tmp_path, data, database, postgres.new_database())
    assert rows(new) == rows(database)
    given = candidate(41, identified(), robot="arm α")
    assert ModelHistory(new).consider(given, given.created).state == "active"  # its number is not taken
    new.close()
    database.close()


def test_a_database_that_holds_something_is_left_alone(database: Database, address: Path | str, data: Path) -> None:
    fill(database)
    write_backup(data, database, data.parent / "x.tar.gz", "1.2.3")
    if isinstance(address, str):
        with pytest.raises(StoreError, match="there is something in this database"):
            restore_backup(data.parent / "x.tar.gz", data.parent / "new", address)
        assert not (data.parent / "new").exists()
    with pytest.raises(StoreError, match="there is something already"):
        restore_backup(data.parent / "x.tar.gz", data, None)


def test_a_backup_of_a_newer_program_is_refused(data: Path, tmp_path: Path) -> None:
    database = Database(data / FILE_NAME)
    with database.engine.begin() as connection:
        connection.execute(text("UPDATE alembic_version SET version_num = '9999'"))
    write_backup(data, database, tmp_path / "x.tar.gz", "9.9.9")
    database.close()
    with pytest.raises(StoreError, match=r"newer Tauscope \(form 9999\)"):
        restore_backup(tmp_path / "x.tar.gz", tmp_path / "new", None)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["data", "x.tar.gz"]


def cut(content: bytes) -> bytes:
    return content[: len(content) // 2]


def flip(content: bytes) -> bytes:
    middle = len(content) // 2
    return content[:middle] + bytes([content[middle] ^ 0x10]) + content[middle + 1 :]


@pytest.mark.parametrize("damage", [cut, flip, lambda content: b"", lambda content: b"no archive" * 99])
def test_a_damaged_backup_changes_nothing(damage: Callable[[bytes], bytes], data: Path, tmp_path: Path) -> None:
    database = Database(data / FILE_NAME)
    write_backup(data, database, tmp_path / "x.tar.gz", "1.2.3")
    database.close()
    (tmp_path / "x.tar.gz").write_bytes(damage((tmp_path / "x.tar.gz").read_bytes()))
    with pytest.raises(StoreError, match=r"x\.tar\.gz: is damaged or no backup") as raised:
        restore_backup(tmp_path / "x.tar.gz", tmp_path / "new", None)
    assert "\n" not in str(raised.value)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["data", "x.tar.gz"]


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("../evil", tarfile.REGTYPE),
        ("data/../../evil", tarfile.REGTYPE),
        ("/tmp/evil", tarfile.REGTYPE),
        ("elsewhere", tarfile.REGTYPE),
        ("data/link", tarfile.SYMTYPE),
        ("data/device", tarfile.CHRTYPE),
    ],
)
def test_nothing_leads_out_of_the_folder(name: str, kind: bytes, tmp_path: Path) -> None:
    entry = tarfile.TarInfo(name)
    entry.type, entry.linkname, entry.size = kind, "/etc/passwd", 4 if kind == tarfile.REGTYPE else 0
    with tarfile.open(tmp_path / "x.tar.gz", "w:gz") as archive:
        archive.addfile(entry, io.BytesIO(b"evil"))
    with pytest.raises(StoreError, match="does not belong there"):
        restore_backup(tmp_path / "x.tar.gz", tmp_path / "deep" / "new", None)
    assert list((tmp_path / "deep").iterdir()) == []


def test_what_is_half_made_stays_out(data: Path, tmp_path: Path) -> None:
    (data / "identifications" / ".staged-x").mkdir()
    (data / "identifications" / ".staged-x" / "order.json").write_bytes(b"{")
    (data / "recordings" / ".incoming-x").mkdir()
    (data / "link").symlink_to("/etc/passwd")
    database = Database(data / FILE_NAME)
    write_backup(data, database, tmp_path / "x.tar.gz", "1.2.3")
    database.close()
    with tarfile.open(tmp_path / "x.tar.gz") as archive:
        names = archive.getnames()
    assert names[0] == "database.jsonl"
    assert names[-1] == "manifest.json"
    assert not [name for name in names if "/." in name or FILE_NAME in name or name.endswith("link")]


def test_a_backup_while_everything_changes_can_be_restored(database: Database, data: Path, tmp_path: Path) -> None:
    history, stop = fill(database), threading.Event()

    def write_on() -> None:
        day = 50
        while not stop.is_set():
            day += 1
            given = candidate(day, identified(), robot="arm α")
            history.consider(given, given.created)
            with (data / "growing.jsonl").open("ab") as file:
                file.write(b"x" * 1000)
            (data / "recordings" / f"{day}.csv").write_bytes(b"t" * 5000)
            (data / "recordings" / f"{day - 3}.csv").unlink(missing_ok=True)

    writer = threading.Thread(target=write_on)
    writer.start()
    try:
        for number in range(3):
            write_backup(data, database, tmp_path / f"{number}.tar.gz", "1.2.3")
    finally:
        stop.set()
        writer.join()
    for number in range(3):
        restore_backup(tmp_path / f"{number}.tar.gz", tmp_path / f"new{number}", None)
        new = Database(tmp_path / f"new{number}" / FILE_NAME)
        assert [entry.state for entry in ModelHistory(new).models("arm α", 10_000)].count("active") == 1
        new.close()
