"""Corrections of an object in single frames."""

import sqlalchemy as sa

from alembic import op

revision = "0014"
down_revision = "0013"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("objects", sa.Column("frames", sa.JSON(), nullable=False, server_default="{}"))


def downgrade() -> None:
    op.drop_column("objects", "frames")
