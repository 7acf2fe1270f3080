"""owner of a running job, unique across machines; sizes beyond 2 GiB where integers have a fixed width

Revision ID: 0017
Revises: 0016
"""

import sqlalchemy as sa
import sqlmodel

from alembic import op

revision = "0017"
down_revision = "0016"
branch_labels = None
depends_on = None

SIZES = (("projects", "size_bytes"), ("uploads", "size"), ("bundles", "size"))


def upgrade() -> None:
    op.add_column("jobs", sa.Column("owner", sqlmodel.sql.sqltypes.AutoString(), nullable=True))
    op.drop_column("jobs", "owner_pid")
    _sizes_of(sa.BigInteger())


def downgrade() -> None:
    _sizes_of(sa.Integer())
    op.add_column("jobs", sa.Column("owner_pid", sa.Integer(), nullable=True))
    op.drop_column("jobs", "owner")


def _sizes_of(kind: sa.types.TypeEngine[int]) -> None:
    if op.get_bind().dialect.name != "sqlite":  # SQLite integers have no fixed width
        for table, column in SIZES:
            op.alter_column(table, column, type_=kind)
