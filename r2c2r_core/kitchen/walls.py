"""Walls behind a front, for every stage, and the floor under it. For a front's depth see `kitchen.depth`."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from r2c2r_core.arrays import Points, Vector3
from r2c2r_core.model.capture import Wall
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of walls behind a front."""

    parallel_rad: float = param(
        float(np.deg2rad(10.0)),
        "rad",
        "Maximum angle between the normals of a front and of the wall behind it",
        source="measured on the sample kitchens: built-in fronts 0.2 degrees, free-standing appliances 5",
    )


def distances_behind(walls: Sequence[Wall], middle: Vector3, outward: Vector3) -> list[float]:
    """Metres from a front back to each wall that faces the same way, nearest first; negative for walls in front of it.

    A lining counts only where it extends along the wall to the front. `middle` is the centre of the front and `outward` its
    unit normal, both in the world; distances are along that normal.
    """
    facing = [wall for wall in walls if float(wall.normal @ outward) > np.cos(tuned(Params).parallel_rad)]
    parallel = [wall for wall in facing if _reaches(wall, middle)]
    return sorted(float((wall.normal @ middle - wall.offset_m) / (wall.normal @ outward)) for wall in parallel)


def _reaches(wall: Wall, point: Vector3) -> bool:
    along = float(np.cross([0.0, 0.0, 1.0], wall.normal) @ point)
    return wall.span_m is None or wall.span_m[0] < along < wall.span_m[1]


def depths_in(walls: Sequence[Wall], points_world: Points) -> np.ndarray:
    """(n walls,) depth of the deepest point behind each wall, metres; negative where all are inside the room."""
    return np.array([float((wall.offset_m - points_world @ wall.normal).max()) for wall in walls])


def floor_height(parts_world: Iterable[Points]) -> float:
    """World height of the floor plane: 0, or lower where a part reaches below it (levelling leaves millimetres)."""
    return min([0.0, *(float(points[:, 2].min()) for points in parts_world)])
