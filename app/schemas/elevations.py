"""Elevations: orthophotos of vertical planes of the scan, on which fronts are drawn."""

from pydantic import Field

from app.schemas.base import Shape
from r2c2r_core.schema.prompts import PromptsFileHandle


class ElevationLines(Shape):
    """Line evidence in one direction, to which drawn edges snap."""

    block: int  # cells in a block
    blocks: int
    positions: int
    clarity: str  # base64 of bytes, (blocks, positions)


class Elevation(Shape):
    """A plane to scale. Cells are counted from its top left corner, to the right and down; axes are unit vectors."""

    id: int
    url: str  # of its picture, one pixel per cell
    cell_m: float
    columns: int
    rows: int
    origin_m: list[float]  # of its top left corner, in the recording's own world, as are the axes
    right: list[float]
    down: list[float]
    top_m: float  # height of that corner above the floor
    upright: ElevationLines  # positions are columns
    level: ElevationLines  # positions are rows
    cells: list[list[float]]  # left, top, right, bottom of the segmented panels


class Elevations(Shape):
    """All elevations, largest first and walls last; none until the live segmenter has rendered them."""

    drawn: bool
    items: list[Elevation]


class FoundFront(Shape):
    """The flat front of an object, as used for its masks."""

    object: int
    corners_m: list[list[float]]  # as in prompts.json
    handle: PromptsFileHandle | None
    certainty: float | None = None  # probability that it is right, 0..1; None in files of older versions
    suggested: str = ""  # category that its size suggests, if that is unlikely for the object's own
    edges: list[float] = Field(
        default_factory=list
    )  # seam probability of the left, right, top and bottom edge; empty if drawn by a user
