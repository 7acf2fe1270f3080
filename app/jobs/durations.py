"""Durations of the stages of a project's earlier jobs, for time estimates."""

from collections.abc import Iterable
from itertools import pairwise

from sqlmodel import Session, col, select

from app.db.tables import Job, JobEvent

LOOKED_AT = 5
"""Number of newest jobs used: scan and objects change, and most runs recompute little."""


def longest(session: Session, job: Job) -> dict[str, float]:
    """Longest duration in seconds of each stage in the last finished jobs of the same project and kind."""
    same = select(Job.id).where(Job.project_id == job.project_id, Job.kind == job.kind, Job.state == "done")
    last = session.exec(same.order_by(col(Job.id).desc()).limit(LOOKED_AT)).all()
    took: dict[str, float] = {}
    for number in last:
        marks = select(JobEvent).where(JobEvent.job_id == number, col(JobEvent.kind).in_(("stage", "state")))
        for stage, seconds in _taken(session.exec(marks.order_by(col(JobEvent.id)))):
            took[stage] = max(seconds, took.get(stage, 0.0))
    return took


def _taken(marks: Iterable[JobEvent]) -> Iterable[tuple[str, float]]:
    """Duration of each stage from its start to the next event, in seconds."""
    return ((began.stage, ended.at - began.at) for began, ended in pairwise(marks) if began.kind == "stage")
