"""assignee of a project, and each person's read position in its history

Revision ID: 0026
Revises: 0025
"""

import sqlalchemy as sa
import sqlmodel

from alembic import op

revision = "0026"
down_revision = "0025"
branch_labels = None
depends_on = None


def upgrade() -> None:
    with op.batch_alter_table("projects") as batch:
        batch.add_column(sa.Column("assignee_id", sa.Integer(), nullable=True))
        batch.create_foreign_key("fk_projects_assignee", "accounts", ["assignee_id"], ["id"], ondelete="SET NULL")
    op.create_table(
        "seen",
        sa.Column("project_id", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("account_id", sa.Integer(), nullable=False),
        sa.Column("event", sa.Integer(), nullable=False),
        sa.Column("at", sa.Float(), nullable=False),
        sa.ForeignKeyConstraint(["account_id"], ["accounts.id"], ondelete="CASCADE"),
        sa.ForeignKeyConstraint(["project_id"], ["projects.id"], ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("project_id", "account_id"),
    )


def downgrade() -> None:
    op.drop_table("seen")
    with op.batch_alter_table("projects") as batch:
        batch.drop_constraint("fk_projects_assignee", type_="foreignkey")
        batch.drop_column("assignee_id")
