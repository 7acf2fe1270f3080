"""Masks, where they are, and the live segmenter."""

from typing import Literal

from app.schemas.base import ErrorBody, Shape
from app.schemas.objects import SegmentState

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
    """Where an object is seen: frames, and the confidence on each."""

    object: int
    state: SegmentState
    source: Literal["live", "run", "none"]
    complete: bool
    frames: list[int]
    confidences: list[float]


class LiveStatus(Shape):
    """The project's live segmenter."""

    state: LiveState
    fraction: float
    text: str
    error: ErrorBody | None
