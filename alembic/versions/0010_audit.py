"""audit of sign-ins and accounts; keys of printed addresses, each valid for one browser

Revision ID: 0010
Revises: 0009
"""

import sqlalchemy as sa
import sqlmodel

from alembic import op

revision = "0010"
down_revision = "0009"
branch_labels = None
depends_on = None

TEXT = sqlmodel.sql.sqltypes.AutoString


def upgrade() -> None:
    op.create_table(
        "audit",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("at", sa.Float(), nullable=False),
        sa.Column("action", TEXT(), nullable=False),
        sa.Column("account", TEXT(), nullable=False),
        sa.Column("who", TEXT(), nullable=False),
        sa.Column("client", TEXT(), nullable=False),
        sa.Column("detail", TEXT(), nullable=False),
        sa.PrimaryKeyConstraint("id"),
        sqlite_autoincrement=True,
    )
    op.create_index("ix_audit_action", "audit", ["action", "id"])
    op.create_table(
        "launch_keys",
        sa.Column("digest", TEXT(), nullable=False),
        sa.Column("created", sa.Float(), nullable=False),
        sa.PrimaryKeyConstraint("digest"),
    )


def downgrade() -> None:
    op.drop_table("launch_keys")
    op.drop_table("audit")
