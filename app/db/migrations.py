"""Revisions of the tables: which there are, and bringing a file to the newest with a copy of the older one kept."""

import time
from pathlib import Path

from alembic.config import Config
from alembic.runtime.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import Engine, inspect
from sqlmodel import SQLModel

from alembic import command
from app.db.sqlite import RESTORE, copy_database
from app.errors import DatabaseUnusable
from app.settings import shipped

KEPT_COPIES = 3  # of databases before a migration


def migrate(engine: Engine, revision: str = "head") -> None:
    """Bring the file to a revision; an empty file becomes a complete one, an older one is copied to backups/ first."""
    config = _config()
    with engine.begin() as connection:
        now = MigrationContext.configure(connection).get_current_revision()
    if now not in (None, revisions()[-1]):
        _keep_copy(Path(engine.url.database or ""), str(now))
    with engine.begin() as connection:
        config.attributes["connection"] = connection
        command.upgrade(config, revision)


def revisions() -> list[str]:
    """All revisions, oldest first."""
    return [script.revision for script in ScriptDirectory.from_config(_config()).walk_revisions()][::-1]


def require_tables(engine: Engine) -> None:
    """Raise DatabaseUnusable for a file whose tables are not those of tables.py, whatever its revision says."""
    found = inspect(engine)
    names = set(found.get_table_names())
    for table in SQLModel.metadata.sorted_tables:
        columns = {column["name"] for column in found.get_columns(table.name)} if table.name in names else set()
        missing = sorted({column.name for column in table.columns} - columns)
        if missing:
            what = f"column {', '.join(missing)} of table {table.name}" if columns else f"table {table.name}"
            raise DatabaseUnusable(
                f"{engine.url.database}: a database without {what}",
                hint=RESTORE,
            )


def _config() -> Config:
    config = Config()
    config.set_main_option("script_location", str(shipped("alembic", "env.py")).replace("%", "%%"))
    config.set_main_option("path_separator", "os")
    return config


def _keep_copy(database: Path, revision: str) -> None:
    """A copy of the file as it is, named for its revision; the oldest such copies go."""
    folder = database.parent / "backups"
    copy_database(database, folder / f"before-{revision}-{time.strftime('%Y%m%d-%H%M%S')}.db")
    copies = sorted(folder.glob("before-*.db"), key=lambda path: path.stat().st_mtime)
    for path in copies[:-KEPT_COPIES]:
        path.unlink()
