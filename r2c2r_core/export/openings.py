"""Whether a hollow thing is hollow to an engine: a mug whose collider is one hull holds nothing."""

from typing import Any

import numpy as np
from scipy.spatial import ConvexHull

from r2c2r_core.arrays import Faces, Points
from r2c2r_core.export.reading import UrdfLink
from r2c2r_core.export.rules.files import BundleFiles

NEEDED_OPENING = 0.9

_STEPS = 24  # of the grid, along the longest side
_ROUND = 8  # horizontal directions looked into from a point
_LEAST_SHARE = 0.03  # of the bounding box: a smaller hollow is a dent


def opening_free(link: UrdfLink, files: BundleFiles) -> float | None:
    """Share (0..1) of the hollow of a link's visual that none of its colliders fills; None where it has no hollow.

    A point belongs to the hollow when it lies outside the solid, open upwards, with solid below it and all round it:
    where a liquid would stay.
    """
    visual = next((files.mesh(s.mesh) for s in link.shapes if s.kind == "visual" and s.mesh is not None), None)
    if visual is None:
        return None
    hollow = _hollow(visual.vertices, visual.faces)
    if hollow is None:
        return None
    filled = np.zeros(len(hollow), dtype=bool)
    for shape in link.shapes:
        if shape.kind == "collision":
            filled |= _inside(hollow, shape.link_from_shape.apply(_corners(shape.box_m, shape.mesh, files)))
    return float(1.0 - filled.mean())


def _hollow(vertices: Points, faces: Faces) -> Points | None:
    """Grid points of the hollow, or None when they fill too little of the bounding box."""
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    step = float((high - low).max()) / _STEPS
    ranges = [np.arange(a + step / 2, b, step) for a, b in zip(low, high, strict=True)]
    points = np.stack(np.meshgrid(*ranges, indexing="ij"), axis=-1).reshape(-1, 3)
    if not len(points):
        return None
    surface = _castable(vertices, faces)
    angles = 2 * np.pi * np.arange(_ROUND) / _ROUND
    walls = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(_ROUND)])
    kept = points[~_hits(surface, points, np.array([0.0, 0.0, 1.0])) & _hits(surface, points, np.array([0.0, 0.0, -1.0]))]
    for direction in walls:
        kept = kept[_hits(surface, kept, direction)]
    return kept if len(kept) > _LEAST_SHARE * len(points) else None


def _castable(vertices: Points, faces: Faces) -> Any:
    import open3d as o3d

    surface = o3d.t.geometry.RaycastingScene(nthreads=1)
    surface.add_triangles(
        o3d.core.Tensor.from_numpy(vertices.astype(np.float32)), o3d.core.Tensor.from_numpy(faces.astype(np.uint32))
    )
    return surface


def _hits(surface: Any, points: Points, direction: np.ndarray) -> np.ndarray:
    """Whether a ray from each point meets the surface; a point inside the solid always meets it upwards."""
    import open3d as o3d

    if not len(points):
        return np.zeros(0, dtype=bool)
    rays = np.column_stack([points, np.broadcast_to(direction, points.shape)]).astype(np.float32)
    return np.isfinite(surface.cast_rays(o3d.core.Tensor.from_numpy(rays), nthreads=1)["t_hit"].numpy())


def _corners(box_m: np.ndarray | None, mesh: str | None, files: BundleFiles) -> Points:
    if box_m is not None:
        return np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]) * box_m
    found = files.mesh(mesh) if mesh is not None else None
    return found.vertices if found is not None else np.zeros((0, 3))


def _inside(points: Points, corners: Points) -> np.ndarray:
    if len(corners) < 4:
        return np.zeros(len(points), dtype=bool)
    planes = ConvexHull(corners, qhull_options="QJ").equations
    return np.asarray((points @ planes[:, :3].T + planes[:, 3] < 0).all(axis=1))
