"""Depth of a front for every stage: from the room, the worktop above, or the category.

The depth of a cabinet behind its front is not visible. `front_depth` is the room's constraint; the shapes that `generate` ranks
extend to each of `depths_behind`; the chosen depth is limited to plausible values by `believable`; the units of one run vote,
each by the `sigma_m` of its source (synthesize/unit_runs.py).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple, get_args

import numpy as np

from r2c2r_core.arrays import Vector3
from r2c2r_core.kitchen.categories import DEPTHS_SOLD_M
from r2c2r_core.kitchen.category import Category, Size
from r2c2r_core.kitchen.walls import distances_behind
from r2c2r_core.model.capture import Capture, Wall
from r2c2r_core.model.rectangle import Rectangle3
from r2c2r_core.tuning import param, tuned

DepthSource = Literal["box", "wall", "worktop", "category", "catalogue"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of depths behind a front."""

    alike_m: float = param(0.015, "m", "Maximum difference between depths that count as one candidate")
    least_worktop: float = param(
        0.75, "share", "Minimum depth of a worktop relative to the category's: a shorter level sheet is a shelf or a board"
    )
    sigmas_m: tuple[float, float, float, float, float] = param(
        (0.01, 0.03, 0.05, 0.15, 0.15),
        "m",
        "Standard deviation of a depth from an observed box, wall, worktop, category and catalogue, in this order",
        source="a fused surface; pipes behind backs; a worktop's overhang on an island; a quarter of the range of depths sold",
    )
    wall_gap_m: float = param(0.005, "m", "Gap between a wall and a unit's back")
    to_wall_m: float = param(0.03, "m", "Distance between a back and a wall below which it is taken to touch the wall")
    worktop_above_m: float = param(
        0.75, "m", "Maximum height of a worktop above the top of a front, such as a middle drawer of its unit"
    )
    along_m: float = param(0.02, "m", "Width of the strips in which a worktop is traced backwards", gt=0)
    level_m: float = param(0.01, "m", "Height of the layers in which a worktop is searched", gt=0)
    gap_bins: int = param(
        6, "count", "Maximum number of consecutive empty strips", source="objects on a worktop hide less of it"
    )
    sheet_fill: float = param(0.7, "share", "Minimum fraction of the strips that show the worktop")
    deepest_m: float = param(
        1.2, "m", "Maximum depth behind a front to which a worktop is traced", source="an island's, from both sides"
    )
    least_points: int = param(
        50, "count", "Minimum number of points of the fused surface above a front for the search of a worktop"
    )


class FrontDepth(NamedTuple):
    """Prior depth of a front, before any observation."""

    wall_m: float | None  # to the nearest wall that an object of its category may stand against
    usual_m: float  # usual depth of its category

    @property
    def depth_m(self) -> float:
        """Depth to the wall if there is one, else the usual one."""
        return self.usual_m if self.wall_m is None else self.wall_m


def front_depth(walls: Sequence[Wall], middle: Vector3, outward: Vector3, depth: Size) -> FrontDepth:
    """Prior depth of a front with this centre and unit normal (world), given its category's depths."""
    to_wall = next((d for d in distances_behind(walls, middle, outward) if depth.holds(d)), None)
    return FrontDepth(to_wall, depth.usual)


class DepthBehind(NamedTuple):
    """A depth behind a front and its source."""

    depth_m: float
    source: DepthSource


def sigma_m(source: DepthSource) -> float:
    """Standard deviation of a depth from this source."""
    return tuned(Params).sigmas_m[get_args(DepthSource).index(source)]


def believable(depth_m: float, behind: FrontDepth, allowed: Size, *, seen_apart: bool) -> tuple[float, DepthSource | None]:
    """Depth limited to the wall, or replaced if implausible, and its source; None where it is the shape's own.

    With `seen_apart`, its sides are seen, as a free-standing appliance's are: it may stand off the wall, not in it.
    """
    near_m = 0.0 if seen_apart else tuned(Params).to_wall_m
    possible_m = float(np.clip(depth_m, allowed.low, allowed.high))
    plausible = abs(possible_m - depth_m) < tuned(Params).alike_m  # a mesh is placed to millimetres
    if behind.wall_m is not None and (depth_m > behind.wall_m - near_m or not plausible):
        return behind.wall_m, "wall"
    return (possible_m, None) if plausible else (behind.usual_m, "category")


def depths_behind(capture: Capture, front: Rectangle3, category: Category) -> tuple[DepthBehind, ...]:
    """Candidate depths of a front, most trusted first.

    To the wall behind it if one is at a plausible distance; to the end of the worktop on it; its category's usual depth.
    """
    params = tuned(Params)
    wall, usual = front_depth(capture.room.walls, front.centre, front.outward, category.depth)
    found = [] if wall is None else [DepthBehind(wall - params.wall_gap_m, "wall")]
    worktop = _worktop_end(capture, front, params.least_worktop * usual)
    if worktop is not None and worktop <= category.depth.high:
        found.append(DepthBehind(worktop, "worktop"))
    return distinct([*found, DepthBehind(usual, "category")])


def next_sizes(depth_m: float) -> tuple[DepthBehind, ...]:
    """The next smaller and the next larger depth in which cabinets are sold."""
    params = tuned(Params)
    smaller = max((d for d in DEPTHS_SOLD_M if d < depth_m - params.alike_m), default=None)
    larger = min((d for d in DEPTHS_SOLD_M if d > depth_m + params.alike_m), default=None)
    return tuple(DepthBehind(d, "catalogue") for d in (smaller, larger) if d is not None)


def distinct(depths: Sequence[DepthBehind]) -> tuple[DepthBehind, ...]:
    """The depths without those close to an earlier one."""
    params = tuned(Params)
    return tuple(
        b for k, b in enumerate(depths) if all(abs(b.depth_m - other.depth_m) > params.alike_m for other in depths[:k])
    )


def _worktop_end(capture: Capture, front: Rectangle3, least_m: float) -> float | None:
    """Depth to the end of the lowest level sheet above a front that begins over it, as a worktop does; None without one."""
    params, (half_w, half_h) = tuned(Params), front.half_m
    points = front.world_from_front.inverse.apply(capture.surface.vertices_world)
    above = points[(points[:, 2] > half_h - params.level_m) & (points[:, 2] < half_h + params.worktop_above_m)]
    above = above[(np.abs(above[:, 0]) < half_w) & (above[:, 1] > 0.0) & (above[:, 1] < params.deepest_m)]
    if len(above) < params.least_points:
        return None
    cell = np.floor(above[:, 1:] / [params.along_m, params.level_m]).astype(int)
    for level in np.unique(cell[:, 1]):
        bins = np.unique(cell[np.abs(cell[:, 1] - level) <= 1, 0])
        end = int(bins[np.argmax(np.append(np.diff(bins) > params.gap_bins, True))]) + 1
        if bins[0] <= 1 and end * params.along_m >= least_m and np.count_nonzero(bins < end) > params.sheet_fill * end:
            return end * params.along_m
    return None
