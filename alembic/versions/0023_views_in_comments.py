"""state of the 3D view when a comment was made

Revision ID: 0023
Revises: 0022
"""

import sqlalchemy as sa

from alembic import op

revision = "0023"
down_revision = "0022"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("comments", sa.Column("view", sa.JSON(), nullable=True))


def downgrade() -> None:
    op.drop_column("comments", "view")
