"""Projects: list, rename, delete, frames, history."""

import json
import secrets
import time
from functools import lru_cache
from pathlib import Path
from typing import Any

from sqlalchemy import func
from sqlmodel import Session, col, select

from app import schemas
from app.db import history as events
from app.db import once, queries
from app.db.documents import inputs_key
from app.db.engine import reading, writing
from app.db.tables import Comment, Event, Job, Point, Project, SceneObject, Verdict
from app.errors import Conflict, NotReady
from app.files import ProjectFiles, delete_folder, folder_bytes
from app.services import masks
from app.services.context import Context
from r2c2r_core.align.protocol import MATCHERS
from r2c2r_core.errors import BackendUnavailable
from r2c2r_core.generate.stage import GENERATORS
from r2c2r_core.segment.stage import SEGMENTERS

SEAMS = {"segmenter": SEGMENTERS, "generator": GENERATORS, "matcher": MATCHERS}  # what a person may choose for a project


def list_projects(context: Context) -> list[schemas.Project]:
    """All projects, last touched first."""
    with reading(context.engine) as session:
        rows = session.exec(select(Project).order_by(col(Project.updated).desc())).all()
        return [shape(context, session, row) for row in rows]


def get_project(context: Context, project_id: str) -> schemas.Project:
    """One project."""
    with reading(context.engine) as session:
        return shape(context, session, queries.project_row(session, project_id))


def new_project(
    session: Session,
    name: str,
    source_name: str,
    source_path: Path | None,
    work: Path | None = None,
    project_id: str | None = None,
    began: float | None = None,
) -> Project:
    """A project's row, still importing; `began` is when its upload did."""
    now, number = time.time(), project_id or secrets.token_hex(6)
    project = Project(id=number, name=name, status="importing", created=began or now, updated=now, source_name=source_name)
    project.source_path = str(source_path) if source_path else None
    project.work_path = str(work) if work else None
    session.add(project)
    session.flush()
    return project


def change(context: Context, project_id: str, body: schemas.ProjectPatch) -> schemas.Project:
    """A new name, or other backends. A new segmenter starts on every object; what the other drew is kept for its return."""
    for seam, registry in SEAMS.items():
        if (wanted := getattr(body, seam)) is not None:
            registry.require(wanted)
            ready, reason = registry.available(wanted)
            if not ready:
                raise BackendUnavailable(f"{wanted}: {reason}", hint="or choose another one")
    with writing(context.engine) as session:
        row = queries.project_row(session, project_id)
        name = body.name.strip() if body.name is not None else row.name
        if name != row.name:
            _note(context, session, row, "rename", f"renamed to {name}", {"name": name})
        changed = [seam for seam in SEAMS if getattr(body, seam) not in (None, getattr(row, seam))]
        for seam in changed:
            events.require_open(row)
            text = f"{seam} {getattr(body, seam)} instead of {getattr(row, seam)}"
            _note(context, session, row, seam, text, {seam: getattr(body, seam)})
        if "segmenter" in changed:
            context.live.close(project_id)
        objects = [item.id or 0 for item in queries.live_objects(session, project_id)] if body.segmenter else []
    for number in objects:
        masks.follow(context, project_id, number)
    tell(context, project_id)
    return get_project(context, project_id)


def _note(context: Context, session: Session, row: Project, action: str, text: str, after: dict[str, str]) -> None:
    """Change fields of a project, with an event beside it."""
    now = time.time()
    event = Event(project_id=row.id, scope="project", action=action, text=text, who=context.who, at=now)
    event.before, event.after = {key: getattr(row, key) for key in after}, dict(after)
    row.sqlmodel_update({**after, "updated": now})
    session.add_all([row, event])


def delete(context: Context, project_id: str) -> schemas.Deleted:
    """Stop what works for the project, then delete its rows and files."""
    with reading(context.engine) as session:
        row = queries.project_row(session, project_id)
        files = context.files(row)
        jobs = session.exec(select(Job.id).where(Job.project_id == project_id, col(Job.state).in_(queries.ACTIVE))).all()
    for job in jobs:
        context.runner.cancel(job or 0)
    if not context.runner.wait_until_idle(project_id, context.settings.kill_grace_s + 5.0):
        raise Conflict("a job of this project does not stop", hint="try again in a moment")
    context.live.close(project_id)
    context.viewer.close(project_id)
    with writing(context.engine) as session:
        session.delete(queries.project_row(session, project_id))
        once.forget(session, project_id=project_id)
    freed = delete_folder(files.root)
    if files.work.is_relative_to(context.settings.data_dir):  # a workspace elsewhere is not ours to delete
        freed += delete_folder(files.work)
    context.hub.publish("projects", None)
    return schemas.Deleted(freed_bytes=freed)


