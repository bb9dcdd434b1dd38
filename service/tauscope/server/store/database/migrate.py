"""Bringing a database to the form that this program knows: all steps in one transaction, or none."""

from alembic import command
from alembic.config import Config
from alembic.runtime.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import Connection, Engine, text

from tauscope.errors import StoreError
from tauscope.server.store.database.engine import WRITES, shown_address

_ADVISORY_LOCK = 7_283_462_001
"""Any number that nobody else uses in the same PostgreSQL database: two services do not migrate at a time."""


def upgrade(engine: Engine, target: str = "head") -> None:
    """Bring the tables to this program's form; nothing happens where they have it.

    Raises
    ------
    StoreError
        if the tables have a form that this program does not know
    """
    with engine.execution_options(**{WRITES: True}).begin() as connection:
        if connection.dialect.name == "postgresql":
            connection.execute(text("SELECT pg_advisory_xact_lock(:key)"), {"key": _ADVISORY_LOCK})
        present = present_revision(connection)
        if present is not None and present not in revisions():
            hint = "use the Tauscope that wrote it, or restore a backup of before"
            raise StoreError(f"{shown_address(engine)}: was written by a newer Tauscope (form {present}); {hint}")
        command.upgrade(_configuration(connection), target)


def present_revision(connection: Connection) -> str | None:
    """The form that the tables of a database have; None where there are none."""
    return MigrationContext.configure(connection).get_current_revision()


def revisions() -> list[str]:
    """All forms that this program knows, the oldest first."""
    scripts = ScriptDirectory.from_config(_configuration(None))
    return [script.revision for script in scripts.walk_revisions()][::-1]


def _configuration(connection: Connection | None) -> Config:
    """Where Alembic finds the steps, and the connection that it takes them on."""
    configuration = Config()
    configuration.set_main_option("script_location", "tauscope.server.store.database:migrations")
    configuration.attributes["connection"] = connection
    return configuration
