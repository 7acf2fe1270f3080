"""tags and archive of projects, and a trash before deletion

Revision ID: 0019
Revises: 0018
"""

import sqlalchemy as sa

from alembic import op

revision = "0019"
down_revision = "0018"
branch_labels = None
depends_on = None


def upgrade() -> None:
    with op.batch_alter_table("projects") as projects:
        projects.add_column(sa.Column("tags", sa.JSON(), nullable=False, server_default="[]"))
        projects.add_column(sa.Column("archived", sa.Boolean(), nullable=False, server_default=sa.false()))
        projects.add_column(sa.Column("trashed", sa.Float(), nullable=True))


def downgrade() -> None:
    with op.batch_alter_table("projects") as projects:
        for name in ("trashed", "archived", "tags"):
            projects.drop_column(name)
