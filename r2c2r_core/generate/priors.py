"""How deep furniture is when nobody sees it: the wall behind, the worktop on it, what is usual or sold."""

from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np

from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.capture import Capture

CATEGORY_DEPTH_M = {
    "drawer": 0.58,
    "cabinet": 0.58,
    "double_door_cabinet": 0.58,
    "sink_cabinet": 0.58,
    "dishwasher": 0.58,
    "oven": 0.58,
    "range": 0.62,
    "stove": 0.62,
    "counter": 0.62,
    "wall_cabinet": 0.33,
    "hood": 0.45,
    "microwave": 0.38,
    "refrigerator": 0.65,
    "fridge": 0.65,
}
"""Outer face of the front to the back (EU catalogues, backends.md §2.6: carcass 0.56 + front 0.02; wall units 0.30-0.35)."""

_DEPTHS_SOLD_M = (0.30, 0.37, 0.48, 0.58, 0.62, 0.75)
"""Of cabinets with their fronts: carcasses of 28, 35, 46, 56, 60 and 73 cm are what most makers list."""

_DEFAULT_DEPTH_M = 0.5
_ALIKE_M = 0.015  # depths nearer to each other than this are one guess
_WALL_RANGE = (0.75, 1.35)  # of the category's depth: a wall outside is another room's, or the front of the next run
_WALL_GAP_M = 0.005
_WORKTOP_ABOVE_M = 0.75  # a worktop lies this far at most above the middle drawer of its unit
_ALONG_M, _LEVEL_M = 0.02, 0.01
_GAP_BINS, _SHEET_FILL = 6, 0.7  # what stands on a worktop hides less of it


DepthSource = Literal["seen", "points", "box", "wall", "worktop", "category", "catalogue"]


class DepthBehind(NamedTuple):
    """How far a front reaches back, and how that is known."""

    depth_m: float
    source: DepthSource


def category_depth(category: str) -> float:
    """The usual depth of a category, metres."""
    key = category.strip().lower().replace("-", "_").replace(" ", "_")
    if key in CATEGORY_DEPTH_M:
        return CATEGORY_DEPTH_M[key]
    return next((depth for name, depth in CATEGORY_DEPTH_M.items() if name in key), _DEFAULT_DEPTH_M)


def depths_behind(
    capture: Capture, world_from_front: Rigid3, width_m: float, height_m: float, category: str
) -> tuple[DepthBehind, ...]:
    """The different depths a front may have, most trusted first.

    To the wall behind it where one stands at a plausible distance; to where the worktop on it ends; as deep as its category
    usually is.
    """
    usual = category_depth(category)
    near, far = (share * usual for share in _WALL_RANGE)
    walls = [*_wall_distances(capture, world_from_front), *_surface_distances(capture, world_from_front, width_m, height_m)]
    found = [DepthBehind(d - _WALL_GAP_M, "wall") for d in sorted(walls, key=lambda d: abs(d - usual))[:1] if near <= d <= far]
    worktop = _worktop_end(capture, world_from_front, width_m, height_m, near)
    if worktop is not None and worktop <= far:
        found.append(DepthBehind(worktop, "worktop"))
    return distinct([*found, DepthBehind(usual, "category")])


def next_sizes(depth_m: float) -> tuple[DepthBehind, ...]:
    """The next smaller and the next larger depth that cabinets are sold in."""
    smaller = max((d for d in _DEPTHS_SOLD_M if d < depth_m - _ALIKE_M), default=None)
    larger = min((d for d in _DEPTHS_SOLD_M if d > depth_m + _ALIKE_M), default=None)
    return tuple(DepthBehind(d, "catalogue") for d in (smaller, larger) if d is not None)


def distinct(depths: Sequence[DepthBehind]) -> tuple[DepthBehind, ...]:
    """Without those that are about as deep as one before them."""
    return tuple(b for k, b in enumerate(depths) if all(abs(b.depth_m - other.depth_m) > _ALIKE_M for other in depths[:k]))


def _wall_distances(capture: Capture, world_from_front: Rigid3) -> list[float]:
    """Distances along +Y of the front to the room's walls that are parallel to it."""
    into, origin = world_from_front.rotation[:, 1], world_from_front.translation
    return [
        float((wall.offset_m - wall.normal @ origin) / (wall.normal @ into))
        for wall in capture.room.walls
        if wall.normal @ into < -0.97
    ]


def _surface_distances(capture: Capture, world_from_front: Rigid3, width_m: float, height_m: float) -> list[float]:
    """Where the scan shows an upright sheet behind the front, above or below it; at most one."""
    points = world_from_front.inverse.apply(capture.surface.vertices_world)
    beside = (np.abs(points[:, 2]) > height_m / 2 + 0.08) & (np.abs(points[:, 2]) < height_m / 2 + 0.6)
    column = points[beside & (np.abs(points[:, 0]) < width_m / 2) & (points[:, 1] > 0.15) & (points[:, 1] < 1.0)]
    if len(column) < 50:
        return []
    counts, edges = np.histogram(column[:, 1], bins=np.arange(0.15, 1.0, 0.01))
    counts = np.convolve(counts, np.ones(3), mode="same")
    peak = int(np.argmax(counts))
    at_peak = column[np.abs(column[:, 1] - (edges[peak] + 0.005)) < 0.015]
    # a sheet is upright and wide: a worktop edge or a lone object is neither
    if len(at_peak) < 50 or np.ptp(at_peak[:, 2]) < 0.15 or np.ptp(at_peak[:, 0]) < 0.5 * width_m:
        return []
    return [float(np.median(at_peak[:, 1]))]


def _worktop_end(capture: Capture, world_from_front: Rigid3, width_m: float, height_m: float, least_m: float) -> float | None:
    """Where the lowest level sheet above a front ends that begins over it, as a worktop does; None where none is seen."""
    points = world_from_front.inverse.apply(capture.surface.vertices_world)
    above = points[(points[:, 2] > height_m / 2 - 0.01) & (points[:, 2] < height_m / 2 + _WORKTOP_ABOVE_M)]
    above = above[(np.abs(above[:, 0]) < width_m / 2) & (above[:, 1] > 0.0) & (above[:, 1] < 1.2)]
    if len(above) < 50:
        return None
    cell = np.floor(above[:, 1:] / [_ALONG_M, _LEVEL_M]).astype(int)
    for level in np.unique(cell[:, 1]):
        bins = np.unique(cell[np.abs(cell[:, 1] - level) <= 1, 0])
        end = int(bins[np.argmax(np.append(np.diff(bins) > _GAP_BINS, True))]) + 1
        if bins[0] <= 1 and end * _ALONG_M >= least_m and np.count_nonzero(bins < end) > _SHEET_FILL * end:
            return end * _ALONG_M
    return None
