"""What a segmenter found under the clicks: its kind, its measures, and its pixels in any frame."""

from dataclasses import dataclass
from typing import Protocol

from r2c2r_core.arrays import Mask
from r2c2r_core.kitchen.category import Kind
from r2c2r_core.model.capture import Frame
from r2c2r_core.model.motion import JointMotion
from r2c2r_core.model.track import FrontPanel, ThingBox


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """An object in one frame."""

    mask: Mask  # its visible pixels
    trust: float  # how far to trust them, 0..1


class Found(Protocol):
    """An object found from its clicks: what it is, and its pixels in any frame."""

    @property
    def kind(self) -> Kind:
        """What it turned out to be."""

    @property
    def warnings(self) -> tuple[str, ...]:
        """One line each, for a person."""

    def see(self, frame: Frame) -> View:
        """Its pixels in a frame, where it stands there."""

    def panel(self) -> FrontPanel | None:
        """Its flat front, measured."""

    def motions(self) -> tuple[JointMotion, ...]:
        """How its leaves were filmed to move."""

    def box(self) -> ThingBox | None:
        """Its box, measured."""
