"""keys of sent changes, so that a repeated request is not applied twice

Revision ID: 0007
Revises: 0006
"""

import sqlalchemy as sa
import sqlmodel

from alembic import op

revision = "0007"
down_revision = "0006"
branch_labels = None
depends_on = None

TEXT = sqlmodel.sql.sqltypes.AutoString


def upgrade() -> None:
    op.create_table(
        "sent_changes",
        sa.Column("digest", TEXT(), nullable=False),
        sa.Column("request", TEXT(), nullable=False),
        sa.Column("project_id", TEXT(), nullable=True),
        sa.Column("at", sa.Float(), nullable=False),
        sa.Column("status", sa.Integer(), nullable=True),
        sa.Column("answer", TEXT(), nullable=False),
        sa.PrimaryKeyConstraint("digest"),
    )
    op.create_index("ix_sent_changes_project_id", "sent_changes", ["project_id"])
    op.create_index("ix_sent_changes_at", "sent_changes", ["at"])


def downgrade() -> None:
    op.drop_table("sent_changes")
