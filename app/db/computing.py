"""Computing time of a project: by its jobs and its live segmenter."""

from sqlmodel import Session, col, select

from app.db.tables import Computing, Job, Project

JOINED_S = 2.0  # intervals separated by less are merged


def worked(session: Session, project_id: str, began: float, ended: float) -> None:
    """Record an interval of live segmenter work; no-op for a deleted project."""
    if session.get(Project, project_id) is None:
        return
    query = select(Computing).where(Computing.project_id == project_id).order_by(col(Computing.id).desc())
    last = session.exec(query).first()
    if last is None or began > last.ended + JOINED_S:
        last = Computing(project_id=project_id, began=began, ended=ended)
    last.ended = max(last.ended, ended)
    session.add(last)


def computing_s(session: Session, project_id: str, now: float) -> float:
    """Seconds of computation for the project, with overlapping intervals counted once."""
    jobs = session.exec(select(Job).where(Job.project_id == project_id, col(Job.started).is_not(None)))
    times = [(job.started or now, job.finished or now) for job in jobs]
    times += [(row.began, row.ended) for row in session.exec(select(Computing).where(Computing.project_id == project_id))]
    total, reached = 0.0, 0.0
    for began, ended in sorted(times):
        total += max(ended - max(began, reached), 0.0)
        reached = max(reached, ended)
    return total
