"""How deep furniture is when nobody sees it: the wall behind, the worktop on it, what is usual or sold."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.kitchen.categories import DEPTHS_SOLD_M
from r2c2r_core.kitchen.category import Category
from r2c2r_core.kitchen.walls import front_depth
from r2c2r_core.model.capture import Capture
from r2c2r_core.tuning import param, tuned

DepthSource = Literal["seen", "points", "box", "wall", "worktop", "category", "catalogue"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """How deep furniture is when nobody sees it."""

    alike_m: float = param(0.015, "m", "between depths that are one guess")
    least_worktop: float = param(0.75, "share", "of the category's depth: a level sheet that ends before is a shelf or a board")
    wall_gap_m: float = param(0.005, "m", "between a wall and a unit's back")
    worktop_above_m: float = param(0.75, "m", "above the middle drawer of its unit, at most, where a worktop lies")
    along_m: float = param(0.02, "m", "width of the strips in which a worktop is followed backwards", gt=0)
    level_m: float = param(0.01, "m", "height of the layers in which one is looked for", gt=0)
    gap_bins: int = param(6, "count", "strips that may show nothing", source="what stands on a worktop hides less of it")
    sheet_fill: float = param(0.7, "share", "of the strips that must show it")


class DepthBehind(NamedTuple):
    """How far a front reaches back, and how that is known."""

    depth_m: float
    source: DepthSource


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
    sheet = _sheet_behind(capture, world_from_front, width_m, height_m)
    walls = [d for d in (wall, sheet) if d is not None and category.depth.holds(d)]
    found = [DepthBehind(d - params.wall_gap_m, "wall") for d in sorted(walls, key=lambda d: abs(d - usual))[:1]]
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


def _sheet_behind(capture: Capture, world_from_front: Rigid3, width_m: float, height_m: float) -> float | None:
    """Where the scan shows an upright sheet behind the front, above or below it."""
    points = world_from_front.inverse.apply(capture.surface.vertices_world)
    beside = (np.abs(points[:, 2]) > height_m / 2 + 0.08) & (np.abs(points[:, 2]) < height_m / 2 + 0.6)
    column = points[beside & (np.abs(points[:, 0]) < width_m / 2) & (points[:, 1] > 0.15) & (points[:, 1] < 1.0)]
    if len(column) < 50:
        return None
    counts, edges = np.histogram(column[:, 1], bins=np.arange(0.15, 1.0, 0.01))
    counts = np.convolve(counts, np.ones(3), mode="same")
    peak = int(np.argmax(counts))
    at_peak = column[np.abs(column[:, 1] - (edges[peak] + 0.005)) < 0.015]
    # a sheet is upright and wide: a worktop edge or a lone object is neither
    if len(at_peak) < 50 or np.ptp(at_peak[:, 2]) < 0.15 or np.ptp(at_peak[:, 0]) < 0.5 * width_m:
        return None
    return float(np.median(at_peak[:, 1]))


def _worktop_end(capture: Capture, world_from_front: Rigid3, width_m: float, height_m: float, least_m: float) -> float | None:
    """Where the lowest level sheet above a front ends that begins over it, as a worktop does; None where none is seen."""
    params = tuned(Params)
    points = world_from_front.inverse.apply(capture.surface.vertices_world)
    above = points[(points[:, 2] > height_m / 2 - 0.01) & (points[:, 2] < height_m / 2 + params.worktop_above_m)]
    above = above[(np.abs(above[:, 0]) < width_m / 2) & (above[:, 1] > 0.0) & (above[:, 1] < 1.2)]
    if len(above) < 50:
        return None
    cell = np.floor(above[:, 1:] / [params.along_m, params.level_m]).astype(int)
    for level in np.unique(cell[:, 1]):
        bins = np.unique(cell[np.abs(cell[:, 1] - level) <= 1, 0])
        end = int(bins[np.argmax(np.append(np.diff(bins) > params.gap_bins, True))]) + 1
        if bins[0] <= 1 and end * params.along_m >= least_m and np.count_nonzero(bins < end) > params.sheet_fill * end:
            return end * params.along_m
    return None
