"""Objects proposed without a click."""

from typing import Literal

from pydantic import Field

from app.schemas.base import Shape
from app.schemas.text import Word


class Proposal(Shape):
    """An object proposed without a click; confirming it adds this click under this category."""

    id: str
    kind: Literal["front", "appliance", "thing"]
    category: str
    confidence: float
    frame: int  # with the best view
    x: float
    y: float
    size_m: list[float]  # width, depth, height
    outline: list[tuple[float, float]]  # in pixels of the stored frame
    handle: list[tuple[float, float]]  # its corners in the frame; empty if none was detected
    doubts: list[str]  # reasons against confirming it together with others


class Proposals(Shape):
    """The current proposals, without dismissed and confirmed ones."""

    state: Literal["none", "running", "done"]
    fraction: float
    items: list[Proposal]
    dismissed: int


class ProposalIds(Shape):
    """Selection of proposals."""

    ids: list[Word] = Field(min_length=1, max_length=500)


class ProposalsConfirmed(ProposalIds):
    """Proposals to be confirmed as objects."""

    category: Word | None = None  # of all of them; None: as proposed
