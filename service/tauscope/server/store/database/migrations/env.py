"""Called by Alembic: takes the steps on the connection that `tauscope.server.store.database.database` gives."""

from alembic import context

from tauscope.server.store.database.tables import Base

if hasattr(context, "config"):  # there is one only while Alembic runs this file
    context.configure(
        connection=context.config.attributes["connection"],
        target_metadata=Base.metadata,
        render_as_batch=True,  # SQLite cannot change a table in place
    )
    with context.begin_transaction():
        context.run_migrations()
