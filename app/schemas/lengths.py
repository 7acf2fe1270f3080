"""True lengths measured in the room, to check the scan's scale."""

from typing import Annotated, Literal, Self

from pydantic import Field, FiniteFloat, model_validator

from app.schemas.base import Shape
from app.schemas.text import Remark

Side = Literal["width", "depth", "height"]
PointWorld = Annotated[list[FiniteFloat], Field(min_length=3, max_length=3)]


class TrueLengthIn(Shape):
    """A length measured with a tape: of an object's side in the finished scene, or between two points of the world."""

    metres: float = Field(gt=0.005, le=100.0)
    object: int | None = Field(default=None, ge=0, lt=2**63)
    side: Side | None = None
    points_world: Annotated[list[PointWorld], Field(min_length=2, max_length=2)] | None = None
    text: Remark = ""  # description; by default the object's side, or "between two points"

    @model_validator(mode="after")
    def _of_one_thing(self) -> Self:
        """Require either an object and its side, or two points."""
        of_side = self.object is not None and self.side is not None
        if of_side == (self.points_world is not None) or (self.object is None) != (self.side is None):
            raise ValueError("a true length is of an object's side (object, side) or between two points (points_world)")
        return self


class TrueLength(Shape):
    """A length measured in the room, beside the length in the scan."""

    id: int
    text: str
    object: int | None
    side: Side | None
    points_world: list[list[float]] | None  # at the current scale of the recording
    metres: float
    measured_m: float | None  # in the finished scene, or between the points; None without a current one
    error_m: float | None  # measured - true
    compared: bool  # whether the scale is fitted to it: not to sides that a person or the category set
    who: str
    at: float


class TrueLengths(Shape):
    """All true lengths of a project, and the scale that fits them best."""

    lengths: list[TrueLength]
    scale: float  # current scale of the recording
    scale_wanted: float | None  # best fit of the lengths; None without any that is compared
    mean_error: float | None  # mean of |measured - true| / true of those that are compared
    mean_error_scaled: float | None  # the same at `scale_wanted`
