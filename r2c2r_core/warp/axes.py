"""A placed mesh turned front-outwards (paper eq. 11-14, mended).

Departures (method.md rows 19-21): gravity leaves four quarter turns instead of 24 signed permutations, and never a
reflection, which would mirror hinges and text. The front is the side the cameras saw, which the object frame already
says; distances to a symmetric box cannot tell front from back, so a handle found on the far side only is what may
overrule it.
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
    """How a placed mesh is turned front-outwards."""

    samples: int = param(6000, "count", "points drawn on the mesh", ge=100)
    believable_rad: float = param(
        float(np.deg2rad(12.0)),
        "rad",
        "largest turn that corrects a placement",
        source="a placement is not wrong by more; a larger turn means the mesh has no right angles",
    )
    stands_out_m: tuple[float, float] = param((0.008, 0.10), "m", "nearest and farthest that a handle stands out of a front")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CanonicalMesh:
    """Vertices along the object's axes (front towards -Y), centre arbitrary, and what a person should know."""

    vertices: Points
    turned_rad: float
    warnings: tuple[str, ...]


def face_outwards(
    vertices_world: Points, faces: Faces, world_from_object: Rigid3, *, has_handle: bool, seed: int = 0
) -> CanonicalMesh:
    """The mesh along the object's axes: its own right angles decide the exact yaw, the cameras' side which of four."""
    params = tuned(Params)
    vertices = world_from_object.inverse.apply(vertices_world)
    points, chosen = sample_surface(vertices, faces, params.samples, np.random.default_rng(seed))
    normals = face_normals(vertices, faces)[chosen]
    yaw = upright_box(points, normals, trim=0.005).yaw_rad
    correction = -((yaw + np.pi / 4) % (np.pi / 2) - np.pi / 4)
    warnings: list[str] = []
    if abs(correction) > params.believable_rad:
        warnings.append(f"the mesh stands {np.rad2deg(abs(correction)):.0f} deg off its object: its yaw was left as placed")
        correction = 0.0
    if has_handle and _handle_is_behind(points @ rotation_about_z(correction).T, normals @ rotation_about_z(correction).T):
        warnings.append("the mesh's handle was on the far side: the mesh was turned half round")
        correction += np.pi
    return CanonicalMesh(
        vertices=vertices @ rotation_about_z(correction).T, turned_rad=float(correction), warnings=tuple(warnings)
    )


def _handle_is_behind(points: Points, normals: Points) -> bool:
    """Whether something handle-like stands out of the back and nothing out of the front."""
    front, back = _standing_out(points, normals), _standing_out(points * [-1, -1, 1], normals * [-1, -1, 1])
    return bool(back > 0.004 and front < 0.0005)


def _standing_out(points: Points, normals: Points) -> float:
    """Share of the surface in front of the large flat that looks towards -y; 0 when too much of it for a handle."""
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
