"""Picking in the 3D view: the first face on a ray, or the scan's nearest point to it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from r2c2r_core.arrays import Points, Vector3

_FLAT = 1e-12  # m3: a face parallel to the ray
_NEAR = 0.01  # maximum distance of a scan point from the ray, as a fraction of its distance


@dataclass(frozen=True, slots=True)
class Picked:
    """The last pick, numbered."""

    number: int = 0
    name: str = ""  # of the object; empty without one
    point: list[float] | None = None  # in the world


class Hit(NamedTuple):
    """First intersection of a ray."""

    name: str  # of the object
    point_world: Vector3
    distance_m: float


def first_of(meshes: Sequence[tuple[str, Points, np.ndarray]], origin: Vector3, direction: Vector3) -> Hit | None:
    """The first intersection of a ray with named meshes."""
    found = [
        Hit(name, origin + distance * direction, distance)
        for name, vertices, faces in meshes
        if (distance := first_face(origin, direction, vertices, faces)) is not None
    ]
    return min(found, key=lambda hit: hit.distance_m, default=None)


def nearest_point(points: Points, origin: Vector3, direction: Vector3) -> Hit | None:
    """The first point of the scan near a ray, without an object."""
    along = (points - origin) @ direction
    beside = np.linalg.norm(points - origin - along[:, None] * direction, axis=1)
    near = (along > 0) & (beside < _NEAR * along)
    if not near.any():
        return None
    first = int(np.flatnonzero(near)[along[near].argmin()])
    return Hit("", points[first], float(along[first]))


def first_face(origin: Vector3, direction: Vector3, vertices: Points, faces: np.ndarray) -> float | None:
    """Distance of the first face on a ray in lengths of `direction`, or None (Moeller, Trumbore 1997)."""
    if not len(faces):
        return None
    first, second, third = (vertices[faces[:, corner]] for corner in range(3))
    edge_1, edge_2 = second - first, third - first
    across = np.cross(direction, edge_2)
    volume = (edge_1 * across).sum(axis=1)
    crossed = np.abs(volume) > _FLAT
    first, edge_1, edge_2, across, volume = (part[crossed] for part in (first, edge_1, edge_2, across, volume))
    from_first = origin - first
    u = (from_first * across).sum(axis=1) / volume
    turned = np.cross(from_first, edge_1)
    v = turned @ direction / volume
    distance = (edge_2 * turned).sum(axis=1) / volume
    met = (u >= 0) & (v >= 0) & (u + v <= 1) & (distance > 0)
    return float(distance[met].min()) if met.any() else None
