"""Collaboration: assignment, inbox and news."""

from app.schemas.base import Shape
from app.schemas.objects import HistoryEntry
from app.schemas.states import Comment, ReviewState
from app.schemas.text import Word


class AssigneeIn(Shape):
    """The new assignee; None clears the assignment."""

    name: Word | None


class InboxProject(Shape):
    """A project that waits for you; author, time and reason of its current state."""

    id: str
    name: str
    review_state: ReviewState
    who: str  # empty for a draft that was never submitted
    at: float
    reason: str


class InboxObject(Shape):
    """An object that waits for you."""

    project: str
    project_name: str
    review_state: ReviewState
    object: int
    name: str
    category: str
    at: float  # time of its last change


class InboxMention(Shape):
    """An open comment that names you."""

    project: str
    project_name: str
    comment: Comment


class Inbox(Shape):
    """The current user's inbox; each project is in one of the first two lists."""

    returned: list[InboxProject]  # sent back, to the assignee, else to the user who submitted it for review
    assigned: list[InboxProject]
    objects: list[InboxObject]
    mentions: list[InboxMention]


class PersonsChanges(Shape):
    """Number of changes by one user."""

    who: str
    changes: int


class News(Shape):
    """Changes of a project by others since your last visit, newest first."""

    since: float | None  # None before your first visit and without an account; there are no news then
    last: int  # the newest event, to mark all as read
    people: list[PersonsChanges]
    entries: list[HistoryEntry]


class SeenIn(Shape):
    """The last event that was read."""

    event: int
