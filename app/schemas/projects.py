"""Projects and the import of recordings."""

from typing import Literal

from pydantic import Field

from app.schemas.base import ErrorBody, Shape
from app.schemas.bundles import Bundle
from app.schemas.captures import CaptureFacts
from app.schemas.jobs import Job
from app.schemas.states import ReviewState
from app.schemas.templates import ListedObject
from app.schemas.text import ServerPath, Title, Word


class ProjectCounts(Shape):
    """Counts of a project's content."""

    objects: int = 0
    points: int = 0
    accepted: int = 0
    rejected: int = 0
    open_comments: int = 0


class ProjectSummary(Shape):
    """One recording and what became of it, as the list of all shows it."""

    id: str
    name: str
    status: Literal["importing", "failed", "ready"]
    created: float
    updated: float
    source_name: str
    media_version: str
    frame_count: int
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
    arm: str  # tries the joints of the bundle
    review_state: ReviewState
    tags: list[str]
    archived: bool  # done with: lists show it when asked for
    assignee: str | None  # whose turn it is


class Project(ProjectSummary):
    """A project by itself, with what the doctor said of its recording."""

    capture: CaptureFacts | None
    notices: list[str]
    register_depth: bool  # whether depth is moved onto the colour images when the recording is read
    scale: float  # on every length of the recording when it is read
    checklist: list[ListedObject]  # objects that are to be clicked, those that are already among them
    awaits_recording: bool  # it has none, and may be given one


class ProjectPatch(Shape):
    """Changes of a project: its name, tags, whether it is archived, or which backends do its stages."""

    name: Title | None = None
    tags: list[Word] | None = Field(default=None, max_length=20)
    archived: bool | None = None
    segmenter: Word | None = None
    generator: Word | None = None
    matcher: Word | None = None
    arm: Word | None = None


class ReadingIn(Shape):
    """How the recording is to be read."""

    register_depth: bool | None = None  # None: as it is
    scale: float | None = Field(default=None, ge=0.2, le=5.0)  # on every length, depth and camera path alike; None: as it is


class ProjectMembers(Shape):
    """Who may see a project: everybody, or its owner, its members and admins."""

    members_only: bool
    owner: str | None  # None: who started the server, or an account that is gone
    members: list[str]
    may_change: bool  # whether you may
    accounts: list[str]  # who could be a member; empty unless you may change it


class MembersIn(Shape):
    """Who may see a project from now on; the owner always does."""

    members_only: bool
    members: list[Word] = Field(default_factory=list, max_length=500)


class ImportPath(Shape):
    """A recording on this machine."""

    path: ServerPath
    name: Title | None = None


class SampleRequest(Shape):
    """A synthetic kitchen."""

    seed: int = Field(default=0, ge=0, le=1_000_000)
    frames: int = Field(default=90, ge=10, le=600)
    width: int = Field(default=960, ge=160, le=1920)
    height: int = Field(default=720, ge=120, le=1440)
    name: Title | None = None


class Trashed(Shape):
    """A project in the trash."""

    id: str
    name: str
    at: float  # when it was put there
    who: str
    size_bytes: int
    counts: ProjectCounts


class Deleted(Shape):
    """Result of deleting a project."""

    freed_bytes: int
