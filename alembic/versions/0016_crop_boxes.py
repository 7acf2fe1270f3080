"""Crop box around an object, drawn by a person."""

import sqlalchemy as sa

from alembic import op

revision = "0016"
down_revision = "0015"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("objects", sa.Column("crop", sa.JSON(), nullable=True))


def downgrade() -> None:
    op.drop_column("objects", "crop")
