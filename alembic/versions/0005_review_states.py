"""review state, comments, generator and matcher of a project

Revision ID: 0005
Revises: 0004
"""

import sqlalchemy as sa
import sqlmodel

from alembic import op

revision = "0005"
down_revision = "0004"
branch_labels = None
depends_on = None

TEXT = sqlmodel.sql.sqltypes.AutoString
COLUMNS = {"generator": "completion", "matcher": "sift", "review_state": "draft"}


def upgrade() -> None:
    with op.batch_alter_table("projects", schema=None) as batch_op:
        for name, value in COLUMNS.items():
            batch_op.add_column(sa.Column(name, TEXT(), nullable=False, server_default=value))
    op.create_table(
        "comments",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("project_id", TEXT(), nullable=False),
        sa.Column("object_id", sa.Integer(), nullable=True),
        sa.Column("frame", sa.Integer(), nullable=True),
        sa.Column("x", sa.Float(), nullable=True),
        sa.Column("y", sa.Float(), nullable=True),
        sa.Column("point_world", sa.JSON(), nullable=True),
        sa.Column("text", TEXT(), nullable=False),
        sa.Column("who", TEXT(), nullable=False),
        sa.Column("at", sa.Float(), nullable=False),
        sa.Column("resolved_by", TEXT(), nullable=False),
        sa.Column("resolved_at", sa.Float(), nullable=True),
        sa.ForeignKeyConstraint(["object_id"], ["objects.id"], ondelete="CASCADE"),
        sa.ForeignKeyConstraint(["project_id"], ["projects.id"], ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("id"),
        sqlite_autoincrement=True,
    )
    op.create_index("ix_comments_project", "comments", ["project_id"])


def downgrade() -> None:
    op.drop_index("ix_comments_project", "comments")
    op.drop_table("comments")
    with op.batch_alter_table("projects", schema=None) as batch_op:
        for name in COLUMNS:
            batch_op.drop_column(name)
