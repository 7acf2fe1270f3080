"""Collaboration: assignment, inbox and news."""

from app.schemas.base import Shape
from app.schemas.objects import HistoryEntry
from app.schemas.states import Comment, ReviewState
from app.schemas.text import Word


class AssigneeIn(Shape):
    """Whose turn it is from now on; None: nobody's."""

    name: Word | None


class InboxProject(Shape):
    """A project that waits for you, and who brought it to its state, when and why."""

    id: str
    name: str
    review_state: ReviewState
    who: str  # empty while it is a draft that nobody has sent anywhere
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
    at: float  # when the last change about it was stored


class InboxMention(Shape):
    """An open comment that names you."""

    project: str
    project_name: str
    comment: Comment


class Inbox(Shape):
    """The current user's inbox; each project is in one of the first two lists."""

    returned: list[InboxProject]  # sent back: to whom it is assigned, else to who had sent it to review
    assigned: list[InboxProject]
    objects: list[InboxObject]
    mentions: list[InboxMention]


class PersonsChanges(Shape):
    """How much somebody did."""

    who: str
    changes: int


class News(Shape):
    """Changes of a project by others since your last visit, newest first."""

    since: float | None  # None: you were never here, or have no account; there is nothing to tell then
    last: int  # the newest event there is, to say that all of it is read
    people: list[PersonsChanges]
    entries: list[HistoryEntry]


class SeenIn(Shape):
    """Up to which event the news were read."""

    event: int
