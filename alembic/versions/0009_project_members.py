"""Owner of a project, and its members if its visibility is restricted."""

import sqlalchemy as sa
import sqlmodel

from alembic import op

revision = "0009"
down_revision = "0008"
branch_labels = None
depends_on = None

TEXT = sqlmodel.sql.sqltypes.AutoString
# the owner is the person who started a project's first job
OWNERS = """
UPDATE projects SET owner_id = (
    SELECT accounts.id FROM jobs JOIN accounts ON accounts.name = jobs.who
    WHERE jobs.project_id = projects.id ORDER BY jobs.id LIMIT 1
)
"""


def upgrade() -> None:
    with op.batch_alter_table("projects") as batch:
        batch.add_column(sa.Column("owner_id", sa.Integer(), nullable=True))
        batch.add_column(sa.Column("members_only", sa.Boolean(), nullable=False, server_default=sa.false()))
        batch.create_foreign_key("fk_projects_owner", "accounts", ["owner_id"], ["id"], ondelete="SET NULL")
    op.create_table(
        "project_members",
        sa.Column("project_id", TEXT(), nullable=False),
        sa.Column("account_id", sa.Integer(), nullable=False),
        sa.PrimaryKeyConstraint("project_id", "account_id"),
        sa.ForeignKeyConstraint(["project_id"], ["projects.id"], ondelete="CASCADE"),
        sa.ForeignKeyConstraint(["account_id"], ["accounts.id"], ondelete="CASCADE"),
    )
    op.execute(OWNERS)


def downgrade() -> None:
    op.drop_table("project_members")
    with op.batch_alter_table("projects") as batch:
        batch.drop_constraint("fk_projects_owner", type_="foreignkey")
        batch.drop_column("members_only")
        batch.drop_column("owner_id")
