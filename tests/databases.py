"""Tests that are run on both kinds of database: `address` is that of an empty one."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from postgres import Postgres, program_folder, running_postgres
from tauscope.server.store.database.database import Database


@pytest.fixture(scope="session")
def postgres() -> Iterator[Postgres]:
    if program_folder() is None:
        pytest.skip("PostgreSQL is not installed: apt-get install postgresql")
    with running_postgres() as server:
        yield server


@pytest.fixture(params=["sqlite", pytest.param("postgresql", marks=pytest.mark.system)])
def address(request: pytest.FixtureRequest, tmp_path: Path) -> Path | str:
    """Of an empty database of each kind."""
    if request.param == "sqlite":
        return tmp_path / "tauscope.db"
    return request.getfixturevalue("postgres").new_database()


@pytest.fixture
def database(address: Path | str) -> Iterator[Database]:
    opened = Database(address)
    yield opened
    opened.close()
