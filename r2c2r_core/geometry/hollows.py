"""The hollow of a mug or a bowl: where a liquid would stay."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from r2c2r_core.arrays import Faces, Points
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """What counts as the hollow of a vessel."""

    steps: int = param(24, "count", "of the grid along the longest side", ge=4)
    round: int = param(8, "count", "horizontal directions looked into from a point", ge=3)
    least_share: float = param(0.03, "share", "of the bounding box: a smaller hollow is a dent")


class Hollow(NamedTuple):
    """What is free inside a thing that opens upwards."""

    points: Points  # (n, 3), of a grid
    floor_z: float  # of the solid below, where it is low: a quarter of it lies lower


def find_hollow(vertices: Points, faces: Faces) -> Hollow | None:
    """The hollow of a closed mesh, +Z up; None where it has none, or only a dent.

    A point belongs to the hollow when it lies outside the solid, open upwards, with solid below it and all round it.
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
    """How far the surface is from each point; inf where a ray misses it, as none upwards from inside the solid does."""
    import open3d as o3d

    if not len(points):
        return np.zeros(0)
    rays = np.column_stack([points, np.broadcast_to(direction, points.shape)]).astype(np.float32)
    return np.asarray(surface.cast_rays(o3d.core.Tensor.from_numpy(rays), nthreads=1)["t_hit"].numpy(), dtype=np.float64)
