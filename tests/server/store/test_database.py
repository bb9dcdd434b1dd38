"""The database: its forms, its transactions, its failures in our own words; the same on SQLite and PostgreSQL."""

import sqlite3
import threading
from datetime import UTC, datetime, timedelta, timezone
from pathlib import Path
from typing import Any

import pytest
from alembic.autogenerate import compare_metadata
from alembic.runtime.migration import MigrationContext
from sqlalchemy import inspect, select, text
from sqlalchemy.exc import IntegrityError

from tauscope.errors import StoreError
from tauscope.server.store.database.database import Database, open_engine, present_revision, revisions, upgrade
from tauscope.server.store.database.tables import Base, Item, Robot, Site

NOON = datetime(2026, 11, 3, 12, 0, 0, 250_000, tzinfo=UTC)


def test_the_steps_lead_to_the_tables_that_the_program_knows(database: Database) -> None:
    with database.engine.connect() as connection:
        context = MigrationContext.configure(connection, opts={"compare_type": True, "compare_server_default": True})
        assert compare_metadata(context, Base.metadata) == []
        assert present_revision(connection) == revisions()[-1]


def test_every_step_by_itself_leads_there_too(address: Path | str) -> None:
    engine = open_engine(address)
    for revision in revisions():
        upgrade(engine, revision)
    with engine.connect() as connection:
        assert compare_metadata(MigrationContext.configure(connection), Base.metadata) == []
    engine.dispose()


def test_opening_twice_changes_nothing(address: Path | str) -> None:
    first = Database(address)
    with first.writing() as session:
        session.add(Robot(name="arm", first_seen=NOON, last_seen=NOON))
    first.close()
    second = Database(address)
    with second.reading() as session:
        assert session.scalars(select(Robot.name)).all() == ["arm"]
    second.close()


def test_a_database_of_a_newer_program_is_refused_and_left_alone(address: Path | str) -> None:
    database = Database(address)
    with database.engine.begin() as connection:
        connection.execute(text("UPDATE alembic_version SET version_num = '9999'"))
    database.close()
    with pytest.raises(StoreError, match=r"was written by a newer Tauscope \(form 9999\)") as raised:
        Database(address)
    assert "\n" not in str(raised.value)
    engine = open_engine(address)
    with engine.connect() as connection:
        assert present_revision(connection) == "9999"
    engine.dispose()


def test_a_step_that_fails_leaves_nothing_behind(address: Path | str, monkeypatch: pytest.MonkeyPatch) -> None:
    from alembic.operations import Operations

    create = Operations.create_table

    def fail_at_items(self: Operations, name: str, *columns: Any, **options: Any) -> Any:
        if name == "items":
            raise OSError("the disk is gone")
        return create(self, name, *columns, **options)

    with monkeypatch.context() as patched:
        patched.setattr(Operations, "create_table", fail_at_items)
        with pytest.raises(OSError, match="the disk is gone"):
            Database(address)
    engine = open_engine(address)
    assert inspect(engine).get_table_names() == []
    engine.dispose()
    Database(address).close()


def test_a_moment_is_the_same_in_every_time_zone(database: Database) -> None:
    elsewhere = NOON.astimezone(timezone(timedelta(hours=-7)))
    with database.writing() as session:
        session.add(Site(identifier="a", label="cell 3", last_seen=elsewhere))
    with database.reading() as session:
        found = session.scalars(select(Site).where(Site.last_seen == NOON)).one().last_seen
        assert (found, found.tzinfo) == (NOON, UTC)


def test_a_time_without_zone_is_refused(database: Database) -> None:
    with pytest.raises(Exception, match="has no time zone"), database.writing() as session:
        session.add(Site(identifier="a", label="cell 3", last_seen=NOON.replace(tzinfo=None)))


def test_all_of_a_transaction_or_nothing(database: Database) -> None:
    def fail_at_the_end() -> None:
        with database.writing() as session:
            session.add(Robot(name="arm", first_seen=NOON, last_seen=NOON))
            session.flush()
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail_at_the_end()
    with database.reading() as session:
        assert session.scalars(select(Robot)).all() == []


def test_references_hold(database: Database) -> None:
    with pytest.raises(IntegrityError), database.writing() as session:
        session.add(
            Item(
                site="nowhere",
                kind="run",
                identifier="x",
                state="created",
                is_final=False,
                stamp="",
                created=NOON,
            )
        )


def test_many_writers_lose_nothing(database: Database) -> None:
    with database.writing() as session:
        session.add(Robot(name="0", first_seen=NOON, last_seen=NOON))
    failures: list[BaseException] = []

    def count_on() -> None:
        try:
            for _ in range(25):
                with database.writing() as session:
                    robot = session.scalars(select(Robot).with_for_update()).one()
                    robot.name = str(int(robot.name) + 1)
        except BaseException as error:
            failures.append(error)

    threads = [threading.Thread(target=count_on) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert failures == []
    with database.reading() as session:
        assert session.scalars(select(Robot.name)).one() == "100"


def test_sqlite_is_set_to_lose_nothing_that_was_committed(tmp_path: Path) -> None:
    database = Database(tmp_path / "tauscope.db")
    with database.engine.connect() as connection:
        found = [
            connection.execute(text(f"PRAGMA {name}")).scalar_one()
            for name in ("journal_mode", "synchronous", "foreign_keys", "busy_timeout")
        ]
    database.close()
    assert found == ["wal", 2, 1, 5000]


@pytest.mark.parametrize("content", [b"this is no database at all" * 100, b"SQLite format 3\0" + bytes(5000)])
def test_a_damaged_file_is_said_to_be_so_and_left_alone(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "tauscope.db"
    path.write_bytes(content)
    with pytest.raises(StoreError, match=r"tauscope\.db: is damaged .*restore a backup"):
        Database(path)
    assert path.read_bytes()[:1000] == content[:1000]


def test_a_locked_database_is_said_to_be_locked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tauscope.server.store.database.database.TIMEOUT_S", 0.05)
    path = tmp_path / "tauscope.db"
    database = Database(path)
    other = sqlite3.connect(path, isolation_level=None)
    other.execute("BEGIN IMMEDIATE")
    with pytest.raises(StoreError, match="another program writes to it"), database.writing():
        pass
    with database.reading() as session:  # whoever reads does not wait
        assert session.scalars(select(Robot)).all() == []
    other.close()
    with database.writing() as session:
        session.add(Robot(name="arm", first_seen=NOON, last_seen=NOON))
    database.close()


@pytest.mark.parametrize(
    ("address", "message"),
    [
        ("postgresql://me:geheim@/x?host=/nowhere/at/all", r"postgresql\S*://me:\*\*\*@/x\S*: cannot be used"),
        ("mysql://me:geheim@db/x", "mysql: no kind of database"),
        ("no url: geheim", "is no URL"),
    ],
    ids=["not there", "another kind", "no URL"],
)
def test_an_address_that_leads_nowhere(address: str, message: str) -> None:
    with pytest.raises(StoreError, match=message) as raised:
        Database(address)
    assert "\n" not in str(raised.value)
    assert "geheim" not in str(raised.value)
