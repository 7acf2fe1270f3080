"""Masks, their frames, and the live segmenter."""

from typing import Literal

from app.schemas.base import ErrorBody, Shape
from app.schemas.objects import SegmentState
from r2c2r_core.model.motion import Source

LiveState = Literal["off", "starting", "preparing", "ready", "failed"]


class MaskBits(Shape):
    """A mask at preview size: base64 of zlib of the bits of its box, row by row without padding, high bit first."""

    width: int
    height: int
    left: int
    top: int
    box_width: int
    box_height: int
    bits: str


class FrameMask(Shape):
    """One object's mask on one frame."""

    object: int
    frame: int
    confidence: float
    source: Literal["live", "run"]
    mask: MaskBits


class Lane(Shape):
    """Frames with a mask of an object, and the confidence in each."""

    object: int
    state: SegmentState
    source: Literal["live", "run", "none"]
    complete: bool
    frames: list[int]
    confidences: list[float]


class OpenState(Shape):
    """Joint position of a leaf in a frame that shows it: rad or m from closed; null if unknown."""

    frame: int
    value: float | None
    sigma: float | None  # standard deviation; null where marked by a user


class Opening(Shape):
    """Filmed motion of a leaf of an object."""

    object: int
    part: str  # of an object with several; else empty
    kind: Literal["revolute", "prismatic"]
    largest: float  # widest observed state, rad or m: the joint opens at least as far
    source: Source  # of axis and pivot
    states: list[OpenState]


class LiveStatus(Shape):
    """The project's live segmenter."""

    state: LiveState
    fraction: float
    text: str
    error: ErrorBody | None
