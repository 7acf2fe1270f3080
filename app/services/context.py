"""What every use case works with."""

from dataclasses import dataclass
from pathlib import Path

from sqlalchemy import Engine

from app.db.tables import Project
from app.files import ProjectFiles, project_files
from app.hub import Hub
from app.jobs.live import LiveSegmenters
from app.jobs.runner import Runner
from app.security import Keys
from app.settings import Settings
from app.viewer.client import Viewer


@dataclass(frozen=True, slots=True, kw_only=True)
class Context:
    """The running app."""

    settings: Settings
    engine: Engine
    hub: Hub
    keys: Keys
    runner: Runner
    live: LiveSegmenters
    viewer: Viewer
    static: Path

    def files(self, project: Project) -> ProjectFiles:
        """Where the project's files are."""
        return project_files(self.settings.data_dir, project.id, project.work_path)
