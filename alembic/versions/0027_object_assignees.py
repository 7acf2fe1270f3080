"""assignee of an object

Revision ID: 0027
Revises: 0026
"""

import sqlalchemy as sa
import sqlmodel

from alembic import op

revision = "0027"
down_revision = "0026"
branch_labels = None
depends_on = None


def upgrade() -> None:
    with op.batch_alter_table("objects") as batch:
        batch.add_column(sa.Column("assignee", sqlmodel.sql.sqltypes.AutoString(), nullable=True))
        batch.create_index("ix_objects_assignee", ["assignee"])


def downgrade() -> None:
    with op.batch_alter_table("objects") as batch:
        batch.drop_index("ix_objects_assignee")
        batch.drop_column("assignee")
