"""Canonical orientation of a placed mesh, front outwards (paper eq. 11-14, corrected).

Departures (method.md rows 19-21): gravity leaves four quarter turns instead of 24 signed permutations, and never a reflection,
which would mirror hinges and text. The front is the side the cameras saw, which the object frame already gives; distances to a
symmetric box cannot distinguish front from back, so only a handle found on the far side overrules it.
"""

from dataclasses import dataclass

import numpy as np

from r2c2r_core.arrays import Faces, Points
from r2c2r_core.geometry.boxes import upright_box
from r2c2r_core.geometry.meshes import face_normals, sample_surface
from r2c2r_core.geometry.transforms import Rigid3, rotation_about_z
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of canonical orientation."""

    samples: int = param(6000, "count", "Number of points sampled on the mesh", ge=100)
    believable_rad: float = param(
        float(np.deg2rad(12.0)),
        "rad",
        "Maximum rotation that corrects a placement",
        source="a placement's error is smaller; a larger rotation means the mesh has no right angles",
    )
    stands_out_m: tuple[float, float] = param((0.008, 0.10), "m", "Minimum and maximum protrusion of a handle")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CanonicalMesh:
    """Vertices along the object's axes (front towards -Y), centre arbitrary, with warnings for a person."""

    vertices: Points
    warnings: tuple[str, ...]


def face_outwards(
    vertices_world: Points, faces: Faces, world_from_object: Rigid3, *, has_handle: bool, seed: int = 0
) -> CanonicalMesh:
    """The mesh along the object's axes: its own right angles determine the exact yaw, the cameras' side which of four."""
    params = tuned(Params)
    vertices = world_from_object.inverse.apply(vertices_world)
    points, chosen = sample_surface(vertices, faces, params.samples, np.random.default_rng(seed))
    normals = face_normals(vertices, faces)[chosen]
    yaw = upright_box(points, normals, trim=0.005).yaw_rad
    correction = -((yaw + np.pi / 4) % (np.pi / 2) - np.pi / 4)
    warnings: list[str] = []
    if abs(correction) > params.believable_rad:
        warnings.append(f"the mesh stands {np.rad2deg(abs(correction)):.0f}° off its object: its yaw was not changed")
        correction = 0.0
    if has_handle and _handle_is_behind(points @ rotation_about_z(correction).T, normals @ rotation_about_z(correction).T):
        warnings.append("the mesh's handle was on the far side: the mesh was turned by 180°")
        correction += np.pi
    return CanonicalMesh(vertices=vertices @ rotation_about_z(correction).T, warnings=tuple(warnings))


def _handle_is_behind(points: Points, normals: Points) -> bool:
    """Whether a handle-like part protrudes from the back and none from the front."""
    front, back = _standing_out(points, normals), _standing_out(points * [-1, -1, 1], normals * [-1, -1, 1])
    return bool(back > 0.004 and front < 0.0005)


def _standing_out(points: Points, normals: Points) -> float:
    """Fraction of the surface in front of the large plane that faces -y; 0 when it is too large for a handle."""
    params = tuned(Params)
    looking = normals[:, 1] < -0.8
    if looking.sum() < 20:
        return 0.0
    y = points[looking, 1]
    counts, edges = np.histogram(y, bins=np.arange(y.min() - 0.003, y.max() + 0.009, 0.006))
    flat = edges[int(np.flatnonzero(counts >= 0.4 * counts.max())[0])]
    out = flat - points[:, 1]
    share = float(((out > params.stands_out_m[0]) & (out < params.stands_out_m[1])).mean())
    return share if share < 0.3 else 0.0
