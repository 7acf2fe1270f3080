"""Symmetries that complete the unobserved part of an object: revolution about an axis, or a left-right mirror."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from r2c2r_core.arrays import Points
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of solids of revolution."""

    slices: int = param(8, "count", "Number of height slices", ge=2)
    largest_radius_m: float = param(0.25, "m", "Maximum radius of a solid of revolution")
    least_points: int = param(150, "count", "Minimum number of points for the fit")


class Revolution(NamedTuple):
    """A vertical axis and the radius at equally spaced heights; local frame, metres."""

    centre: np.ndarray  # (x, y)
    heights_m: np.ndarray
    radii_m: np.ndarray

    def signed_distance(self, points: Points) -> np.ndarray:
        """Horizontal distance outside the body (negative inside)."""
        radius = np.interp(points[:, 2], self.heights_m, self.radii_m)
        return np.asarray(np.hypot(points[:, 0] - self.centre[0], points[:, 1] - self.centre[1]) - radius)


def fit_revolution(points: Points) -> Revolution | None:
    """Solid of revolution about a vertical axis through the points; None with few points or for a wide object.

    Each slice of height is a circle about one common centre: linear least squares in the centre and the slices' terms r^2 -
    |c|^2.
    """
    params = tuned(Params)
    if len(points) < params.least_points:
        return None
    low, high = np.percentile(points[:, 2], [1, 99])
    slice_index = np.clip(((points[:, 2] - low) / max(high - low, 1e-6) * params.slices).astype(int), 0, params.slices - 1)
    body = (points[:, 2] < low + 0.93 * (high - low)) & (points[:, 2] > low)  # the lid is a disc, not a wall
    xy, member = points[body][:, :2], slice_index[body]
    origin = xy.mean(axis=0)
    system = np.zeros((len(xy), 2 + params.slices))
    system[:, :2] = 2 * (xy - origin)
    system[np.arange(len(xy)), 2 + member] = 1.0
    target = ((xy - origin) ** 2).sum(axis=1)
    solution = np.linalg.lstsq(system, target, rcond=None)[0]
    centre = origin + solution[:2]
    distance = np.hypot(*(xy - centre).T)
    filled = np.array([np.count_nonzero(member == k) >= 10 for k in range(params.slices)])
    if not filled.any():
        return None
    median = np.array([np.median(distance[member == k]) if filled[k] else np.nan for k in range(params.slices)])
    middles = low + (np.arange(params.slices) + 0.5) / params.slices * (high - low)
    radii = np.interp(middles, middles[filled], median[filled])
    if radii.max() > params.largest_radius_m:
        return None
    return Revolution(centre, middles, radii)


def is_rounder_than_box(points: Points, revolution: Revolution) -> bool:
    """Whether the points are nearer to the solid of revolution than to the rectangle around each height slice."""
    params = tuned(Params)
    low, high = np.percentile(points[:, 2], [1, 99])
    member = np.clip(((points[:, 2] - low) / max(high - low, 1e-6) * params.slices).astype(int), 0, params.slices - 1)
    off_circle = float(np.median(np.abs(revolution.signed_distance(points))))
    return off_circle < min(0.8 * _off_rectangle(points[:, :2], member), 0.2 * float(revolution.radii_m.max()))


def best_mirror(occupied: np.ndarray, seen: np.ndarray, free: np.ndarray) -> int | None:
    """The horizontal axis (0 or 1) about whose middle the observed voxels agree best with their twins; None if neither does.

    `seen` marks voxels whose state is known, `free` those known to be empty; `occupied` is the solid they bound.
    """
    best, best_agreement = None, 0.8
    for axis in (0, 1):
        twin_seen, twin_free = np.flip(seen, axis), np.flip(free, axis)
        both = seen & twin_seen & (occupied | np.flip(occupied, axis) | free | twin_free)
        either_solid = both & (~free | ~twin_free)
        if either_solid.sum() < 0.05 * seen.sum():
            continue
        agreement = float((free == twin_free)[either_solid].mean())
        if agreement > best_agreement:
            best, best_agreement = axis, agreement
    return best


def _off_rectangle(xy: np.ndarray, member: np.ndarray) -> float:
    """Median distance of the points to the rectangle (own axes) around their slice."""
    params = tuned(Params)
    distances = []
    for k in range(params.slices):
        chosen = xy[member == k]
        if len(chosen) < 10:
            continue
        low, high = np.percentile(chosen, 3, axis=0), np.percentile(chosen, 97, axis=0)
        distances.append(np.minimum(np.abs(chosen - low), np.abs(chosen - high)).min(axis=1))
    return float(np.median(np.concatenate(distances))) if distances else 0.0
