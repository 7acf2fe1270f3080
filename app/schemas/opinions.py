"""Second opinions: independently annotated projects of one recording, and their agreement."""

from app.schemas.base import Shape
from app.schemas.states import ReviewState
from app.schemas.text import Word


class OpinionIn(Shape):
    """Assignee of a copy of the recording; None: not assigned."""

    name: Word | None


class Opinion(Shape):
    """A project on the same recording."""

    project: str
    name: str
    assignee: str | None
    review_state: ReviewState
    objects: int
    updated: float


class AgreedObject(Shape):
    """An object in one of two projects."""

    object: int
    name: str
    category: str
    frames: int  # of the compared ones, with a mask


class Agreed(Shape):
    """An object of both projects, or of one; then the other one and the comparison are None."""

    first: AgreedObject | None
    second: AgreedObject | None
    iou: float | None  # intersection over union of the pixels of all compared frames
    frames: int  # with a mask in both
    same_category: bool | None


class Agreement(Shape):
    """Agreement of two projects; objects with the largest disagreement first."""

    first: Opinion
    second: Opinion
    frames: int  # compared
    both: int
    only_first: int
    only_second: int
    mean_iou: float | None  # of the objects in both
    same_category: int  # of them
    objects: list[Agreed]
    unmasked: list[AgreedObject]  # of either project, without a mask, so that they cannot be compared
