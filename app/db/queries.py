"""Queries of rows by key, and conversion of rows to API schemas."""

import time
from collections.abc import Sequence
from typing import Any, NamedTuple

import sqlalchemy
from sqlalchemy import bindparam, func, update
from sqlalchemy.orm import defer
from sqlmodel import Session, col, select

from app import schemas
from app.db.tables import Account, Bundle, Event, Job, Override, Point, Project, ProjectMember, SceneObject
from app.errors import NotFound

STAGES: dict[str, tuple[str, ...]] = {
    "import": ("ingest",),
    "sample": ("sample", "ingest"),
    "run": ("segment", "generate", "align", "synthesize", "warp", "export"),
    "vary": ("vary",),
}
READS_RECORDING = ("import", "sample")  # job kinds; the project cannot be opened until one is done
ACTIVE = ("queued", "running", "cancelling")


def project_row(session: Session, project_id: str) -> Project:
    """The project; NotFound when there is none."""
    found = session.get(Project, project_id)
    if found is None:
        raise _no_project(project_id)
    return found


def _no_project(project_id: str) -> NotFound:
    return NotFound(f"no project {project_id}", hint="it may have been deleted")


def object_row(session: Session, project_id: str, object_id: int, *, deleted: bool = False) -> SceneObject:
    """The object; NotFound when the project has no such object, or it is deleted and `deleted` is not set."""
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


def live_objects(session: Session, project_id: str, *, deleted: bool = False) -> list[SceneObject]:
    """The project's objects, oldest first; deleted ones only with `deleted`."""
    query = select(SceneObject).where(SceneObject.project_id == project_id).order_by(col(SceneObject.id))
    return list(session.exec(query if deleted else query.where(col(SceneObject.deleted).is_(False))))


def owner(session: Session, project: Project) -> str | None:
    """The project's owner; None for the user who started the server, and for a deleted account."""
    return account_name(session, project.owner_id)


def account_name(session: Session, account_id: int | None) -> str | None:
    """The account's name; None without one, and for a deleted account."""
    account = session.get(Account, account_id) if account_id is not None else None
    return account.name if account else None


def has_account(session: Session, name: str) -> bool:
    """Whether there is an account of that name."""
    return session.exec(select(Account.id).where(Account.name == name)).first() is not None


def who_sees(session: Session, project: Project) -> set[str]:
    """The owner and the members of the project, by name."""
    query = select(Account.name).join(ProjectMember).where(ProjectMember.project_id == project.id)
    return {*session.exec(query), *filter(None, [owner(session, project)])}


class Drawn(NamedTuple):
    """The fields that locate an object's masks; lightweight, as hundreds are read for each frame while scrubbing."""

    id: int
    name: str
    masks_key: str
    run_name: str

    @property
    def result_name(self) -> str:
        """The name of its results, as in SceneObject."""
        return self.run_name or self.name


class DrawnIn(NamedTuple):
    """The project's fields that locate masks."""

    id: str
    work_path: str | None
    segmenter: str


_DRAWN_IN = sqlalchemy.select(col(Project.id), col(Project.work_path), col(Project.segmenter)).where(
    col(Project.id) == bindparam("project")
)
_DRAWN = (
    sqlalchemy.select(col(SceneObject.id), col(SceneObject.name), col(SceneObject.masks_key), col(SceneObject.run_name))
    .where(col(SceneObject.project_id) == bindparam("project"), col(SceneObject.deleted).is_(False))
    .order_by(col(SceneObject.id))
)


def drawn_in(session: Session, project_id: str) -> DrawnIn:
    """The fields that locate a project's masks and frames; NotFound when there is no such project."""
    found = session.execute(_DRAWN_IN, {"project": project_id}).first()
    if found is None:
        raise _no_project(project_id)
    return DrawnIn(*found)


def drawn(session: Session, project_id: str) -> list[Drawn]:
    """The fields that locate each object's masks, oldest object first."""
    return [Drawn(*row) for row in session.execute(_DRAWN, {"project": project_id})]


class Click(NamedTuple):
    """A stored click, read-only; lightweight, as thousands are read at once."""

    id: int
    frame: int
    x: float
    y: float
    label: int  # 1 on the object, 0 off it


_CLICKS = sqlalchemy.select(
    col(Point.id), col(Point.frame), col(Point.x), col(Point.y), col(Point.label), col(Point.object_id)
).order_by(col(Point.id))
_CLICKS_OF = _CLICKS.where(col(Point.object_id) == bindparam("object"))  # built once, as that takes as long as the query itself


def clicks_of(session: Session, object_id: int | None) -> list[Click]:
    """An object's clicks, oldest first."""
    return [Click(*row[:5]) for row in session.execute(_CLICKS_OF, {"object": object_id})]


def clicks_by_object(session: Session, project_id: str) -> dict[int, list[Click]]:
    """The clicks of all of a project's objects, oldest first."""
    mine = sqlalchemy.select(col(SceneObject.id)).where(col(SceneObject.project_id) == project_id)
    found: dict[int, list[Click]] = {}
    for number, frame, x, y, label, object_id in session.execute(_CLICKS.where(col(Point.object_id).in_(mine))):
        found.setdefault(object_id, []).append(Click(number, frame, x, y, label))
    return found


