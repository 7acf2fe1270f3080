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
    """A project as in the list of all: its recording, state and results."""

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
    job: Job | None  # the active one, else the last one
    result: Literal["none", "stale", "current"]  # stale: user input has changed since the last run
    bundle: Bundle | None  # the newest
    thumbnail: str | None
    size_bytes: int
    segmenter: str  # computes the masks
    generator: str  # generates the candidates
    matcher: str  # aligns them
    arm: str  # tests the joints of the bundle
    review_state: ReviewState
    tags: list[str]
    archived: bool  # completed; listed only on request
    assignee: str | None  # current assignee


class Project(ProjectSummary):
    """One project, with the capture doctor's findings on its recording."""

    capture: CaptureFacts | None
    notices: list[str]
    register_depth: bool  # whether depth is registered to the colour images when the recording is read
    scale: float  # factor on all lengths of the recording when it is read
    checklist: list[ListedObject]  # objects to be clicked, including those done already
    awaits_recording: bool  # it has no recording, and may be given one


class ProjectPatch(Shape):
    """Changes of a project: name, tags, archive state, or backends of its stages."""

    name: Title | None = None
    tags: list[Word] | None = Field(default=None, max_length=20)
    archived: bool | None = None
    segmenter: Word | None = None
    generator: Word | None = None
    matcher: Word | None = None
    arm: Word | None = None


class ReadingIn(Shape):
    """Options for reading the recording."""

    register_depth: bool | None = None  # None: unchanged
    scale: float | None = Field(default=None, ge=0.2, le=5.0)  # factor on depth and camera path; None: unchanged


class ProjectMembers(Shape):
    """Visibility of a project: everybody, or only its owner, its members and admins."""

    members_only: bool
    owner: str | None  # None: the user who started the server, or a deleted account
    members: list[str]
    may_change: bool  # whether you may change them
    accounts: list[str]  # possible members; empty unless you may change them


class MembersIn(Shape):
    """New visibility of a project; its owner can always see it."""

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
    at: float  # time of deletion
    who: str
    size_bytes: int
    counts: ProjectCounts


class Deleted(Shape):
    """Result of deleting a project."""

    freed_bytes: int
