"""Re-reading of a recording with other options: with or without registration of its depth."""

import time

from sqlmodel import col, select

from app import schemas
from app.db import history as events
from app.db import keys, queries
from app.db.engine import writing
from app.db.tables import Event, Job
from app.errors import Conflict, NotFound
from app.services import crossing, imports, projects
from app.services.context import Context


def read_again(context: Context, project_id: str, body: schemas.ReadingIn) -> schemas.Project:
    """Queue a new reading of the recording; clicks are kept, masks and results of the old reading become stale."""
    with writing(context.engine) as session:
        row = queries.project_row(session, project_id)
        before = {"register_depth": row.register_depth, "scale": row.scale}
        wanted = {name: value for name, value in body.model_dump(exclude_none=True).items() if value != before[name]}
        if not wanted:
            return projects.get_project(context, project_id)
        events.require_open(row)
        if row.source_path is None:
            raise NotFound("the recording is not kept here", hint="import it again")
        busy = select(Job.id).where(Job.project_id == project_id, col(Job.state).in_(queries.ACTIVE))
        if session.exec(busy).first() is not None:
            raise Conflict("a job of this project is under way", hint="wait for it, or cancel it")
        now = time.time()
        for name, value in wanted.items():
            setattr(row, name, value)
        row.status, row.updated = "importing", now
        said = " and ".join(_in_words(name, value) for name, value in wanted.items())
        event = Event(project_id=row.id, scope="project", action="reading", text=said, who=context.who, at=now)
        event.before, event.after = {name: before[name] for name in wanted}, wanted
        session.add_all([row, event])
        keys.note_project(session, row)
        job = imports.queue_job(context, session, row, "import", {}).id or 0
    crossing.shut(context, project_id)
    context.runner.queued(job)
    projects.tell(context, project_id)
    return projects.get_project(context, project_id)


def _in_words(name: str, value: float | bool) -> str:
    if name == "scale":
        return f"every length multiplied by {value:.4f}" if value != 1.0 else "lengths read as they were recorded"
    return "depth registered to the colour images" if value else "depth read as it was recorded"
