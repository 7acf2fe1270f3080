"""Projects as API schemas, with a constant number of queries."""

from collections.abc import Collection
from typing import Any, NamedTuple

from sqlalchemy import func
from sqlalchemy.orm import defer
from sqlmodel import Session, col, select

from app import schemas
from app.db import queries
from app.db.tables import Account, Bundle, Comment, Job, Point, Project, SceneObject, Verdict

_LEFT_OUT = (defer(Project.capture), defer(Project.notices))  # type: ignore[arg-type]  # columns, to SQLAlchemy


class _About(NamedTuple):
    """Related data of projects, by project."""

    frames: dict[str, int]
    counts: dict[str, schemas.ProjectCounts]
    jobs: dict[str, schemas.Job]
    bundles: dict[str, tuple[Bundle, bool | None]]  # and whether it passed
    assignees: dict[str, str]


def listed(session: Session, hidden: Collection[str]) -> list[schemas.ProjectSummary]:
    """Summaries of all visible projects, most recently changed first."""
    shown = select(Project).where(col(Project.id).not_in(hidden)).options(*_LEFT_OUT)
    rows = session.exec(shown.order_by(col(Project.updated).desc())).all()
    about = _about(session, None)
    return [schemas.ProjectSummary(**_summary(row, about)) for row in rows]


def whole(session: Session, row: Project) -> schemas.Project:
    """One project with its recording's facts, as far as this version supports them."""
    known = schemas.CaptureFacts.model_fields
    facts = schemas.CaptureFacts(**{name: row.capture[name] for name in known if name in row.capture}) if row.capture else None
    return schemas.Project(
        **_summary(row, _about(session, row.id)),
        capture=facts,
        notices=row.notices,
        register_depth=row.register_depth,
        scale=row.scale,
        checklist=[schemas.ListedObject(**entry) for entry in row.checklist],
        awaits_recording=awaits_recording(row),
    )


def awaits_recording(row: Project) -> bool:
    """Whether the project has no recording and none is being read."""
    return row.status == "failed" and row.source_path is None


def _about(session: Session, project_id: str | None) -> _About:
    """Related data of one project, or of all with None."""

    def mine(column: Any) -> Any:
        return col(column) == project_id if project_id is not None else col(column).is_not(None)

    jobs = queries.job_shapes(session, session.exec(_shown_jobs(mine(Job.project_id))).all())
    frames = select(Project.id, col(Project.capture)["frame_count"].as_integer()).where(mine(Project.id))
    assignees = select(Project.id, Account.name).join(Account, col(Account.id) == Project.assignee_id).where(mine(Project.id))
    newest = select(func.max(Bundle.id)).where(mine(Bundle.project_id)).group_by(col(Bundle.project_id))
    return _About(
        frames={number: count or 0 for number, count in session.exec(frames)},
        counts=_counts(session, mine),
        jobs={job.project: job for job in jobs},
        bundles={row.project_id: (row, passed) for row, passed in queries.bundles(session, col(Bundle.id).in_(newest))},
        assignees=dict(session.exec(assignees).all()),
    )


def _shown_jobs(mine: Any) -> Any:
    """Query of each project's active job, else the last one."""
    active = col(Job.state).in_(queries.ACTIVE)
    place = func.row_number().over(partition_by=col(Job.project_id), order_by=(active.desc(), col(Job.id).desc()))
    ranked = select(Job.id, place.label("place")).where(mine).subquery()
    return select(Job).join(ranked, ranked.c.id == Job.id).where(ranked.c.place == 1)


def counts_of(session: Session, project_id: str) -> schemas.ProjectCounts:
    """Content counts of one project."""
    return _counts(session, lambda column: col(column) == project_id).get(project_id, schemas.ProjectCounts())


def _counts(session: Session, mine: Any) -> dict[str, schemas.ProjectCounts]:
    there = (mine(SceneObject.project_id), col(SceneObject.deleted).is_(False))
    of = col(SceneObject.project_id)
    objects = select(of, func.count()).where(*there).group_by(of)
    points = select(of, func.count()).join(Point).where(*there).group_by(of)
    said = select(of, Verdict.verdict, func.count()).join(Verdict).where(*there).group_by(of, col(Verdict.verdict))
    unsettled = select(Comment.project_id, func.count()).where(mine(Comment.project_id), col(Comment.resolved_at).is_(None))
    found: dict[str, dict[str, int]] = {}
    for name, query in (
        ("objects", objects),
        ("points", points),
        ("open_comments", unsettled.group_by(col(Comment.project_id))),
    ):
        for number, count in session.exec(query).all():
            found.setdefault(number, {})[name] = count
    for number, verdict, count in session.exec(said).all():
        found.setdefault(number, {})[verdict] = count
    return {number: schemas.ProjectCounts(**counts) for number, counts in found.items()}


def _summary(row: Project, about: _About) -> dict[str, Any]:
    bundle = about.bundles.get(row.id)
    shown = queries.bundle_shape(*bundle, row.name, row.inputs) if bundle else None
    return {
        "id": row.id,
        "name": row.name,
        "status": row.status,
        "created": row.created,
        "updated": row.updated,
        "source_name": row.source_name,
        "media_version": row.media_version,
        "frame_count": about.frames.get(row.id, 0),
        "error": schemas.ErrorBody(**row.error) if row.error else None,
        "counts": about.counts.get(row.id, schemas.ProjectCounts()),
        "job": about.jobs.get(row.id),
        "result": "none" if shown is None else "current" if shown.current else "stale",
        "bundle": shown,
        "thumbnail": f"/media/{row.id}/thumbnail.jpg?v={row.media_version}" if row.status == "ready" else None,
        "size_bytes": row.size_bytes,
        "segmenter": row.segmenter,
        "generator": row.generator,
        "matcher": row.matcher,
        "arm": row.arm,
        "review_state": row.review_state,
        "tags": row.tags,
        "archived": row.archived,
        "assignee": about.assignees.get(row.id),
    }
