"""robot arm that a project tests its joints with

Revision ID: 0031
Revises: 0030
"""

import sqlalchemy as sa
import sqlmodel

from alembic import op

revision = "0031"
down_revision = "0030"
branch_labels = None
depends_on = None


def upgrade() -> None:
    with op.batch_alter_table("projects") as batch:
        batch.add_column(sa.Column("arm", sqlmodel.sql.sqltypes.AutoString(), nullable=False, server_default="none"))


def downgrade() -> None:
    with op.batch_alter_table("projects") as batch:
        batch.drop_column("arm")
