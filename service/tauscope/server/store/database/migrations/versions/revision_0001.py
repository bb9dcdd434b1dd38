"""The index of what is kept."""

import sqlalchemy as sa
from alembic import op

revision = "0001"
down_revision = None


def upgrade() -> None:
    op.create_table(
        "robots",
        sa.Column("id", sa.Integer(), primary_key=True),
        sa.Column("name", sa.String(), nullable=False, unique=True),
        sa.Column("first_seen", sa.DateTime(timezone=True), nullable=False),
        sa.Column("last_seen", sa.DateTime(timezone=True), nullable=False),
    )
    op.create_table(
        "sites",
        sa.Column("identifier", sa.String(), primary_key=True),
        sa.Column("label", sa.String(), nullable=False),
        sa.Column("last_seen", sa.DateTime(timezone=True), nullable=False),
    )
    op.create_table(
        "items",
        sa.Column("id", sa.Integer(), primary_key=True),
        sa.Column("site", sa.String(), sa.ForeignKey("sites.identifier"), nullable=False),
        sa.Column("kind", sa.String(), nullable=False),
        sa.Column("identifier", sa.String(), nullable=False),
        sa.Column("robot_id", sa.Integer(), sa.ForeignKey("robots.id")),
        sa.Column("state", sa.String(), nullable=False),
        sa.Column("is_final", sa.Boolean(), nullable=False),
        sa.Column("stamp", sa.String(), nullable=False),
        sa.Column("created", sa.DateTime(timezone=True), nullable=False),
        sa.Column("ended", sa.DateTime(timezone=True)),
        *(sa.Column(name, sa.String()) for name in ("problem_code", "problem_detail", "backend")),
        *(sa.Column(name, sa.Double()) for name in ("relative_error", "held_out_error")),
        sa.Column("verdict", sa.String()),
        sa.UniqueConstraint("site", "kind", "identifier"),
    )
    op.create_index(None, "items", ["kind", "created"])
    op.create_index(None, "items", ["robot_id", "created"])
    op.create_table(
        "recordings",
        sa.Column("id", sa.Integer(), primary_key=True),
        sa.Column("site", sa.String(), sa.ForeignKey("sites.identifier"), nullable=False),
        sa.Column("name", sa.String(), nullable=False),
        sa.Column("size", sa.BigInteger(), nullable=False),
        sa.Column("modified", sa.DateTime(timezone=True), nullable=False),
        sa.Column("sha256", sa.String()),
        sa.UniqueConstraint("site", "name"),
    )
    op.create_table(
        "artefacts",
        sa.Column("item_id", sa.Integer(), sa.ForeignKey("items.id", ondelete="CASCADE"), primary_key=True),
        sa.Column("path", sa.String(), primary_key=True),
        sa.Column("size", sa.BigInteger(), nullable=False),
        sa.Column("sha256", sa.String(), nullable=False),
    )
    op.create_table(
        "recording_uses",
        sa.Column("item_id", sa.Integer(), sa.ForeignKey("items.id", ondelete="CASCADE"), primary_key=True),
        *(sa.Column(name, sa.String(), primary_key=True) for name in ("role", "name")),
        sa.Column("origin", sa.String(), nullable=False),
        sa.Column("sha256", sa.String(), nullable=False, index=True),
    )
