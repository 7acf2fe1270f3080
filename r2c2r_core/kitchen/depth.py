"""How deep a front is: decided here, for every stage.

Nobody sees how deep a cabinet is behind its front. `front_depth` is what the room tells, and the masks of its sides; the
shapes that `generate` weighs reach back to each of `depths_behind`; what was chosen is held to what can be by `believable`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from r2c2r_core.arrays import Vector3
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.kitchen.categories import DEPTHS_SOLD_M
from r2c2r_core.kitchen.category import Category, Size
from r2c2r_core.kitchen.walls import distances_behind
from r2c2r_core.model.capture import Capture, Wall
from r2c2r_core.tuning import param, tuned

DepthSource = Literal["seen", "points", "box", "wall", "worktop", "category", "catalogue"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """How deep a front may be, and which depth is believed."""

    alike_m: float = param(0.015, "m", "between depths that are one guess")
    least_worktop: float = param(0.75, "share", "of the category's depth: a level sheet that ends before is a shelf or a board")
    wall_gap_m: float = param(0.005, "m", "between a wall and a unit's back")
    to_wall_m: float = param(0.03, "m", "between a back and the wall it is taken to stand against")
    worktop_above_m: float = param(0.75, "m", "above the middle drawer of its unit, at most, where a worktop lies")
    along_m: float = param(0.02, "m", "width of the strips in which a worktop is followed backwards", gt=0)
    level_m: float = param(0.01, "m", "height of the layers in which one is looked for", gt=0)
    gap_bins: int = param(6, "count", "strips that may show nothing", source="what stands on a worktop hides less of it")
    sheet_fill: float = param(0.7, "share", "of the strips that must show it")
    deepest_m: float = param(1.2, "m", "behind a front, to which a worktop is followed", source="an island's, from both sides")
    least_points: int = param(50, "count", "of the fused surface above a front, for a worktop to be looked for")


class FrontDepth(NamedTuple):
    """How far a front reaches back, before anything shows it."""

    wall_m: float | None  # to the nearest wall that a thing of its category may stand against
    usual_m: float  # of its category

    @property
    def depth_m(self) -> float:
        """To the wall where there is one."""
        return self.usual_m if self.wall_m is None else self.wall_m


def front_depth(walls: Sequence[Wall], middle: Vector3, outward: Vector3, depth: Size) -> FrontDepth:
    """The depth of a front with this middle and unit normal (world), of a category as deep as this."""
    to_wall = next((d for d in distances_behind(walls, middle, outward) if depth.holds(d)), None)
    return FrontDepth(to_wall, depth.usual)


class DepthBehind(NamedTuple):
    """How far a front reaches back, and how that is known."""

    depth_m: float
    source: DepthSource


def believable(depth_m: float, behind: FrontDepth, allowed: Size, *, seen_apart: bool) -> tuple[float, bool]:
    """The depth, to the wall where it ends near or beyond one, and whether it is no more than a usual one.

    Args:
        depth_m: of the shape that was chosen.
        behind: What the room tells of its front.
        allowed: Depths of its category.
        seen_apart: Whether its sides are seen, as a free-standing appliance's are: it may stand off the wall, not in it.

    """
    near_m = 0.0 if seen_apart else tuned(Params).to_wall_m
    if behind.wall_m is not None and depth_m > behind.wall_m - near_m:
        depth_m = behind.wall_m
    if allowed.holds(depth_m):
        return depth_m, False
    return behind.depth_m, behind.wall_m is None


def depths_behind(
    capture: Capture, world_from_front: Rigid3, width_m: float, height_m: float, category: Category
) -> tuple[DepthBehind, ...]:
    """The different depths a front may have, most trusted first.

    To the wall behind it where one stands at a plausible distance; to where the worktop on it ends; as deep as its category
    usually is.
    """
    params = tuned(Params)
    wall, usual = front_depth(
        capture.room.walls, world_from_front.translation, -world_from_front.rotation[:, 1], category.depth
    )
    found = [] if wall is None else [DepthBehind(wall - params.wall_gap_m, "wall")]
    worktop = _worktop_end(capture, world_from_front, width_m, height_m, params.least_worktop * usual)
    if worktop is not None and worktop <= category.depth.high:
        found.append(DepthBehind(worktop, "worktop"))
    return distinct([*found, DepthBehind(usual, "category")])


def next_sizes(depth_m: float) -> tuple[DepthBehind, ...]:
    """The next smaller and the next larger depth that cabinets are sold in."""
    params = tuned(Params)
    smaller = max((d for d in DEPTHS_SOLD_M if d < depth_m - params.alike_m), default=None)
    larger = min((d for d in DEPTHS_SOLD_M if d > depth_m + params.alike_m), default=None)
    return tuple(DepthBehind(d, "catalogue") for d in (smaller, larger) if d is not None)


def distinct(depths: Sequence[DepthBehind]) -> tuple[DepthBehind, ...]:
    """Without those that are about as deep as one before them."""
    params = tuned(Params)
    return tuple(
        b for k, b in enumerate(depths) if all(abs(b.depth_m - other.depth_m) > params.alike_m for other in depths[:k])
    )


def _worktop_end(capture: Capture, world_from_front: Rigid3, width_m: float, height_m: float, least_m: float) -> float | None:
    """Where the lowest level sheet above a front ends that begins over it, as a worktop does; None where none is seen."""
    params = tuned(Params)
    points = world_from_front.inverse.apply(capture.surface.vertices_world)
    above = points[(points[:, 2] > height_m / 2 - params.level_m) & (points[:, 2] < height_m / 2 + params.worktop_above_m)]
    above = above[(np.abs(above[:, 0]) < width_m / 2) & (above[:, 1] > 0.0) & (above[:, 1] < params.deepest_m)]
    if len(above) < params.least_points:
        return None
    cell = np.floor(above[:, 1:] / [params.along_m, params.level_m]).astype(int)
    for level in np.unique(cell[:, 1]):
        bins = np.unique(cell[np.abs(cell[:, 1] - level) <= 1, 0])
        end = int(bins[np.argmax(np.append(np.diff(bins) > params.gap_bins, True))]) + 1
        if bins[0] <= 1 and end * params.along_m >= least_m and np.count_nonzero(bins < end) > params.sheet_fill * end:
            return end * params.along_m
    return None
