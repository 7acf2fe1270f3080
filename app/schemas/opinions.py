"""Second opinions: independently annotated projects of one recording, and their agreement."""

from app.schemas.base import Shape
from app.schemas.states import ReviewState
from app.schemas.text import Word


class OpinionIn(Shape):
    """Who is to work on a copy of the recording; None: nobody yet."""

    name: Word | None


class Opinion(Shape):
    """A project of the recording."""

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
    frames: int  # in which it has a mask, of those looked at


class Agreed(Shape):
    """An object that both have, or one of them: then the other is None, and so is what is said of the two."""

    first: AgreedObject | None
    second: AgreedObject | None
    iou: float | None  # pixels in both masks of the pixels in either, over all frames looked at
    frames: int  # in which both have a mask
    same_category: bool | None


class Agreement(Shape):
    """How far two projects agree; what disagrees most comes first."""

    first: Opinion
    second: Opinion
    frames: int  # looked at
    both: int
    only_first: int
    only_second: int
    mean_iou: float | None  # of the objects that both have
    same_category: int  # of them
    objects: list[Agreed]
    unmasked: list[AgreedObject]  # of either, without a mask: nothing can be said of them
