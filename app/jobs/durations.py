"""How long the stages of a project's jobs took before: what the time left of the next one is told from."""

from collections.abc import Iterable
from itertools import pairwise

from sqlmodel import Session, col, select

from app.db.tables import Job, JobEvent

LOOKED_AT = 5
"""Jobs, the newest: the scan and its objects change, and most runs compute little of it anew."""


def longest(session: Session, job: Job) -> dict[str, float]:
    """The most seconds that each stage took in the last jobs of its project and kind that were done."""
    same = select(Job.id).where(Job.project_id == job.project_id, Job.kind == job.kind, Job.state == "done")
    last = session.exec(same.order_by(col(Job.id).desc()).limit(LOOKED_AT)).all()
    took: dict[str, float] = {}
    for number in last:
        marks = select(JobEvent).where(JobEvent.job_id == number, col(JobEvent.kind).in_(("stage", "state")))
        for stage, seconds in _taken(session.exec(marks.order_by(col(JobEvent.id)))):
            took[stage] = max(seconds, took.get(stage, 0.0))
    return took


def _taken(marks: Iterable[JobEvent]) -> Iterable[tuple[str, float]]:
    """Each stage from its beginning to the next mark, in seconds."""
    return ((began.stage, ended.at - began.at) for began, ended in pairwise(marks) if began.kind == "stage")
