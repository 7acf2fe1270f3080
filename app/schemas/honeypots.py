"""Honeypots: sample kitchens in a user's queue, scored against their truth. Visible to admins only."""

from app.schemas.base import Shape
from app.schemas.states import ReviewState
from app.schemas.text import Title, Word


class HoneypotIn(Shape):
    """Whose queue it is slipped into, and what it is called there."""

    person: Word
    name: Title


class Honeypot(Shape):
    """One that was."""

    project: str
    name: str
    person: str | None  # whose turn it is
    review_state: ReviewState
    made: float


class TrueObject(Shape):
    """An object that is really there, and the person's that was found to be it."""

    name: str
    category: str
    object: int | None
    iou: float | None
    same_category: bool | None


class HoneypotScore(Shape):
    """The user's score on a honeypot."""

    found: int  # objects that are really there, and have one of the person's on them
    extra: int  # objects of the person on nothing of the kind
    mean_iou: float | None  # of those found
    same_category: int  # of those found
    objects: list[TrueObject]
