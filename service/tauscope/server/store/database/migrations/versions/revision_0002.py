"""Models over time."""

import sqlalchemy as sa
from alembic import op

from tauscope.server.store.database.tables import PLAIN

revision = "0002"
down_revision = "0001"


def upgrade() -> None:
    op.create_table(
        "model_events",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("robot_id", sa.Integer(), nullable=False),
        sa.Column("kind", sa.String(), nullable=False),
        sa.Column("parameter", sa.String(), nullable=False),
        sa.Column("text", sa.String(), nullable=False),
        sa.Column("details", PLAIN, nullable=False),
        sa.Column("raised", sa.DateTime(timezone=True), nullable=False),
        sa.Column("last_seen", sa.DateTime(timezone=True), nullable=False),
        sa.Column("closed", sa.DateTime(timezone=True), nullable=True),
        sa.Column("note", sa.String(), nullable=True),
        sa.ForeignKeyConstraint(["robot_id"], ["robots.id"], name=op.f("fk_model_events_robot_id")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_model_events")),
    )
    with op.batch_alter_table("model_events", schema=None) as batch_op:
        batch_op.create_index(
            "uq_model_events_open",
            ["robot_id", "kind", "parameter"],
            unique=True,
            sqlite_where=sa.text("closed IS NULL"),
            postgresql_where=sa.text("closed IS NULL"),
        )

    op.create_table(
        "models",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("robot_id", sa.Integer(), nullable=False),
        sa.Column("site", sa.String(), nullable=False),
        sa.Column("identifier", sa.String(), nullable=False),
        sa.Column("created", sa.DateTime(timezone=True), nullable=False),
        sa.Column("considered", sa.DateTime(timezone=True), nullable=False),
        sa.Column("source", sa.String(), nullable=False),
        sa.Column("state", sa.String(), nullable=False),
        sa.Column("gates", PLAIN, nullable=False),
        sa.Column("is_active", sa.Boolean(), nullable=False),
        sa.Column("is_reference", sa.Boolean(), nullable=False),
        sa.Column("document", PLAIN, nullable=True),
        sa.ForeignKeyConstraint(["robot_id"], ["robots.id"], name=op.f("fk_models_robot_id")),
        sa.ForeignKeyConstraint(["site"], ["sites.identifier"], name=op.f("fk_models_site")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_models")),
        sa.UniqueConstraint("site", "identifier", name=op.f("uq_models_site_identifier")),
    )
    with op.batch_alter_table("models", schema=None) as batch_op:
        batch_op.create_index(batch_op.f("ix_models_identifier"), ["identifier"], unique=False)
        batch_op.create_index(batch_op.f("ix_models_robot_id_created"), ["robot_id", "created"], unique=False)
        batch_op.create_index(
            "uq_models_active",
            ["robot_id"],
            unique=True,
            sqlite_where=sa.text("is_active"),
            postgresql_where=sa.text("is_active"),
        )
        batch_op.create_index(
            "uq_models_reference",
            ["robot_id"],
            unique=True,
            sqlite_where=sa.text("is_reference"),
            postgresql_where=sa.text("is_reference"),
        )

    op.create_table(
        "robot_policies",
        sa.Column("robot_id", sa.Integer(), nullable=False),
        sa.Column("document", PLAIN, nullable=False),
        sa.ForeignKeyConstraint(["robot_id"], ["robots.id"], name=op.f("fk_robot_policies_robot_id")),
        sa.PrimaryKeyConstraint("robot_id", name=op.f("pk_robot_policies")),
    )
    op.create_table(
        "model_choices",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("robot_id", sa.Integer(), nullable=False),
        sa.Column("model_id", sa.Integer(), nullable=False),
        sa.Column("role", sa.String(), nullable=False),
        sa.Column("at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("reason", sa.String(), nullable=False),
        sa.ForeignKeyConstraint(["model_id"], ["models.id"], name=op.f("fk_model_choices_model_id")),
        sa.ForeignKeyConstraint(["robot_id"], ["robots.id"], name=op.f("fk_model_choices_robot_id")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_model_choices")),
    )
    with op.batch_alter_table("model_choices", schema=None) as batch_op:
        batch_op.create_index(batch_op.f("ix_model_choices_robot_id"), ["robot_id"], unique=False)
