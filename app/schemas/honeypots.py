"""Honeypots: sample kitchens in a user's queue, scored against ground truth. Visible to admins only."""

from app.schemas.base import Shape
from app.schemas.states import ReviewState
from app.schemas.text import Title, Word


class HoneypotIn(Shape):
    """A new honeypot: the user to whose queue it is added, and its displayed name."""

    person: Word
    name: Title


class Honeypot(Shape):
    """A stored honeypot."""

    project: str
    name: str
    person: str | None  # current assignee
    review_state: ReviewState
    made: float


class TrueObject(Shape):
    """A ground-truth object, and the user's object matched to it, if any."""

    name: str
    category: str
    object: int | None
    iou: float | None
    same_category: bool | None


class HoneypotScore(Shape):
    """The user's score on a honeypot."""

    found: int  # ground-truth objects matched by one of the user's
    extra: int  # the user's objects without a match
    mean_iou: float | None  # of those found
    same_category: int  # of those found
    objects: list[TrueObject]
