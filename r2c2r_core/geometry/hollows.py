"""Cavity of a mug or a bowl: the space in which a liquid would stay."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from r2c2r_core.arrays import Faces, Points
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of vessel cavities."""

    steps: int = param(24, "count", "Number of grid cells along the longest side", ge=4)
    round: int = param(8, "count", "Number of horizontal rays cast from a point", ge=3)
    least_share: float = param(
        0.03, "share", "Minimum fraction of the bounding box that a cavity fills: a smaller one is a dent"
    )


class Hollow(NamedTuple):
    """Free space inside an object that opens upwards."""

    points: Points  # (n, 3), of a grid
    floor_z: float  # lower quartile of the solid's height below the cavity


def find_hollow(vertices: Points, faces: Faces) -> Hollow | None:
    """The cavity of a closed mesh, +Z up; None without one, or with only a dent.

    A point belongs to the cavity when it lies outside the solid, open upwards, with solid below it and all around it.
    """
    params = tuned(Params)
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    step = max(float((high - low).max()) / params.steps, 1e-6)
    ranges = [np.arange(a + step / 2, b, step) for a, b in zip(low, high, strict=True)]
    points = np.stack(np.meshgrid(*ranges, indexing="ij"), axis=-1).reshape(-1, 3)
    if not len(points):
        return None
    surface = _castable(vertices, faces)
    angles = 2 * np.pi * np.arange(params.round) / params.round
    walls = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(params.round)])
    down = np.array([0.0, 0.0, -1.0])
    kept = points[np.isinf(_distances(surface, points, -down)) & np.isfinite(_distances(surface, points, down))]
    for direction in walls:
        kept = kept[np.isfinite(_distances(surface, kept, direction))]
    if len(kept) <= params.least_share * len(points):
        return None
    return Hollow(kept, float(np.quantile(kept[:, 2] - _distances(surface, kept, down), 0.25)))


def _castable(vertices: Points, faces: Faces) -> Any:
    import open3d as o3d

    surface = o3d.t.geometry.RaycastingScene(nthreads=1)
    surface.add_triangles(
        o3d.core.Tensor.from_numpy(np.ascontiguousarray(vertices, dtype=np.float32)),
        o3d.core.Tensor.from_numpy(np.ascontiguousarray(faces, dtype=np.uint32)),
    )
    return surface


def _distances(surface: Any, points: Points, direction: np.ndarray) -> np.ndarray:
    """Ray distance from each point to the surface; inf without a hit (never upwards from inside the solid)."""
    import open3d as o3d

    if not len(points):
        return np.zeros(0)
    rays = np.column_stack([points, np.broadcast_to(direction, points.shape)]).astype(np.float32)
    return np.asarray(surface.cast_rays(o3d.core.Tensor.from_numpy(rays), nthreads=1)["t_hit"].numpy(), dtype=np.float64)
