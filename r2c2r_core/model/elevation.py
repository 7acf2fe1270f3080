"""Elevation: orthographic front view of a plane of the scan, to scale, on which a person draws fronts."""

from dataclasses import dataclass

import numpy as np

from r2c2r_core.arrays import Image, Vector3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Lines:
    """Evidence of lines of one direction, 0 to 255: (blocks, positions), `block` cells per block across."""

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
