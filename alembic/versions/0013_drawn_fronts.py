"""Front of an object as drawn by a person."""

import sqlalchemy as sa

from alembic import op

revision = "0013"
down_revision = "0012"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("objects", sa.Column("front", sa.JSON(), nullable=True))


def downgrade() -> None:
    op.drop_column("objects", "front")
