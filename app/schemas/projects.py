"""Projects and how recordings get in."""

from typing import Literal

from pydantic import Field

from app.schemas.base import ErrorBody, Shape
from app.schemas.bundles import Bundle
from app.schemas.captures import CaptureFacts
from app.schemas.jobs import Job
from app.schemas.states import ReviewState


class ProjectCounts(Shape):
    """What is in a project."""

    objects: int = 0
    points: int = 0
    accepted: int = 0
    rejected: int = 0
    open_comments: int = 0


class Project(Shape):
    """One recording and what became of it."""

    id: str
    name: str
    status: Literal["importing", "failed", "ready"]
    created: float
    updated: float
    source_name: str
    media_version: str
    capture: CaptureFacts | None
    notices: list[str]
    error: ErrorBody | None
    counts: ProjectCounts
    job: Job | None  # the one under way, else the last one
    result: Literal["none", "stale", "current"]  # stale: something was changed since the last run
    bundle: Bundle | None  # the newest
    thumbnail: str | None
    size_bytes: int
    segmenter: str  # draws the masks
    generator: str  # makes the candidates
    matcher: str  # aligns them
    review_state: ReviewState


class ProjectPatch(Shape):
    """What changes: its name, or which backends do its stages."""

    name: str | None = Field(default=None, min_length=1, max_length=120)
    segmenter: str | None = Field(default=None, max_length=60)
    generator: str | None = Field(default=None, max_length=60)
    matcher: str | None = Field(default=None, max_length=60)


class ImportPath(Shape):
    """A recording on this machine."""

    path: str = Field(min_length=1, max_length=4096)
    name: str | None = Field(default=None, max_length=120)


class SampleRequest(Shape):
    """A synthetic kitchen."""

    seed: int = Field(default=0, ge=0, le=1_000_000)
    frames: int = Field(default=90, ge=10, le=600)
    width: int = Field(default=960, ge=160, le=1920)
    height: int = Field(default=720, ge=120, le=1440)
    name: str | None = Field(default=None, max_length=120)


class Deleted(Shape):
    """What deleting freed."""

    freed_bytes: int
