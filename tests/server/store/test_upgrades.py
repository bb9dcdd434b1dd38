"""Databases of every earlier form with something in every table: brought up to date whole, killed in between or not."""

import json
import signal
import subprocess
import sys
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
import sqlalchemy as sa
from sqlalchemy import Engine, MetaData

from shared_data import REPOSITORY
from tauscope.server.store.database.database import Database, open_engine, present_revision, revisions, upgrade

NOON = datetime(2026, 11, 3, 12, 0, 0, 250_000, tzinfo=UTC)
KILLED_AT_STATEMENT = """
import os, signal, sys
from pathlib import Path
from sqlalchemy import event
from tauscope.server.store.database.database import open_engine
from tauscope.server.store.database.database import upgrade

def upgrade_until(address, last):
    engine = open_engine(address if "://" in address else Path(address))
    count = 0

    @event.listens_for(engine, "after_cursor_execute")
    def die(_connection, _cursor, statement, *_):
        nonlocal count
        count += statement.lstrip().split()[0].upper() in ("CREATE", "INSERT", "UPDATE", "DELETE", "ALTER", "DROP")
        if count == last:
            os.kill(os.getpid(), signal.SIGKILL)

    upgrade(engine)
    print("statements", count, flush=True)

for line in sys.stdin:  # a process of its own each time, but the modules are loaded once
    child = os.fork()
    if child == 0:
        upgrade_until(sys.argv[1], int(line))
        os._exit(0)
    print("ended", os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
"""


def rows_of(engine: Engine) -> dict[str, list[dict[str, Any]]]:
    """Everything that is in a database, its form apart."""
    tables = MetaData()
    with engine.connect() as connection:
        tables.reflect(connection)
        return {
            table.name: [dict(row) for row in connection.execute(sa.select(table)).mappings()]
            for table in tables.sorted_tables
            if table.name != "alembic_version"
        }


def value_for(column: "sa.Column[Any]", number: int) -> object:
    """Something that such a column holds."""
    match column.type:
        case sa.Boolean():
            return number % 2 == 0
        case sa.Integer():
            return number
        case sa.DateTime():
            return NOON
        case sa.Float() | sa.Numeric():
            return 0.1 * number
        case sa.JSON():
            return {"number": number, "words": ["α", None]}
        case _:
            # SQLite does not say of a text that it holds JSON: a text that is both.
            return json.dumps(f"{column.name} {number}")


def fill(engine: Engine) -> None:
    """Two rows into every table; references lead to the row of the same number."""
    tables = MetaData()
    with engine.begin() as connection:
        tables.reflect(connection)
        made: dict[tuple[str, str, int], object] = {}
        for table in tables.sorted_tables:
            if table.name == "alembic_version":
                continue
            for number in (1, 2):
                row = {}
                for column in table.columns:
                    keys = list(column.foreign_keys)
                    target = (keys[0].column.table.name, keys[0].column.name, number) if keys else None
                    row[column.name] = value_for(column, number) if target is None else made[target]
                    made[table.name, column.name, number] = row[column.name]
                connection.execute(table.insert().values(row))


@pytest.fixture(params=revisions())
def old(request: pytest.FixtureRequest, address: Path | str) -> dict[str, list[dict[str, Any]]]:
    """What is in a database of an earlier form, or of the present one."""
    engine = open_engine(address)
    upgrade(engine, request.param)
    fill(engine)
    before = rows_of(engine)
    engine.dispose()
    assert all(len(rows) == 2 for rows in before.values())
    return before


def kept(address: Path | str, old: dict[str, list[dict[str, Any]]]) -> None:
    """Everything that was there is there, in the present form."""
    Database(address).close()
    engine = open_engine(address)
    now = rows_of(engine)
    with engine.connect() as connection:
        assert present_revision(connection) == revisions()[-1]
    engine.dispose()
    for table, rows in old.items():
        assert [{name: row[name] for name in before} for row, before in zip(now[table], rows, strict=True)] == rows


def test_nothing_is_lost_or_changed(address: Path | str, old: dict[str, list[dict[str, Any]]]) -> None:
    kept(address, old)


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_a_program_that_is_killed_in_the_middle_leaves_the_form_of_before(
    address: Path | str, old: dict[str, list[dict[str, Any]]]
) -> None:
    """After each statement in turn, until there is none left; what is left open is taken back by the database."""
    words = [sys.executable, "-c", KILLED_AT_STATEMENT, str(address)]
    with subprocess.Popen(
        words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1, cwd=REPOSITORY
    ) as upgrades:
        assert upgrades.stdin is not None
        assert upgrades.stdout is not None
        number = 1
        upgrades.stdin.write("1\n")
        while (told := upgrades.stdout.readline()) == f"ended {-signal.SIGKILL}\n":
            engine = open_engine(address)
            assert rows_of(engine) == old, f"after statement {number}"
            engine.dispose()
            number += 1
            upgrades.stdin.write(f"{number}\n")
        assert told == f"statements {number - 1}\n"
        assert upgrades.stdout.readline() == "ended 0\n"
        upgrades.stdin.close()
    kept(address, old)
