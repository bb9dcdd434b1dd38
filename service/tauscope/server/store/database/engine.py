"""The connection to a database: SQLite in the data folder, or PostgreSQL by its address."""

import sqlite3
from pathlib import Path
from typing import Any

from sqlalchemy import URL, Connection, Engine, create_engine, event, make_url
from sqlalchemy.exc import ArgumentError

from tauscope.errors import StoreError

PATIENCE_S = 5
"""How long a write waits for another one, and a connection for its server [s]."""

WRITES = "tauscope_writes"
"""Execution option of a connection that will write: SQLite then takes its lock at the beginning.

A transaction that only later turns out to write could not wait for the lock, because what it has read is old by then.
"""


def open_engine(address: Path | str) -> Engine:
    """An engine; nothing is connected yet.

    Raises
    ------
    StoreError
        if it is no URL, or one of another kind of database
    """
    url = URL.create("sqlite", database=str(address)) if isinstance(address, Path) else _parsed(address)
    if url.get_backend_name() == "sqlite":
        engine = create_engine(url, connect_args={"timeout": PATIENCE_S})
        event.listen(engine, "connect", _prepare_sqlite)
        event.listen(engine, "begin", _begin_sqlite)
        return engine
    options = f"-c lock_timeout={PATIENCE_S}s"
    return create_engine(
        url.set(drivername="postgresql+psycopg"),
        pool_pre_ping=True,
        connect_args={"connect_timeout": PATIENCE_S, "options": options},
    )


def shown_address(engine: Engine) -> str:
    """What messages call a database: its file, or its URL without the password."""
    url = engine.url
    return str(url.database) if url.get_backend_name() == "sqlite" else url.render_as_string(hide_password=True)


def _parsed(text: str) -> URL:
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
    """Begin a transaction."""
    writes = connection.get_execution_options().get(WRITES, False)
    connection.exec_driver_sql("BEGIN IMMEDIATE" if writes else "BEGIN")
