"""Jobs and their history."""

from typing import Literal

from pydantic import Field

from app.schemas.base import ErrorBody, Shape
from app.schemas.text import Word

JobState = Literal["queued", "running", "cancelling", "cancelled", "failed", "done"]
JobKind = Literal["import", "sample", "run", "vary"]


class StageState(Shape):
    """One stage of a job."""

    name: str
    state: Literal["waiting", "running", "done", "failed", "cancelled"]


class Job(Shape):
    """One job: an import, a sample, a run or variants."""

    id: int
    project: str
    project_name: str
    kind: JobKind
    state: JobState
    stage: str
    stage_fraction: float
    stages: list[StageState]
    progress: float  # 0..1 over all stages
    eta_s: float | None
    message: str
    error: ErrorBody | None
    no_retry: str  # reason why it cannot be retried after a failure; empty if it can
    position: int | None  # in the queue, from 1
    attempts: int
    who: str
    has_log: bool
    created: float
    started: float | None
    finished: float | None


class JobEvent(Shape):
    """One line of a job's history."""

    id: int
    at: float
    kind: str
    stage: str
    fraction: float
    text: str


class RunRequest(Shape):
    """A run's backends, where they differ from the defaults."""

    segmenter: Word | None = None
    generator: Word | None = None
    matcher: Word | None = None
    arm: Word | None = None
    seed: int = Field(default=0, ge=0, lt=2**31)
