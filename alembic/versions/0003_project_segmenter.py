"""segmenter of a project

Revision ID: 0003
Revises: 0002
"""

import sqlalchemy as sa
import sqlmodel

from alembic import op

revision = "0003"
down_revision = "0002"
branch_labels = None
depends_on = None


def upgrade() -> None:
    with op.batch_alter_table("projects", schema=None) as batch_op:
        column = sa.Column("segmenter", sqlmodel.sql.sqltypes.AutoString(), nullable=False, server_default="geometric")
        batch_op.add_column(column)


def downgrade() -> None:
    with op.batch_alter_table("projects", schema=None) as batch_op:
        batch_op.drop_column("segmenter")
