"""Front plane of a mesh, for every stage: the foremost flat layer that spans it.

A handle spans little of a front; the recessed panel of a shaker door lies behind its frame, which is the outer face even where
it is the smaller part. Dimensions and the box of an object begin at this plane.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from r2c2r_core.arrays import Points, Vector3
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the front plane."""

    looks: float = param(
        0.7, "cosine", "Minimum cosine to the front's direction for a face to be forward-facing: within 45 degrees"
    )
    layer_m: float = param(
        0.003, "m", "Half the thickness of a layer", source="evenness of a plane fused from a phone's depth", gt=0
    )
    step_m: float = param(0.002, "m", "Step between candidate layers", gt=0)
    spans: float = param(0.8, "share", "Minimum extent of a front face relative to the forward surface's width and height")
    least_share: float = param(0.03, "share", "Minimum fraction of the forward surface in a layer: less is specks")
    least_points: int = param(60, "count", "Minimum number of forward-facing points for a front plane")
    trim: float = param(0.005, "share", "Fraction of the points ignored at either end when extents are compared", ge=0, lt=0.5)
    agree_rad: tuple[float, float, float] = param(
        (float(np.deg2rad(20.0)), float(np.deg2rad(8.0)), float(np.deg2rad(3.0))),
        "rad",
        "Half angles of the successively narrower cones about the mean normal",
    )


class FrontPlane(NamedTuple):
    """The plane of a front, in the frame of the points it was found in."""

    outward: Vector3
    offset_m: float  # outward @ x of its points
    middle: Vector3  # the mean of its points

    def holds(self, points: Points) -> np.ndarray:
        """Mask of the points that lie on it."""
        params = tuned(Params)
        return np.asarray(np.abs(points @ self.outward - self.offset_m) < params.layer_m)


def front_plane(points: Points, normals: Points) -> FrontPlane | None:
    """The front plane of surface samples (metres) whose front faces about -Y; None with too few of them.

    Where no layer spans the front, as on a bowed one, it is the one with most points.
    """
    params = tuned(Params)
    forwards = normals[:, 1] < -params.looks
    if np.count_nonzero(forwards) < params.least_points:
        return None
    looking = points[forwards]
    normal = _common_direction(normals[forwards])
    return _refined(looking, normal, _foremost_layer(looking, normal))


def front_y(points: Points, normals: Points) -> float:
    """Position of the front face along y; without a forward-facing plane, the foremost points."""
    params = tuned(Params)
    plane = front_plane(points, normals)
    return float(np.quantile(points[:, 1], params.trim)) if plane is None else float(plane.middle[1])


def _common_direction(normals: Points) -> Vector3:
    """Robust mean of the normals: median direction with outliers removed in three passes."""
    params = tuned(Params)
    kept = normals
    for cosine in np.cos(params.agree_rad):
        middle = np.median(kept, axis=0)
        near = kept[kept @ (middle / np.linalg.norm(middle)) > cosine]
        kept = near if len(near) >= params.least_points else kept
    mean = kept.mean(axis=0)
    return np.asarray(mean / np.linalg.norm(mean))


def _foremost_layer(points: Points, normal: Vector3) -> float:
    """Offset along the normal of the foremost layer that spans the points; of the fullest if none does."""
    params = tuned(Params)
    offsets = points @ normal
    across = np.array([[normal[1], 0.0], [-normal[0], 0.0], [0.0, 1.0]])  # level, and up
    flat = points @ across
    whole = _extent(flat)
    fullest, most = float(np.median(offsets)), 0
    for offset in np.arange(offsets.max(), offsets.min() - params.step_m, -params.step_m):
        layer = np.abs(offsets - offset) < params.layer_m
        count = int(np.count_nonzero(layer))
        if count < params.least_share * len(points):
            continue
        if (_extent(flat[layer]) >= params.spans * whole).all():
            return _densest(offsets, float(offset))
        if count > most:
            fullest, most = float(offset), count
    return fullest


def _extent(flat: np.ndarray) -> np.ndarray:
    """Width and height of points in a plane, without outliers."""
    params = tuned(Params)
    return np.asarray(np.ptp(np.quantile(flat, [params.trim, 1 - params.trim], axis=0), axis=0))


def _densest(offsets: np.ndarray, offset: float) -> float:
    """Offset of the densest layer within a layer's thickness behind the first one found."""
    params = tuned(Params)
    near = offsets[(offsets <= offset + params.layer_m) & (offsets > offset - 2 * params.layer_m)]
    tried = np.arange(offset + params.layer_m, offset - 2 * params.layer_m, -params.step_m / 2)
    return float(max(tried, key=lambda at: int(np.count_nonzero(np.abs(near - at) < params.layer_m))))


def _refined(points: Points, normal: Vector3, offset: float) -> FrontPlane:
    """Least-squares plane of the layer's points, iterated three times."""
    params = tuned(Params)
    middle = normal * offset
    for _ in range(3):
        inliers = points[np.abs(points @ normal - offset) < params.layer_m]
        middle = inliers.mean(axis=0)
        away = inliers - middle
        thinnest = np.linalg.eigh(away.T @ away)[1][:, 0]
        normal = thinnest if thinnest[1] < 0 else -thinnest
        offset = float(normal @ middle)
    return FrontPlane(normal, offset, middle)
