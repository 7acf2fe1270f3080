"""Planes of the scan seen from the front, on which fronts are drawn."""

from pydantic import Field

from app.schemas.base import Shape
from r2c2r_core.schema.prompts import PromptsFileHandle


class ElevationLines(Shape):
    """How clearly lines of one direction show: what edges snap to."""

    block: int  # cells in a block
    blocks: int
    positions: int
    clarity: str  # base64 of bytes, (blocks, positions)


class Elevation(Shape):
    """A plane to scale. Cells are counted from its top left corner, to the right and down; axes are unit vectors."""

    id: int
    url: str  # of its picture, a pixel a cell
    cell_m: float
    columns: int
    rows: int
    origin_m: list[float]  # of its top left corner, in the recording's own world, as are the axes
    right: list[float]
    down: list[float]
    top_m: float  # height of that corner above the floor
    upright: ElevationLines  # positions are columns
    level: ElevationLines  # positions are rows
    cells: list[list[float]]  # left, top, right, bottom of the panels that were cut


class Elevations(Shape):
    """All of them, the largest first and walls last; none while the live segmenter has not drawn them."""

    drawn: bool
    items: list[Elevation]


class FoundFront(Shape):
    """The flat front of an object, as its masks were drawn with it."""

    object: int
    corners_m: list[list[float]]  # as in prompts.json
    handle: PromptsFileHandle | None
    edges: list[float] = Field(
        default_factory=list
    )  # probability of a seam at each: left, right, top, bottom; none where a person drew it
