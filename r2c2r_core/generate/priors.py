"""How deep furniture is when nobody sees it: the wall behind, else what its category usually measures."""

from typing import NamedTuple

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

_DEFAULT_DEPTH_M = 0.5
_WALL_RANGE = (0.75, 1.35)  # of the category's depth: a wall outside is another room's, or the front of the next run
_WALL_GAP_M = 0.005


class DepthBehind(NamedTuple):
    """How far a front reaches back, and how that is known."""

    depth_m: float
    source: str  # "wall" or "category"


def category_depth(category: str) -> float:
    """The usual depth of a category, metres."""
    key = category.strip().lower().replace("-", "_").replace(" ", "_")
    if key in CATEGORY_DEPTH_M:
        return CATEGORY_DEPTH_M[key]
    return next((depth for name, depth in CATEGORY_DEPTH_M.items() if name in key), _DEFAULT_DEPTH_M)


def depth_behind(capture: Capture, world_from_front: Rigid3, width_m: float, height_m: float, category: str) -> DepthBehind:
    """Depth from a front to the wall behind it where one stands at a plausible distance, else the category's depth."""
    usual = category_depth(category)
    distances = [*_wall_distances(capture, world_from_front), *_surface_distances(capture, world_from_front, width_m, height_m)]
    plausible = [d for d in distances if _WALL_RANGE[0] * usual <= d <= _WALL_RANGE[1] * usual]
    if plausible:
        return DepthBehind(min(plausible, key=lambda d: abs(d - usual)) - _WALL_GAP_M, "wall")
    return DepthBehind(usual, "category")


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
