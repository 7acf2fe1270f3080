"""Context of all services."""

from dataclasses import dataclass
from pathlib import Path

from sqlalchemy import Engine

from app.db.channel import Channel
from app.db.queries import DrawnIn
from app.db.tables import Project
from app.errors import Forbidden
from app.files import ProjectFiles, project_files
from app.gates import Gates
from app.hub import Hub
from app.jobs.live import LiveSegmenters
from app.jobs.runner import Runner
from app.metrics import Metrics
from app.process import Workers
from app.security import Person, Role
from app.services.access import Access
from app.services.at_work import AtWork
from app.services.descriptions import Descriptions
from app.services.oidc import Provider
from app.services.people import People
from app.services.posting import Posting
from app.settings import Settings
from app.store.protocol import Store
from app.viewer.client import Viewer


@dataclass(frozen=True, slots=True, kw_only=True)
class Context:
    """The running app."""

    settings: Settings
    engine: Engine
    hub: Hub
    channel: Channel | None  # to other servers, where the database is shared
    store: Store
    people: People
    access: Access
    uploads: AtWork
    descriptions: Descriptions
    posting: Posting
    person: Person  # user of the request; outside a request, the user who started the server
    runner: Runner
    live: LiveSegmenters
    viewer: Viewer
    gates: Gates  # concurrency limits of heavy requests
    probes: Workers
    metrics: Metrics
    provider: Provider | None  # OpenID provider
    static: Path

    @property
    def who(self) -> str:
        """Name of the current user, as in the history."""
        return self.person.name

    def require(self, role: Role) -> None:
        """Raise Forbidden unless the current user has that role's rights."""
        if not self.person.may(role):
            raise Forbidden(
                f"{self.who} is {self.person.role}; this needs a role of {role}", hint="ask an admin of this server"
            )

    def files(self, project: Project | DrawnIn) -> ProjectFiles:
        """The project's files."""
        return project_files(self.settings.data_dir, project.id, project.work_path)
