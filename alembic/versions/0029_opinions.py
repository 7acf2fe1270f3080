"""projects that are a second opinion on another one

Revision ID: 0029
Revises: 0028
"""

import sqlalchemy as sa
import sqlmodel

from alembic import op

revision = "0029"
down_revision = "0028"
branch_labels = None
depends_on = None


def upgrade() -> None:
    with op.batch_alter_table("projects") as batch:
        batch.add_column(sa.Column("opinion_of", sqlmodel.sql.sqltypes.AutoString(), nullable=True))


def downgrade() -> None:
    with op.batch_alter_table("projects") as batch:
        batch.drop_column("opinion_of")
