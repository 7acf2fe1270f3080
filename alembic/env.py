"""Alembic environment: migrations run by the app on its own connection, or by the `alembic` command on R2C2R_DATABASE."""

import os

from sqlalchemy import Connection, create_engine
from sqlmodel import SQLModel

from alembic import context
from app.db import tables  # noqa: F401  (defines the metadata)
from app.settings import DATABASE
from r2c2r_core.disk import DATA_FOLDER, data_folder


def run(connection: Connection) -> None:
    """Run the migrations on an open connection."""
    context.configure(connection=connection, target_metadata=SQLModel.metadata, render_as_batch=True, compare_type=True)
    with context.begin_transaction():
        context.run_migrations()


given = context.config.attributes.get("connection")
if given is not None:
    run(given)
else:
    named = os.environ.get("R2C2R_DATABASE", "")
    with create_engine(named or f"sqlite:///{data_folder(DATA_FOLDER) / DATABASE}").begin() as opened:
        run(opened)