def overrides_by_object(session: Session, project_id: str) -> dict[int, dict[str, Any]]:
    """The corrections of each of a project's objects."""
    rows = session.exec(select(Override).where(Override.project_id == project_id))
    return {row.object_id or 0: dict(row.data) for row in rows}


def saved(session: Session, project_id: str, object_id: int | None = None) -> dict[int | None, float]:
    """Time of the last change by object, or of one object."""
    query = select(Event.object_id, func.max(Event.at)).where(Event.project_id == project_id)
    if object_id is not None:
        query = query.where(Event.object_id == object_id)
    return dict(session.exec(query.group_by(col(Event.object_id))).all())


def note_size(session: Session, project_id: str, size: int) -> None:
    """Store the size of the project's folder."""
    values = {"size_bytes": size, "sized": time.time()}
    session.exec(update(Project).where(col(Project.id) == project_id).values(**values))


def newest_bundle(session: Session, project_id: str) -> Bundle | None:
    """The newest bundle's row."""
    query = select(Bundle).where(Bundle.project_id == project_id).order_by(col(Bundle.version).desc())
    return session.exec(query).first()


def no_retry(kind: str, source_path: str | None) -> str:
    """Reason why a failed job cannot be retried; empty where it can."""
    refused = kind in READS_RECORDING and source_path is None
    return "the recording was refused, and is not kept" if refused else ""


def job_shapes(session: Session, rows: Sequence[Job]) -> list[schemas.Job]:
    """Jobs as API schemas."""
    of = select(Project.id, Project.name, Project.source_path).where(col(Project.id).in_({row.project_id for row in rows}))
    projects = {number: (name, source) for number, name, source in session.exec(of)}
    waiting: list[tuple[int | None, str]] = []
    if any(row.state == "queued" for row in rows):
        waiting = list(session.exec(select(Job.id, Job.kind).where(Job.state == "queued").order_by(col(Job.id))))
    return [_job_shape(row, *projects.get(row.project_id, ("", None)), waiting) for row in rows]


def _job_shape(row: Job, name: str, source: str | None, waiting: list[tuple[int | None, str]]) -> schemas.Job:
    reads = row.kind in READS_RECORDING  # imports and runs are queued separately
    before = [number for number, kind in waiting if (kind in READS_RECORDING) == reads]
    return schemas.Job(
        id=row.id or 0,
        project=row.project_id,
        project_name=name,
        kind=row.kind,  # type: ignore[arg-type]  # the column has no other values
        state=row.state,  # type: ignore[arg-type]
        stage=row.stage,
        stage_fraction=row.stage_fraction,
        stages=stage_states(row),
        progress=row.progress,
        eta_s=row.eta_s,
        message=row.message,
        error=schemas.ErrorBody(**row.error) if row.error else None,
        position=before.index(row.id) + 1 if row.id in before else None,
        no_retry=no_retry(row.kind, source),
        attempts=row.attempts,
        who=row.who,
        has_log=row.log_path is not None,
        created=row.created,
        started=row.started,
        finished=row.finished,
    )


def stage_states(row: Job) -> list[schemas.StageState]:
    """Progress of each stage of the job."""
    names = STAGES[row.kind]
    if row.state == "done":
        return [schemas.StageState(name=name, state="done") for name in names]
    current = names.index(row.stage) if row.stage in names else -1
    here: Any = {"failed": "failed", "cancelled": "cancelled", "queued": "waiting"}.get(row.state, "running")
    return [
        schemas.StageState(name=name, state="done" if at < current else here if at == current else "waiting")
        for at, name in enumerate(names)
    ]


def bundles(session: Session, which: Any) -> list[tuple[Bundle, bool | None]]:
    """Bundles, newest first, with their verdict, without loading the certificates, which may be long."""
    passed = col(Bundle.certificate)["passed"].as_boolean()
    rows = select(Bundle, passed).where(which).options(defer(Bundle.certificate))  # type: ignore[arg-type]  # a column
    found = session.exec(rows.order_by(col(Bundle.version).desc()))
    return [(bundle, said) for bundle, said in found]


def bundle_shape(row: Bundle, passed: bool | None, name: str, inputs: str) -> schemas.Bundle:
    """A bundle as an API schema; `inputs` is the project's current key."""
    return schemas.Bundle(
        version=row.version,
        url=f"/media/{row.project_id}/bundles/{row.version}.zip",
        file_name=bundle_file_name(name, row.version, row.sha256),
        sha256=row.sha256,
        size=row.size,
        created=row.created,
        passed=passed,
        current=row.inputs == inputs,
    )


def bundle_file_name(name: str, version: int, sha256: str) -> str:
    """Download file name of a bundle."""
    return f"{plain_name(name)}-v{version}-{sha256[:8]}.zip"


def plain_name(name: str) -> str:
    """A project's name as a valid file name."""
    plain = "".join(c if c.isascii() and (c.isalnum() or c in "-_") else "-" for c in name).strip("-").lower()
    return plain or "scene"
