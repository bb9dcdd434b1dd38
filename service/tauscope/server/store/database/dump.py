"""All rows of a database as lines of JSON, and back: into SQLite or PostgreSQL, whichever they came from."""

import json
from collections.abc import Iterable, Iterator
from datetime import UTC, datetime
from typing import Any

from sqlalchemy import Column, Connection, DateTime, Engine, MetaData, Table, insert, select, text

from tauscope.errors import StoreError
from tauscope.server.store.database.database import WRITES, present_revision, revisions, shown_address, upgrade

_FORM = "alembic_version"


def dump_lines(engine: Engine) -> Iterator[bytes]:
    """Every row, as one moment shows them; the first line holds the form of the tables."""
    # SQLite shows one moment by itself, PostgreSQL when it is told to.
    options = {"isolation_level": "REPEATABLE READ"} if engine.dialect.name == "postgresql" else {}
    with engine.connect().execution_options(**options) as connection:
        tables = _tables(connection)
        yield _line({"revision": present_revision(connection)})
        for table in tables:
            for row in connection.execute(select(table)).mappings():
                yield _line({"table": table.name, "row": {key: _plain(value) for key, value in row.items()}})


def load_lines(engine: Engine, lines: Iterable[bytes]) -> None:
    """Fill an empty database, and bring it to this program's form; all of it, or nothing.

    Raises StoreError if there is something in the database, or the lines are of a newer program.
    """
    rows = (json.loads(line) for line in lines)
    revision = next(rows)["revision"]
    if revision not in revisions():
        raise StoreError(f"the backup was made by a newer Tauscope (form {revision}); restore it with that one")
    with engine.connect() as connection:
        if present_revision(connection) is not None:
            address = shown_address(engine)
            raise StoreError(f"{address}: there is something in this database; give the backup an empty one")
    upgrade(engine, revision)
    with engine.execution_options(**{WRITES: True}).begin() as connection:
        tables = {table.name: table for table in _tables(connection)}
        for entry in rows:
            table = tables[entry["table"]]
            values = {key: _convert_type(table.columns[key], value, connection) for key, value in entry["row"].items()}
            connection.execute(insert(table).values(**values))
        _advance_counters(connection, tables.values())
    upgrade(engine)


def _tables(connection: Connection) -> list[Table]:
    """The tables as they are, each behind those that it refers to."""
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
    """A value as the database takes it."""
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