def frames(context: Context, project_id: str) -> list[schemas.FrameInfo]:
    """The recording's frames, in order."""
    with reading(context.engine) as session:
        files = context.files(queries.project_row(session, project_id))
    return [schemas.FrameInfo(**entry) for entry in frame_table(files)]


def frame_table(files: ProjectFiles) -> list[dict[str, Any]]:
    """frames.json; NotReady until the recording was read."""
    try:
        return _frames_at(files.frames, files.frames.stat().st_mtime_ns)
    except FileNotFoundError as error:
        raise NotReady("the recording has not been read yet", hint="wait for the import") from error


def history(
    context: Context, project_id: str, object_id: int | None, before: int | None, limit: int
) -> list[schemas.HistoryEntry]:
    """Who changed what, newest first."""
    with reading(context.engine) as session:
        queries.project_row(session, project_id)
        query = select(Event).where(Event.project_id == project_id)
        if object_id is not None:
            query = query.where(Event.object_id == object_id)
        if before is not None:
            query = query.where(col(Event.id) < before)
        undone = {
            e.id
            for scope in ("prompts", "review")
            for s in events.all_stacks(session, project_id, scope).values()
            for e in s.undone
        }
        rows = session.exec(query.order_by(col(Event.id).desc()).limit(min(max(limit, 1), 1000))).all()
        return [_entry(row, row.id in undone) for row in rows]


def _facts(stored: dict[str, Any]) -> schemas.CaptureFacts:
    """What the doctor said when the recording was read, as far as this version still says it."""
    return schemas.CaptureFacts(**{name: stored[name] for name in schemas.CaptureFacts.model_fields if name in stored})


def shape(context: Context, session: Session, row: Project) -> schemas.Project:
    """A project as it goes over the wire."""
    active = select(Job).where(Job.project_id == row.id).order_by(col(Job.state).in_(queries.ACTIVE).desc(), col(Job.id).desc())
    job = session.exec(active).first()
    bundle = queries.newest_bundle(session, row.id)
    shown = queries.bundle_shape(bundle, row.name, inputs_key(session, row.id)) if bundle else None
    ready = row.status == "ready"
    return schemas.Project(
        id=row.id,
        name=row.name,
        status=row.status,  # type: ignore[arg-type]  # the column holds no other
        created=row.created,
        updated=row.updated,
        source_name=row.source_name,
        media_version=row.media_version,
        capture=_facts(row.capture) if row.capture else None,
        notices=row.notices,
        error=schemas.ErrorBody(**row.error) if row.error else None,
        counts=_counts(session, row.id),
        job=queries.job_shape(session, job) if job else None,
        result="none" if shown is None else "current" if shown.current else "stale",
        bundle=shown,
        thumbnail=f"/media/{row.id}/thumbnail.jpg?v={row.media_version}" if ready else None,
        size_bytes=_size(context.files(row).root, int(row.updated)),
        segmenter=row.segmenter,
        generator=row.generator,
        matcher=row.matcher,
        review_state=row.review_state,  # type: ignore[arg-type]
    )


def tell(context: Context, project_id: str) -> None:
    """Show every tab that the project changed."""
    context.hub.publish("project", project_id)
    context.hub.publish("projects", None)


def _entry(row: Event, undone: bool) -> schemas.HistoryEntry:
    return schemas.HistoryEntry(
        id=row.id or 0,
        object=row.object_id,
        scope=row.scope,
        action=row.action,
        text=row.text,
        frame=row.frame,
        who=row.who,
        at=row.at,
        undone=undone,
    )


def _counts(session: Session, project_id: str) -> schemas.ProjectCounts:
    mine = (SceneObject.project_id == project_id, col(SceneObject.deleted).is_(False))
    objects = session.exec(select(func.count()).select_from(SceneObject).where(*mine)).one()
    points = session.exec(select(func.count()).select_from(Point).join(SceneObject).where(*mine)).one()
    said = (
        select(Verdict.verdict, func.count()).select_from(Verdict).join(SceneObject).where(*mine).group_by(col(Verdict.verdict))
    )
    verdicts = dict(session.exec(said).all())
    open_comments = select(func.count()).where(Comment.project_id == project_id, col(Comment.resolved_at).is_(None))
    return schemas.ProjectCounts(
        objects=objects,
        points=points,
        accepted=verdicts.get("accepted", 0),
        rejected=verdicts.get("rejected", 0),
        open_comments=session.exec(open_comments).one(),
    )


@lru_cache(maxsize=16)
def _frames_at(path: Path, _changed: int) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = json.loads(path.read_text())
    return found


@lru_cache(maxsize=256)
def _size(root: Path, _updated: int) -> int:
    return folder_bytes(root)
