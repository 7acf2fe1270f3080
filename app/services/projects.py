"""Projects: list, rename, tag, archive, frames, history."""

import json
import secrets
import time
from pathlib import Path
from typing import Any, TypeVar

from sqlalchemy.orm import defer
from sqlmodel import Session, col, select

from app import schemas
from app.db import history as events
from app.db import keys, queries
from app.db.engine import reading, writing
from app.db.tables import Event, Project
from app.errors import NotReady
from app.file_cache import FileCache
from app.files import ProjectFiles, project_files
from app.services import crossing, masks, project_shapes
from app.services.context import Context
from r2c2r_core.align.protocol import MATCHERS
from r2c2r_core.errors import BackendUnavailable
from r2c2r_core.generate.stage import GENERATORS
from r2c2r_core.registry import Registry
from r2c2r_core.robot.arms import ARMS
from r2c2r_core.segment.stage import SEGMENTERS

SEAMS: dict[str, Registry[Any]] = {  # selectable backends of a project
    "segmenter": SEGMENTERS,
    "generator": GENERATORS,
    "matcher": MATCHERS,
    "arm": ARMS,
}


Shape = TypeVar("Shape", bound=schemas.ProjectSummary)

_FRAMES: FileCache[list[dict[str, Any]]] = FileCache(64 << 20)
_FRAMES_GROW = 4  # ratio of a frame table's memory to its file size


def list_projects(context: Context) -> list[schemas.ProjectSummary]:
    """All projects visible to the user, most recently changed first."""
    with reading(context.engine) as session:
        shapes = project_shapes.listed(session, context.access.hidden(context.person))
    return [_pictured(context, shape) for shape in shapes]


def get_project(context: Context, project_id: str) -> schemas.Project:
    """One project."""
    with reading(context.engine) as session:
        shape = project_shapes.whole(session, queries.project_row(session, project_id))
    return _pictured(context, shape)


def _pictured(context: Context, shape: Shape) -> Shape:
    """The project with the sample's newest frame as thumbnail while it is being rendered."""
    if shape.status != "importing":
        return shape
    try:
        drawn = project_files(context.settings.data_dir, shape.id).arriving.stat().st_mtime_ns
    except FileNotFoundError:
        return shape
    return shape.model_copy(update={"thumbnail": f"/media/{shape.id}/arriving.jpg?v={drawn:x}"})


def new_project(
    session: Session,
    name: str,
    source_name: str,
    source_path: Path | None,
    work: Path | None = None,
    project_id: str | None = None,
    began: float | None = None,
    owner_id: int | None = None,
) -> Project:
    """A project's row in state importing; `began` is the start of its upload."""
    now, number = time.time(), project_id or secrets.token_hex(6)
    project = Project(id=number, name=name, status="importing", created=began or now, updated=now, source_name=source_name)
    project.source_path = str(source_path) if source_path else None
    project.work_path = str(work) if work else None
    project.owner_id = owner_id
    session.add(project)
    session.flush()
    return project


def change(context: Context, project_id: str, body: schemas.ProjectPatch) -> schemas.Project:
    """Change a project's fields or backends. A new segmenter recomputes every object; the old one's masks are kept."""
    for seam, registry in SEAMS.items():
        if (wanted := getattr(body, seam)) is not None:
            registry.require(wanted)
            ready, reason = registry.available(wanted)
            if not ready:
                raise BackendUnavailable(f"{wanted}: {reason}", hint="or choose another one")
    with writing(context.engine) as session:
        row = queries.project_row(session, project_id)
        name = body.name or row.name
        if name != row.name:
            _note(context, session, row, "rename", f"renamed to {name}", {"name": name})
        if body.tags is not None and (tags := sorted(set(body.tags), key=str.casefold)) != row.tags:
            _note(context, session, row, "tags", f"tags: {', '.join(tags) or 'none'}", {"tags": tags})
        if body.archived is not None and body.archived != row.archived:
            text = "archived" if body.archived else "taken out of the archive"
            _note(context, session, row, "archive", text, {"archived": body.archived})
        changed = [seam for seam in SEAMS if getattr(body, seam) not in (None, getattr(row, seam))]
        for seam in changed:
            events.require_open(row)
            text = f"{seam} {getattr(body, seam)} instead of {getattr(row, seam)}"
            _note(context, session, row, seam, text, {seam: getattr(body, seam)})
        if "segmenter" in changed:
            keys.note_segmenter(session, row)
        if changed:
            keys.note_project(session, row)
        objects = [item.id or 0 for item in queries.live_objects(session, project_id)] if body.segmenter else []
    if "segmenter" in changed:  # after the transaction: ending a hanging process takes seconds, and would block writers
        crossing.stop_segmenting(context, project_id)
    for number in objects:
        masks.follow(context, project_id, number, tells=number == objects[-1])
    tell(context, project_id)
    return get_project(context, project_id)


def _note(context: Context, session: Session, row: Project, action: str, text: str, after: dict[str, Any]) -> None:
    """Change fields of a project, with an event."""
    now = time.time()
    event = Event(project_id=row.id, scope="project", action=action, text=text, who=context.who, at=now)
    event.before, event.after = {key: getattr(row, key) for key in after}, dict(after)
    row.sqlmodel_update({**after, "updated": now})
    session.add_all([row, event])


def frames(context: Context, project_id: str) -> list[schemas.FrameInfo]:
    """The recording's frames, in order."""
    with reading(context.engine) as session:
        files = context.files(queries.project_row(session, project_id))
    return [schemas.FrameInfo(**entry) for entry in frame_table(files)]


def frame_table(files: ProjectFiles) -> list[dict[str, Any]]:
    """frames.json; NotReady until the recording was read."""
    found = _FRAMES.get(files.frames, lambda: json.loads(files.frames.read_text()), lambda _, size: _FRAMES_GROW * size)
    if found is None:
        raise NotReady("the recording has not been read yet", hint="wait for the import")
    return found


def history(
    context: Context, project_id: str, object_id: int | None, before: int | None, limit: int
) -> list[schemas.HistoryEntry]:
    """Events of a project, newest first."""
    with reading(context.engine) as session:
        queries.project_row(session, project_id)
        query = select(Event).where(Event.project_id == project_id)
        if object_id is not None:
            query = query.where(Event.object_id == object_id)
        if before is not None:
            query = query.where(col(Event.id) < before)
        query = query.order_by(col(Event.id).desc()).limit(min(max(limit, 1), 1000))
        return [history_entry(row) for row in session.exec(query.options(*UNSHOWN))]


UNSHOWN = (defer(Event.before), defer(Event.after))  # type: ignore[arg-type]  # columns, to SQLAlchemy


def tell(context: Context, project_id: str) -> None:
    """Publish a change of the project to all tabs."""
    context.hub.publish("project", project_id)
    context.hub.publish("projects", None)


def history_entry(row: Event) -> schemas.HistoryEntry:
    """An event as an API schema."""
    return schemas.HistoryEntry(
        id=row.id or 0,
        object=row.object_id,
        scope=row.scope,
        action=row.action,
        text=row.text,
        frame=row.frame,
        who=row.who,
        at=row.at,
        undone=row.standing == "undone",
    )
