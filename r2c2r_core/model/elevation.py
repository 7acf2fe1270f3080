"""A plane of the scan seen from the front, to scale, as a person draws fronts on it."""

from dataclasses import dataclass

import numpy as np

from r2c2r_core.arrays import Image, Vector3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Lines:
    """How clearly lines of one direction show, 0 to 255: (blocks, positions), `block` cells in a block across."""

    clarity: np.ndarray  # uint8
    block: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Elevation:
    """A plane seen from the front. Cells are counted from its top left corner, to the right and down."""

    picture: Image
    cell_m: float
    origin_capture: Vector3  # of the top left corner, in the capture frame
    right_capture: Vector3  # unit
    down_capture: Vector3  # unit
    top_m: float  # height of the top left corner above the floor, where one was found
    upright: Lines  # positions are columns
    level: Lines  # positions are rows
    cells: tuple[tuple[float, float, float, float], ...]  # left, top, right, bottom of the panels that were cut
