"""Interface of a segmented object: its kind, its measurements, and its pixels in any frame."""

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
    """A segmented object: its kind, measurements and pixels in any frame."""

    @property
    def kind(self) -> Kind:
        """Kind of the object as found, which may differ from its category's."""

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings to the user, one line each."""

    def see(self, frame: Frame) -> View:
        """Visible pixels in a frame, at the object's pose there."""

    def panel(self) -> FrontPanel | None:
        """Measured flat front."""

    def motions(self) -> tuple[JointMotion, ...]:
        """Joint motions of its leaves in the recording."""

    def box(self) -> ThingBox | None:
        """Measured box."""
