"""Name of an object in the last run, under which its results are stored."""

import sqlalchemy as sa

from alembic import op

revision = "0015"
down_revision = "0014"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("objects", sa.Column("run_name", sa.String(), nullable=False, server_default=""))


def downgrade() -> None:
    op.drop_column("objects", "run_name")
