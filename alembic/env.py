"""How migrations are run: by the app on its own connection, or by the `alembic` command on R2C2R_DATABASE."""

import os
from pathlib import Path

from sqlalchemy import Connection, create_engine
from sqlmodel import SQLModel

from alembic import context
from app.db import tables  # noqa: F401  (defines the metadata)
from app.settings import default_data_dir


def run(connection: Connection) -> None:
    """Run the migrations on an open connection."""
    context.configure(connection=connection, target_metadata=SQLModel.metadata, render_as_batch=True, compare_type=True)
    with context.begin_transaction():
        context.run_migrations()


given = context.config.attributes.get("connection")
if given is not None:
    run(given)
else:
    database = Path(os.environ.get("R2C2R_DATABASE", default_data_dir() / "r2c2r.db"))
    with create_engine(f"sqlite:///{database}").begin() as opened:
        run(opened)
