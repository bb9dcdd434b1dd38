"""Schedules and their firings."""

import sqlalchemy as sa
from alembic import op

from tauscope.server.store.database.tables import PLAIN

revision = "0003"
down_revision = "0002"


def upgrade() -> None:
    op.create_table(
        "schedules",
        sa.Column("id", sa.Integer(), primary_key=True),
        sa.Column("name", sa.String(), nullable=False, unique=True),
        sa.Column("site", sa.String()),
        *(sa.Column(name, PLAIN, nullable=False) for name in ("definition", "order", "files")),
        sa.Column("created", sa.DateTime(timezone=True), nullable=False),
        sa.Column("next_due", sa.DateTime(timezone=True), index=True),
    )
    op.create_table(
        "firings",
        sa.Column("id", sa.Integer(), primary_key=True),
        sa.Column("schedule_id", sa.Integer(), sa.ForeignKey("schedules.id", ondelete="CASCADE"), nullable=False),
        sa.Column("due", sa.DateTime(timezone=True), nullable=False),
        sa.Column("is_asked", sa.Boolean(), nullable=False),
        sa.Column("claimed", sa.DateTime(timezone=True)),
        *(sa.Column(name, sa.String()) for name in ("site", "boot")),
        sa.Column("state", sa.String(), nullable=False, index=True),
        *(sa.Column(name, sa.String()) for name in ("reason", "item_kind", "item_identifier")),
        sa.UniqueConstraint("schedule_id", "due", "is_asked"),
    )
