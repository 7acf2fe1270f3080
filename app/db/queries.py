"""Rows by their keys, and rows as what goes over the wire."""

from typing import Any

from sqlalchemy import func
from sqlmodel import Session, col, select

from app import schemas
from app.db.tables import Bundle, Job, Point, Project, SceneObject
from app.errors import NotFound

STAGES: dict[str, tuple[str, ...]] = {
    "import": ("ingest",),
    "sample": ("sample", "ingest"),
    "run": ("segment", "generate", "align", "synthesize", "warp", "export"),
}
ACTIVE = ("queued", "running", "cancelling")


def project_row(session: Session, project_id: str) -> Project:
    """The project; NotFound when there is none."""
    found = session.get(Project, project_id)
    if found is None:
        raise NotFound(f"no project {project_id}", hint="it may have been deleted")
    return found


def object_row(session: Session, project_id: str, object_id: int, *, deleted: bool = False) -> SceneObject:
    """The object; NotFound when the project has no such object, or it is deleted and `deleted` was not asked for."""
    found = session.get(SceneObject, object_id)
    if found is None or found.project_id != project_id or (found.deleted and not deleted):
        raise NotFound(f"no object {object_id} in this project", hint="it may have been deleted; undo brings it back")
    return found


def job_row(session: Session, job_id: int) -> Job:
    """The job; NotFound when there is none."""
    found = session.get(Job, job_id)
    if found is None:
        raise NotFound(f"no job {job_id}")
    return found


def live_objects(session: Session, project_id: str) -> list[SceneObject]:
    """The project's objects that are not deleted, oldest first."""
    query = select(SceneObject).where(SceneObject.project_id == project_id, col(SceneObject.deleted).is_(False))
    return list(session.exec(query.order_by(col(SceneObject.id))))


def points_of(session: Session, object_id: int | None) -> list[Point]:
    """An object's clicks, oldest first."""
    return list(session.exec(select(Point).where(Point.object_id == object_id).order_by(col(Point.id))))


def newest_bundle(session: Session, project_id: str) -> Bundle | None:
    """The newest bundle's row."""
    query = select(Bundle).where(Bundle.project_id == project_id).order_by(col(Bundle.version).desc())
    return session.exec(query).first()


def no_retry(row: Job, project: Project) -> str:
    """Why the job, if it failed, would only fail again; empty where it may be retried."""
    of_recording = row.kind in ("import", "sample")
    return "the recording was refused, and is not kept" if of_recording and project.source_path is None else ""


def job_shape(session: Session, row: Job) -> schemas.Job:
    """A job as it goes over the wire."""
    project = session.get(Project, row.project_id)
    return schemas.Job(
        id=row.id or 0,
        project=row.project_id,
        project_name=project.name if project else "",
        kind=row.kind,  # type: ignore[arg-type]  # the column holds no other
        state=row.state,  # type: ignore[arg-type]
        stage=row.stage,
        stage_fraction=row.stage_fraction,
        stages=stage_states(row),
        progress=row.progress,
        eta_s=row.eta_s,
        message=row.message,
        error=schemas.ErrorBody(**row.error) if row.error else None,
        position=_position(session, row),
        no_retry=no_retry(row, project) if project else "",
        attempts=row.attempts,
        who=row.who,
        has_log=row.log_path is not None,
        created=row.created,
        started=row.started,
        finished=row.finished,
    )


def stage_states(row: Job) -> list[schemas.StageState]:
    """Each stage of the job and how far it is."""
    names = STAGES[row.kind]
    if row.state == "done":
        return [schemas.StageState(name=name, state="done") for name in names]
    current = names.index(row.stage) if row.stage in names else -1
    here: Any = {"failed": "failed", "cancelled": "cancelled", "queued": "waiting"}.get(row.state, "running")
    return [
        schemas.StageState(name=name, state="done" if at < current else here if at == current else "waiting")
        for at, name in enumerate(names)
    ]


def bundle_shape(row: Bundle, name: str, inputs: str) -> schemas.Bundle:
    """A bundle as it goes over the wire; `inputs` is the project's key of now."""
    return schemas.Bundle(
        version=row.version,
        url=f"/media/{row.project_id}/bundles/{row.version}.zip",
        file_name=bundle_file_name(name, row.version, row.sha256),
        sha256=row.sha256,
        size=row.size,
        created=row.created,
        passed=row.certificate.get("passed") if row.certificate else None,
        current=row.inputs == inputs,
    )


def bundle_file_name(name: str, version: int, sha256: str) -> str:
    """What the browser saves a bundle as."""
    plain = "".join(c if c.isascii() and (c.isalnum() or c in "-_") else "-" for c in name).strip("-").lower()
    return f"{plain or 'scene'}-v{version}-{sha256[:8]}.zip"


def _position(session: Session, row: Job) -> int | None:
    if row.state != "queued":
        return None
    ahead = select(func.count()).select_from(Job).where(Job.state == "queued", col(Job.id) < row.id)
    return session.exec(ahead).one() + 1
