"""Smallest bounding box of any orientation: by the hull's faces, and by the paper's Powell search."""

from typing import Any, NamedTuple

import numpy as np

from r2c2r_core.arrays import Matrix3, Points, Vector3
from r2c2r_core.geometry.boxes import smallest_rectangle
from r2c2r_core.geometry.transforms import Rigid3, nearest_rotation

_SAME_NORMAL = 1e-4  # of unit vectors: closer normals belong to triangles of one face


class FreeBox(NamedTuple):
    """A box of any orientation; the origin of its frame is its centre."""

    world_from_box: Rigid3
    size_m: Vector3

    @property
    def volume_m3(self) -> float:
        """Enclosed volume."""
        return float(np.prod(self.size_m))


def smallest_box(points: Points) -> FreeBox:
    """The box of least volume with one face on a face of the hull: exact in that face's plane (Freeman & Shapira 1975).

    Replaces paper eq. 8-9, whose search gets stuck (method.md row 17). Raises ValueError for coplanar points.
    """
    hull = _hull(points)
    corners = points[hull.vertices]
    best: FreeBox | None = None
    for normal in _distinct(hull.equations[:, :3]):
        found = _box_on(corners, normal)
        if best is None or found.volume_m3 < best.volume_m3:
            best = found
    assert best is not None  # a hull has faces
    return best


def powell_box(points: Points, *, starts: int = 1, rng: np.random.Generator | None = None) -> FreeBox:
    """The paper's box (eq. 8-9): Powell's method on three Euler angles, from zero and from random starts."""
    from scipy.optimize import minimize
    from scipy.spatial.transform import Rotation

    rng = rng if rng is not None else np.random.default_rng(0)
    corners = points[_hull(points).vertices]  # the same box, in a tenth of the time

    def volume(angles: np.ndarray) -> float:
        return float(np.ptp(corners @ Rotation.from_euler("xyz", angles).as_matrix(), axis=0).prod())

    first = [np.zeros(3), *(rng.uniform(0, 2 * np.pi, 3) for _ in range(starts - 1))]
    runs = [minimize(volume, start, method="Powell", bounds=[(0.0, 2 * np.pi)] * 3) for start in first]
    best = min(runs, key=lambda run: float(run.fun))
    return _box_along(corners, Rotation.from_euler("xyz", best.x).as_matrix())


def _hull(points: Points) -> Any:
    from scipy.spatial import ConvexHull, QhullError

    try:
        return ConvexHull(points)
    except QhullError as error:
        raise ValueError("points in one plane have no box with a volume") from error


def _box_on(corners: Points, normal: Vector3) -> FreeBox:
    """The smallest box with a face perpendicular to `normal`."""
    u = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    u /= np.linalg.norm(u)
    plane = np.column_stack([u, np.cross(normal, u)])
    axes = plane @ smallest_rectangle(corners @ plane).axes
    return _box_along(corners, nearest_rotation(np.column_stack([axes, normal])))


def _box_along(points: Points, rotation: Matrix3) -> FreeBox:
    low, high = (points @ rotation).min(axis=0), (points @ rotation).max(axis=0)
    return FreeBox(Rigid3(rotation, rotation @ ((low + high) / 2)), high - low)


def _distinct(normals: np.ndarray) -> np.ndarray:
    """Unique directions; opposite ones and the triangles of one face count once."""
    largest = np.take_along_axis(normals, np.abs(normals).argmax(axis=1)[:, None], axis=1)
    return np.asarray(np.unique(np.round(normals * np.sign(largest) / _SAME_NORMAL) * _SAME_NORMAL, axis=0))
