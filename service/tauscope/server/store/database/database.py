"""A database that is up to date: short transactions, and failures in our own words."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from sqlalchemy import Engine
from sqlalchemy.exc import DBAPIError, IntegrityError
from sqlalchemy.exc import TimeoutError as PoolTimeoutError
from sqlalchemy.orm import Session

from tauscope.errors import StoreError
from tauscope.robot.messages import one_line
from tauscope.server.store.database.engine import WRITES, open_engine, shown_address
from tauscope.server.store.database.migrate import upgrade

FILE_NAME = "tauscope.db"
"""Of the SQLite database in a data folder."""


class Database:
    """An open database. Every method may be called from any thread."""

    def __init__(self, address: Path | str) -> None:
        """Open a database, and bring its tables to this program's form.

        Raises
        ------
        StoreError
            if it cannot be reached, is damaged, or was written by a newer program
        """
        self._engine = open_engine(address)
        try:
            with self._own_words():
                upgrade(self._engine)
        except BaseException:
            self._engine.dispose()
            raise

    @property
    def engine(self) -> Engine:
        """Of SQLAlchemy, for tests and backups."""
        return self._engine

    @contextmanager
    def reading(self) -> Iterator[Session]:
        """A transaction that reads.

        Raises
        ------
        StoreError
            if the database does not answer
        """
        with self._own_words(), Session(self._engine) as session, session.begin():
            yield session

    @contextmanager
    def writing(self) -> Iterator[Session]:
        """A transaction that writes: all of it is kept, or nothing. Keep it short, others wait meanwhile.

        Raises
        ------
        StoreError
            if the database does not answer, or somebody else writes for longer than we wait
        IntegrityError
            if a row that may be there once is there already
        """
        engine = self._engine.execution_options(**{WRITES: True})
        with self._own_words(), Session(engine, expire_on_commit=False) as session, session.begin():
            session.connection()  # takes SQLite's lock now, not with the first statement
            yield session

    def close(self) -> None:
        """Close every connection."""
        self._engine.dispose()

    @contextmanager
    def _own_words(self) -> Iterator[None]:
        """Failures of the database as StoreError; a broken constraint is the caller's business."""
        try:
            yield
        except IntegrityError:
            raise
        except (DBAPIError, PoolTimeoutError) as error:
            raise StoreError(_described(shown_address(self._engine), error)) from error


def _described(address: str, error: Exception) -> str:
    """What is wrong with a database, and what to do."""
    reason = one_line(str(getattr(error, "orig", None) or error)).strip()
    lower = reason.lower()
    if "not a database" in lower or "malformed" in lower:
        hint = "restore a backup, or move it away: the index is made anew, schedules and the choice of models are not"
        return f"{address}: is damaged ({reason}); {hint}"
    if "locked" in lower or "lock timeout" in lower:
        return f"{address}: another program writes to it for too long ({reason}); try again, or end that program"
    if "full" in lower:
        return f"{address}: the disk is full; make room"
    return f"{address}: cannot be used ({reason}); check that the database can be reached and written to"
