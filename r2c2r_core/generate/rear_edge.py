"""Rear edge of an appliance by change-point detection: depth beyond it lies on the wall, not on the face's continuation.

Colour does not separate a white microwave from a white wall, and points on its sides thin out where they are seen at a flat
angle. Each depth pixel whose ray crosses the plane of a face tells how far behind the crossing the surface is: zero where the
face continues, the remaining distance to the wall where it has ended. The edge is the change point of all frames together.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from r2c2r_core.arrays import Vector3
from r2c2r_core.generate.evidence import View
from r2c2r_core.geometry.camera import depth_points
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of rear-edge detection."""

    flattest: float = param(0.08, "cosine", "Minimum cosine between a ray and the face's normal for the ray to count")
    widest_m: float = param(0.08, "m", "Maximum distance of the edge from its initial estimate")
    before_m: float = param(0.05, "m", "Distance in front of the face beyond which a point belongs to an occluder")
    bin_m: float = param(0.01, "m", "Width of the bins along the face", gt=0)
    least: int = param(6, "count", "Minimum number of pixels per bin, and of a frame on either part of a face", ge=1)
    least_bins: int = param(8, "count", "Minimum number of bins with data")
    sure: float = param(0.7, "share", "Fraction of the depth up to which the face is known to exist")
    least_gap_m: float = param(0.015, "m", "Minimum gap between the rear edge and the surface behind it")
    clearer: float = param(0.5, "ratio", "Maximum misfit relative to that of a face without an end")


def rear_edge(low: Vector3, high: Vector3, views: Sequence[View], world_from_local: Rigid3) -> float:
    """Y of the rear edge of the box `low`..`high` (local frame): `high[1]`, clipped to the interval that depth allows."""
    params = tuned(Params)
    thought = float(high[1])
    bounds = []
    for axis, side in ((2, 1.0), (0, -1.0), (0, 1.0)):
        crossings, behind = [np.zeros(0)], [np.zeros(0)]
        for view in views:
            y, gap = _continued(low, high, view, world_from_local, axis, side, params.widest_m)
            known = y < low[1] + params.sure * (high[1] - low[1])
            if known.sum() < params.least or np.count_nonzero(~known) < params.least:
                continue
            crossings.append(y)
            behind.append(gap - np.median(gap[known]))  # the frame's own pose error
        found = _change_point(np.concatenate(crossings), np.concatenate(behind), thought, params.widest_m)
        if found is not None:
            bounds.append(found)
    if not bounds:
        return thought
    last, first = np.mean(bounds, axis=0)
    return float(np.clip(thought, last, first))


def _continued(
    low: Vector3, high: Vector3, view: View, world_from_local: Rigid3, axis: int, side: float, reach_m: float
) -> tuple[np.ndarray, np.ndarray]:
    """Crossing (y) of each pixel's ray with a face's plane, and the distance along y from there to the measured surface."""
    params = tuned(Params)
    eye = world_from_local.inverse.apply(view.eye_world)
    face = high[axis] if side > 0 else low[axis]
    if side * (eye[axis] - face) <= 0.05:
        return np.zeros(0), np.zeros(0)
    valid = view.depth_m > 0
    hit = (world_from_local.inverse @ view.world_from_camera).apply(depth_points(view.depth_m, view.depth_camera)[valid])
    ray = hit - eye
    steep = side * ray[:, axis] < -params.flattest * np.linalg.norm(ray, axis=1)
    share = (face - eye[axis]) / np.where(steep, ray[:, axis], -1.0 * side)
    crossing = eye + share[:, None] * ray
    other = 2 - axis
    margin = 0.1 * (high[other] - low[other])
    inside = steep & (crossing[:, other] > low[other] + margin) & (crossing[:, other] < high[other] - margin)
    inside &= (crossing[:, 1] > low[1] + 0.3 * (high[1] - low[1])) & (crossing[:, 1] < high[1] + reach_m)
    gap = (hit - crossing)[:, 1]
    inside &= (gap > -params.before_m) & (ray[:, 1] > 0)
    return crossing[inside, 1], gap[inside]


def _change_point(crossing: np.ndarray, behind: np.ndarray, thought: float, reach_m: float) -> tuple[float, float] | None:
    """The last y on the face and the first y on the wall; None where no edge shows.

    Bins of y are split by least absolute deviations. Between the two lie the pixels that a phone drops at an edge.
    """
    params = tuned(Params)
    index = np.floor(crossing / params.bin_m).astype(int)
    bins = np.array([k for k in np.unique(index) if np.count_nonzero(index == k) >= params.least])
    if len(bins) < params.least_bins:
        return None
    y = (bins + 0.5) * params.bin_m
    gap = np.array([np.median(behind[index == k]) for k in bins])
    walls = [float(np.median(gap[k:] + y[k:])) for k in range(1, len(bins) - 1)]  # upright wall: the gap shrinks as y grows
    misfits = [np.abs(gap[:k]).sum() + np.abs(gap[k:] + y[k:] - wall).sum() for k, wall in enumerate(walls, 1)]
    best = int(np.argmin(misfits)) + 1
    to_the_wall = walls[best - 1] - y[best] < params.least_gap_m  # the face ends where the wall begins
    if to_the_wall or misfits[best - 1] > params.clearer * np.abs(gap).sum() or abs(y[best] - thought) > reach_m:
        return None
    return float(y[best - 1]), float(y[best] - params.bin_m / 2)
