"""Models over time."""

import sqlalchemy as sa
from alembic import op

from tauscope.server.store.database.tables import PLAIN

revision = "0002"
down_revision = "0001"


def upgrade() -> None:
    op.create_table(
        "model_events",
        sa.Column("id", sa.Integer(), primary_key=True),
        sa.Column("robot_id", sa.Integer(), sa.ForeignKey("robots.id"), nullable=False),
        *(sa.Column(name, sa.String(), nullable=False) for name in ("kind", "parameter", "text")),
        sa.Column("details", PLAIN, nullable=False),
        *(sa.Column(name, sa.DateTime(timezone=True), nullable=False) for name in ("raised", "last_seen")),
        sa.Column("closed", sa.DateTime(timezone=True)),
        sa.Column("note", sa.String()),
    )
    _create_partial_index("uq_model_events_open", "model_events", ["robot_id", "kind", "parameter"], "closed IS NULL")
    op.create_table(
        "models",
        sa.Column("id", sa.Integer(), primary_key=True),
        sa.Column("robot_id", sa.Integer(), sa.ForeignKey("robots.id"), nullable=False),
        sa.Column("site", sa.String(), sa.ForeignKey("sites.identifier"), nullable=False),
        sa.Column("identifier", sa.String(), nullable=False, index=True),
        *(sa.Column(name, sa.DateTime(timezone=True), nullable=False) for name in ("created", "considered")),
        *(sa.Column(name, sa.String(), nullable=False) for name in ("source", "state")),
        sa.Column("gates", PLAIN, nullable=False),
        *(sa.Column(name, sa.Boolean(), nullable=False) for name in ("is_active", "is_reference")),
        sa.Column("document", PLAIN),
        sa.UniqueConstraint("site", "identifier"),
    )
    op.create_index(None, "models", ["robot_id", "created"])
    _create_partial_index("uq_models_active", "models", ["robot_id"], "is_active")
    _create_partial_index("uq_models_reference", "models", ["robot_id"], "is_reference")
    op.create_table(
        "robot_policies",
        sa.Column("robot_id", sa.Integer(), sa.ForeignKey("robots.id"), primary_key=True),
        sa.Column("document", PLAIN, nullable=False),
    )
    op.create_table(
        "model_choices",
        sa.Column("id", sa.Integer(), primary_key=True),
        sa.Column("robot_id", sa.Integer(), sa.ForeignKey("robots.id"), nullable=False, index=True),
        sa.Column("model_id", sa.Integer(), sa.ForeignKey("models.id"), nullable=False),
        sa.Column("role", sa.String(), nullable=False),
        sa.Column("at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("reason", sa.String(), nullable=False),
    )


def _create_partial_index(name: str, table: str, columns: list[str], where: str) -> None:
    op.create_index(name, table, columns, unique=True, sqlite_where=sa.text(where), postgresql_where=sa.text(where))
