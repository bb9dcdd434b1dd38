"""The database: SQLite beside the data, or PostgreSQL shared by services; opened, migrated, read and written."""

import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

from alembic import command
from alembic.config import Config
from alembic.runtime.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import URL, Connection, Engine, Select, create_engine, event, make_url, text
from sqlalchemy.exc import ArgumentError, DBAPIError, IntegrityError
from sqlalchemy.exc import TimeoutError as PoolTimeoutError
from sqlalchemy.orm import Session
from sqlalchemy.pool import NullPool

from tauscope.errors import StoreError, one_line

TIMEOUT_S = 5  # how long a write waits for another one, and a connection for its server [s]
WRITES = "tauscope_writes"
"""Execution option of a connection that will write: SQLite then takes its lock at the beginning.

A transaction that only later turns out to write could not wait for the lock, because what it has read is old by then.
"""


def open_engine(address: Path | str) -> Engine:
    """An engine; nothing is connected yet. Raises StoreError if it is no URL, or one of another kind of database."""
    url = URL.create("sqlite", database=str(address)) if isinstance(address, Path) else _parse_url(address)
    if url.get_backend_name() == "sqlite":
        engine = create_engine(url, connect_args={"timeout": TIMEOUT_S})
        event.listen(engine, "connect", _prepare_sqlite)
        event.listen(engine, "begin", _begin_sqlite)
        return engine
    options = f"-c lock_timeout={TIMEOUT_S}s"
    return create_engine(
        url.set(drivername="postgresql+psycopg"),
        pool_pre_ping=True,
        connect_args={"connect_timeout": TIMEOUT_S, "options": options},
    )


def show_address(engine: Engine) -> str:
    """What messages call a database: its file, or its URL without the password."""
    url = engine.url
    return str(url.database) if url.get_backend_name() == "sqlite" else url.render_as_string(hide_password=True)


def _parse_url(text: str) -> URL:
    """The URL of a text; only the two kinds that are tested are taken."""
    hint = "write postgresql://user@host/name, or leave it out for SQLite in the data folder"
    try:
        url = make_url(text)
    except ArgumentError:
        # The text may hold a password: it is not repeated.
        raise StoreError(f"the address of the database is no URL; {hint}") from None
    if url.get_backend_name() not in ("postgresql", "sqlite"):
        raise StoreError(f"{url.get_backend_name()}: no kind of database that Tauscope knows; {hint}")
    return url


def _prepare_sqlite(connection: sqlite3.Connection, _record: Any) -> None:
    """Readers never wait for the writer, nothing that was committed is lost, and references hold."""
    connection.isolation_level = None  # transactions are begun below; Python's own begin too late for DDL
    for pragma in ("journal_mode = WAL", "synchronous = FULL", "foreign_keys = ON"):
        connection.execute(f"PRAGMA {pragma}")


def _begin_sqlite(connection: Connection) -> None:
    writes = connection.get_execution_options().get(WRITES, False)
    connection.exec_driver_sql("BEGIN IMMEDIATE" if writes else "BEGIN")


_ADVISORY_LOCK = 7_283_462_001
"""Any number that nobody else uses in the same PostgreSQL database: two services do not migrate at a time."""


def upgrade(engine: Engine, target: str = "head") -> None:
    """Bring the tables to this program's form. Raises StoreError if they have a form that it does not know."""
    with engine.execution_options(**{WRITES: True}).begin() as connection:
        if connection.dialect.name == "postgresql":
            connection.execute(text("SELECT pg_advisory_xact_lock(:key)"), {"key": _ADVISORY_LOCK})
        present = present_revision(connection)
        if present is not None and present not in revisions():
            hint = "use the Tauscope that wrote it, or restore a backup of before"
            raise StoreError(f"{show_address(engine)}: was written by a newer Tauscope (form {present}); {hint}")
        if present != (revisions()[-1] if target == "head" else target):
            command.upgrade(_configuration(connection), target)


def present_revision(connection: Connection) -> str | None:
    """The form that the tables of a database have; None where there are none."""
    return MigrationContext.configure(connection).get_current_revision()


@cache
def revisions() -> tuple[str, ...]:
    scripts = ScriptDirectory.from_config(_configuration(None))
    return tuple(script.revision for script in scripts.walk_revisions())[::-1]


