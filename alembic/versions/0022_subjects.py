"""subject of a person at an identity provider, which is never reassigned

Revision ID: 0022
Revises: 0021
"""

import sqlalchemy as sa
import sqlmodel

from alembic import op

revision = "0022"
down_revision = "0021"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("accounts", sa.Column("subject", sqlmodel.sql.sqltypes.AutoString(), nullable=True))
    op.create_index("ix_accounts_subject", "accounts", ["subject"], unique=True)


def downgrade() -> None:
    op.drop_index("ix_accounts_subject", "accounts")
    op.drop_column("accounts", "subject")
