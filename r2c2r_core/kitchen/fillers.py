"""Fillers at inside corners: where two runs meet, a filler lets the doors clear each other.

A front cannot reach behind the plane of the run it meets, and a door that ended at that plane would not open past the other
run's handles.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from r2c2r_core.arrays import Vector3
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of corner fillers."""

    width_m: float = param(
        0.05,
        "m",
        "Minimum width of a corner filler",
        source="kitchen catalogues: fillers of 40-80 mm; a bar handle protrudes 25-40 mm",
    )
    faces_rad: float = param(
        float(np.deg2rad(40.0)),
        "rad",
        "Maximum deviation from a right angle at which the other run faces the edge",
        source="a diagonal corner unit (45 degrees) meets its neighbours without a filler",
    )


class FrontBox(NamedTuple):
    """A unit with a front, in the object frame's convention: its front face at -Y."""

    world_from_object: Rigid3
    dimensions_m: Vector3


def missing_filler(unit: FrontBox, side: float, other: FrontBox) -> float:
    """Distance (m) by which a unit's edge (side -1 left, +1 right) violates a filler's width at the other's front plane.

    0 where the two do not meet at an inside corner.
    """
    params = tuned(Params)
    along = side * unit.world_from_object.rotation[:, 0]
    other_outward = -other.world_from_object.rotation[:, 1]
    if float(other_outward @ -along) < np.cos(params.faces_rad):
        return 0.0
    width, depth, height = unit.dimensions_m
    front_edge = np.array([[side * width / 2, -depth / 2, 0.0]])
    x, y, z = other.world_from_object.inverse.apply(unit.world_from_object.apply(front_edge))[0]
    other_width, other_depth, other_height = other.dimensions_m
    beside = abs(x) < other_width / 2 + params.width_m
    level = abs(z) < (height + other_height) / 2
    before = -other_depth / 2 - y  # distance of the edge in front of the other's front plane
    return max(params.width_m - float(before), 0.0) if beside and level else 0.0