def _configuration(connection: Connection | None) -> Config:
    """Where Alembic finds the steps, and the connection that it takes them on."""
    configuration = Config()
    configuration.set_main_option("script_location", "tauscope.server.store.database:migrations")
    configuration.attributes["connection"] = connection
    return configuration


Row = TypeVar("Row")
FILE_NAME = "tauscope.db"  # of the SQLite database in a data folder
_SQLITE_MAGIC = b"SQLite format 3\0"
_DAMAGE_HINT = "restore a backup, or move it away: the index is made anew, schedules and the choice of models are not"


class Database:
    """An open database. Every method may be called from any thread."""

    def __init__(self, address: Path | str) -> None:
        """Open and upgrade. Raises StoreError if it cannot be reached, is damaged, or of a newer program."""
        self.engine = open_engine(address)
        try:
            if isinstance(address, Path) and address.parent.is_dir():
                address.touch(0o600)  # SQLite gives its further files the same rights
            with self._own_words():
                upgrade(self.engine)
                if self.engine.url.get_backend_name() == "sqlite":
                    _check_file(self.engine.url)
        except BaseException:
            self.engine.dispose()
            raise

    @contextmanager
    def reading(self) -> Iterator[Session]:
        """A transaction that reads. Raises StoreError if the database does not answer."""
        with self._own_words(), Session(self.engine, expire_on_commit=False) as session, session.begin():
            yield session

    def fetch(self, query: Select[Row]) -> list[Row]:
        """What a query of one column, or of one table, finds. Raises StoreError if the database does not answer."""
        with self.reading() as session:
            return list(session.scalars(query))

    @contextmanager
    def writing(self) -> Iterator[Session]:
        """A short transaction that writes. Raises StoreError, or IntegrityError if a unique row is there already."""
        engine = self.engine.execution_options(**{WRITES: True})
        with self._own_words(), Session(engine, expire_on_commit=False) as session, session.begin():
            session.connection()  # takes SQLite's lock now, not with the first statement
            yield session

    def check(self) -> None:
        """Raises StoreError if it does not answer, is damaged, or is another one than was opened."""
        with self._own_words():
            if self.engine.url.get_backend_name() == "sqlite":
                _check_file(self.engine.url)
            with self.engine.connect() as connection:
                present = present_revision(connection)
        if present != revisions()[-1]:
            hint = "restore it from a backup, and start the service again"
            raise StoreError(f"{show_address(self.engine)}: its tables are gone or were changed; {hint}")

    def close(self) -> None:
        self.engine.dispose()

    @contextmanager
    def _own_words(self) -> Iterator[None]:
        """Failures of the database as StoreError; a broken constraint is the caller's business."""
        try:
            yield
        except IntegrityError:
            raise
        except (DBAPIError, PoolTimeoutError) as error:
            raise StoreError(_describe_fault(show_address(self.engine), error)) from error


def _check_file(url: URL) -> None:
    """Read a SQLite file as a new connection sees it: an open one may know pages that are lost on the disk."""
    path = Path(str(url.database))
    try:
        with path.open("rb") as file:
            is_whole = file.read(len(_SQLITE_MAGIC)) == _SQLITE_MAGIC
    except OSError:
        is_whole = False
    engine = create_engine(url, poolclass=NullPool)
    if is_whole:
        with engine.connect() as connection:
            is_whole = connection.execute(text("PRAGMA quick_check(1)")).scalar() == "ok"
    if not is_whole:
        raise StoreError(f"{path}: is damaged; {_DAMAGE_HINT}")


def _describe_fault(address: str, error: Exception) -> str:
    reason = one_line(str(getattr(error, "orig", None) or error)).strip()
    lower = reason.lower()
    if "not a database" in lower or "malformed" in lower:
        return f"{address}: is damaged ({reason}); {_DAMAGE_HINT}"
    if "locked" in lower or "lock timeout" in lower:
        return f"{address}: another program writes to it for too long ({reason}); try again, or end that program"
    if "full" in lower:
        return f"{address}: the disk is full; make room"
    return f"{address}: cannot be used ({reason}); check that the database can be reached and written to"
