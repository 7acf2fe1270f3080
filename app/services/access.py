"""Read access to projects: all users, unless the owner or an admin has restricted it to members.

Checked for every request and every message, so it is cached in memory; a server has its data folder to itself, and
changes by the command line (`r2c2r user`) are detected at the next tidying.
"""

from sqlalchemy import Engine
from sqlmodel import col, select

from app.db import queries
from app.db.engine import reading
from app.db.tables import Job, Project
from app.security import Person


class Access:
    """Cache of restricted projects and their permitted users."""

    def __init__(self, engine: Engine) -> None:
        self._engine = engine
        self.look_again()

    def sees(self, person: Person, project_id: str | None) -> bool:
        """Whether the user may see the project; admins see all but the trash, and everyone sees content without a project."""
        if project_id in self._trashed:
            return False
        names = self._closed.get(project_id or "")
        return names is None or person.may("admin") or (person.account and person.name in names)

    def sees_job(self, person: Person, job_id: int) -> bool:
        """The same for a job's project."""
        if not self._trashed and (not self._closed or person.may("admin")):
            return True
        with reading(self._engine) as session:
            return self.sees(person, session.exec(select(Job.project_id).where(Job.id == job_id)).first())

    def hidden(self, person: Person) -> frozenset[str]:
        """The projects that the user may not see."""
        return frozenset(project for project in self._trashed | set(self._closed) if not self.sees(person, project))

    def look_again(self) -> None:
        """Reload after changes of members, accounts or the trash."""
        with reading(self._engine) as session:
            closed = session.exec(select(Project).where(col(Project.members_only).is_(True))).all()
            self._trashed = frozenset(session.exec(select(Project.id).where(col(Project.trashed).is_not(None))))
            self._closed = {project.id: frozenset(queries.who_sees(session, project)) for project in closed}
