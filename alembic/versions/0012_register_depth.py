"""Option to register a project's depth to its colour images when the recording is read."""

import sqlalchemy as sa

from alembic import op

revision = "0012"
down_revision = "0011"
branch_labels = None
depends_on = None


def upgrade() -> None:
    # Not in a batch: that rebuilds the table, and dropping the old one deletes all rows that refer to it
    op.add_column("projects", sa.Column("register_depth", sa.Boolean(), nullable=False, server_default=sa.false()))


def downgrade() -> None:
    op.drop_column("projects", "register_depth")
