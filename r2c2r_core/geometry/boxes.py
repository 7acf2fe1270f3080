"""Bounding boxes: upright box of a shape, smallest rectangle of planar points, corners, and penetration of boxes."""

from typing import NamedTuple

import numpy as np

from r2c2r_core.arrays import Points, Vector2, Vector3
from r2c2r_core.geometry.transforms import Rigid3, rotation_about_z


class UprightBox(NamedTuple):
    """A box with vertical sides; `world_from_box` has its origin at the centre and turns about +Z by `yaw_rad` in [0, pi/2)."""

    world_from_box: Rigid3
    size_m: Vector3
    yaw_rad: float


class Rectangle(NamedTuple):
    """A rectangle in the plane: corners are centre +- size/2 along the columns of `axes`."""

    centre: Vector2
    axes: np.ndarray  # (2, 2), columns are unit directions, right-handed
    size: Vector2


class Boxes(NamedTuple):
    """n boxes in one frame: centres (n, 3), axes (n, 3, 3) as columns, half sizes (n, 3)."""

    centres: np.ndarray
    axes: np.ndarray
    halves: np.ndarray


def upright_box(points: Points, normals: Points | None = None, *, trim: float = 0.0) -> UprightBox:
    """The upright box of smallest plan area (paper eq. 8-10 with gravity known: rotating calipers in plan, exact).

    `trim` drops that fraction of the points at either end of each axis, so that a handle or a spike does not count. With
    surface normals, the yaw of their right angles is used when its box is within 1 % of the smallest: it is two to three times
    more stable on noisy meshes (stack.md section 5).
    """
    plan = points[:, :2]
    yaws = _hull_edge_yaws(plan)
    best = min(yaws, key=lambda yaw: _trimmed_area(plan, yaw, trim))
    if normals is not None:
        manhattan = right_angle_yaw(normals)
        if _trimmed_area(plan, manhattan, trim) <= 1.01 * _trimmed_area(plan, best, trim):
            best = manhattan
    return box_at_yaw(points, best, trim=trim)


def box_at_yaw(points: Points, yaw_rad: float, *, trim: float = 0.0) -> UprightBox:
    """The upright box of points for a given yaw."""
    rotation = rotation_about_z(yaw_rad)
    low, high = _trimmed_range(points @ rotation, trim)
    return UprightBox(Rigid3(rotation, rotation @ ((low + high) / 2)), high - low, yaw_rad)


def right_angle_yaw(normals: Points) -> float:
    """Yaw in [0, pi/2) of the normals modulo quarter turns, weighted by their horizontal part."""
    angle, weight = np.arctan2(normals[:, 1], normals[:, 0]), np.hypot(normals[:, 0], normals[:, 1]) ** 2
    return float(np.arctan2((weight * np.sin(4 * angle)).sum(), (weight * np.cos(4 * angle)).sum()) / 4 % (np.pi / 2))


def smallest_rectangle(points: np.ndarray) -> Rectangle:
    """The rectangle of least area around points (n, 2): one side lies on an edge of their hull (Freeman & Shapira 1975)."""
    hull = _hull(points)
    yaws = np.array(_hull_edge_yaws(hull))
    along = np.column_stack([np.cos(yaws), np.sin(yaws)]) @ hull.T  # (edges, corners)
    across = np.column_stack([-np.sin(yaws), np.cos(yaws)]) @ hull.T
    best = int(np.argmin(np.ptp(along, axis=1) * np.ptp(across, axis=1)))
    axes = rotation_about_z(float(yaws[best]))[:2, :2]
    low, high = (hull @ axes).min(axis=0), (hull @ axes).max(axis=0)
    return Rectangle(axes @ ((low + high) / 2), axes, high - low)


def box_corners(size_m: Vector3) -> Points:
    """The eight corners (8, 3) of a box centred at the origin."""
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=np.float64)
    return signs * np.asarray(size_m) / 2


def box_penetration(a: Boxes, b: Boxes) -> np.ndarray:
    """Penetration depth (n,) of pairs a[i], b[i] (separating axes, Gottschalk 1996); negative for disjoint boxes.

    A negative value is minus the largest gap along one of the 15 axes: a lower bound of the distance.
    """
    faces = np.concatenate([np.swapaxes(a.axes, 1, 2), np.swapaxes(b.axes, 1, 2)], axis=1)
    edges = np.cross(np.swapaxes(a.axes, 1, 2)[:, :, None], np.swapaxes(b.axes, 1, 2)[:, None]).reshape(-1, 9, 3)
    lengths = np.linalg.norm(edges, axis=2, keepdims=True)
    parallel = lengths[..., 0] < 1e-6
    directions = np.concatenate([faces, edges / np.where(lengths < 1e-6, 1.0, lengths)], axis=1)
    apart = np.abs(np.einsum("nkd,nd->nk", directions, b.centres - a.centres))
    reach_a = np.einsum("nkj,nj->nk", np.abs(directions @ a.axes), a.halves)
    reach_b = np.einsum("nkj,nj->nk", np.abs(directions @ b.axes), b.halves)
    overlap = reach_a + reach_b - apart
    overlap[:, 6:][parallel] = np.inf
    return np.asarray(overlap.min(axis=1))


def _trimmed_range(values: np.ndarray, trim: float) -> tuple[np.ndarray, np.ndarray]:
    """Low and high end of each column, without the outermost fraction `trim` of its values."""
    if trim <= 0:
        return values.min(axis=0), values.max(axis=0)
    low, high = np.quantile(values, [trim, 1 - trim], axis=0)
    return low, high


def _trimmed_area(plan: np.ndarray, yaw_rad: float, trim: float) -> float:
    low, high = _trimmed_range(plan @ rotation_about_z(yaw_rad)[:2, :2], trim)
    return float((high - low).prod())


def _hull(points: np.ndarray) -> np.ndarray:
    """Hull corners (k, 2) in order; the points themselves where they lie on a line."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        return np.asarray(points[ConvexHull(points).vertices])
    except QhullError:
        return points


def _hull_edge_yaws(points: np.ndarray) -> list[float]:
    """Directions of the hull's edges, in [0, pi/2), at most 360 of them."""
    hull = _hull(points)
    edges = np.roll(hull, -1, axis=0) - hull
    edges = edges[np.linalg.norm(edges, axis=1) > 0]
    if len(edges) == 0:
        return [0.0]
    longest_first = edges[np.argsort(-np.linalg.norm(edges, axis=1))][:360]
    return [float(yaw) for yaw in np.arctan2(longest_first[:, 1], longest_first[:, 0]) % (np.pi / 2)]
