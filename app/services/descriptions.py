"""Updates of `project.json` in each project's folder after committed changes.

A background thread writes at most every PAUSE_S and for at most a SHARE of the time, as clicks come faster than that, and a
large project's file takes longer to write. Updates missed in a crash are made at the next start.
"""

import logging
import threading
import time
from collections.abc import Callable, Iterable
from contextlib import suppress

from sqlalchemy import Engine
from sqlmodel import select

from app.db.description import changed, describe, read_description, written
from app.db.engine import reading
from app.db.tables import Project
from app.errors import NotFound
from app.files import ProjectFiles, free_name, project_files
from app.schemas.description import Description
from app.settings import Settings
from r2c2r_core.errors import InputError

_log = logging.getLogger(__name__)

PAUSE_S = 2.0
SHARE = 0.05


class Descriptions:
    """Keeps the files up to date. `note` is thread-safe and does not wait."""

    def __init__(self, engine: Engine, settings: Settings) -> None:
        self._engine, self._settings = engine, settings
        self._waiting: set[str] = set()
        self._changed = threading.Condition()
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="descriptions", daemon=True)
        engine.update_execution_options(projects_changed=self.note)

    def start(self) -> None:
        """Write outdated descriptions, then watch for changes."""
        self._thread.start()

    def note(self, projects: Iterable[str]) -> None:
        """Record projects with committed changes."""
        with self._changed:
            self._waiting.update(projects)
            self._changed.notify()

    def stop(self) -> None:
        """Write pending descriptions, and end."""
        self._stopping.set()
        self.note(())
        if self._thread.is_alive():
            self._thread.join()

    def _run(self) -> None:
        self._each(self._catch_up, self._all())
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._waiting or self._stopping.is_set())
                found, self._waiting = self._waiting, set()
            began = time.monotonic()
            self._each(self._write, found)
            if not found:  # nothing is pending, and it is stopping
                return
            self._stopping.wait(max(PAUSE_S, (time.monotonic() - began) / SHARE))

    def _each(self, do: Callable[[str], None], projects: Iterable[str]) -> None:
        for project_id in projects:
            try:
                do(project_id)
            except Exception:  # a full disk, or anything else; the next change or start tries again
                _log.exception("project.json of %s", project_id)

    def _all(self) -> list[str]:
        try:
            with reading(self._engine) as session:
                return list(session.exec(select(Project.id)))
        except Exception:  # the edge of the thread
            _log.exception("project.json")
            return []

    def _catch_up(self, project_id: str) -> None:
        """Write the file if it is older than the rows, or of an older version.

        A newer file indicates a restored database, and is set aside.
        """
        files = project_files(self._settings.data_dir, project_id)
        with reading(self._engine) as session:
            row = session.get(Project, project_id)
            now = changed(session, row) if row else 0.0
        said = _described(files)
        if said is not None and said.changed > now:
            kept = free_name(self._settings.unknown, f"{project_id}-newer")
            kept.mkdir(parents=True)
            files.description.replace(kept / files.description.name)
            _log.warning(
                "%s: its project.json is newer than the database; moved to %s, where an admin can adopt it", project_id, kept
            )
        if said is None or said.changed != now or said.true_lengths is None:
            self._write(project_id)

    def _write(self, project_id: str) -> None:
        """Write the project's current description if it has a folder."""
        with reading(self._engine) as session:
            row = session.get(Project, project_id)
            if row is None:
                return
            files = project_files(self._settings.data_dir, project_id, row.work_path)
            description = describe(session, row, files)
        with suppress(NotFound):
            files.write(files.description, written(description))


def _described(files: ProjectFiles) -> Description | None:
    """Content of project.json; None where it is missing or unreadable."""
    try:
        return read_description(files.description)
    except (FileNotFoundError, InputError):
        return None
