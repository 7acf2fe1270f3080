"""Rendering of a candidate from all directions, for keypoint matching with the photos (paper §4.3)."""

from dataclasses import dataclass

import numpy as np

from r2c2r_core.arrays import DepthMetres, Image, Points
from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.raster import render_textured
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.mesh import TexturedMesh


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MeshView:
    """One rendered image of the mesh; `depth` in units of the normalised mesh."""

    image: Image
    depth: DepthMetres
    camera: Intrinsics
    camera_from_mesh: Rigid3  # of the normalised mesh


def render_views(mesh: TexturedMesh, *, count: int, size_px: int) -> tuple[tuple[MeshView, ...], Points, float]:
    """`count` views from a sphere of directions, and the centre and scale that normalise the mesh to unit radius.

    Fibonacci sphere and 40 degree lens as in the authors' code; their distance of 2.7 unit-cube sides becomes 3.2 radii.
    """
    centre = (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0)) / 2
    radius = float(np.linalg.norm(mesh.vertices - centre, axis=1).max()) or 1.0
    normalised = (mesh.vertices - centre) / radius
    focal = 0.5 * size_px / np.tan(np.radians(20))
    camera = Intrinsics(fx=focal, fy=focal, cx=size_px / 2, cy=size_px / 2, width=size_px, height=size_px)
    views = []
    for direction in fibonacci_sphere(count):
        pose = look_from(direction * 3.2)
        image, depth = render_textured(normalised, mesh.faces, mesh.uv, mesh.texture, camera, pose)
        image[depth == 0] = 128  # a black background would attract keypoints along every outline
        views.append(MeshView(image=image, depth=depth, camera=camera, camera_from_mesh=pose))
    return tuple(views), centre, radius


def fibonacci_sphere(count: int) -> Points:
    """Evenly spread unit directions."""
    k = np.arange(count) + 0.5
    z = 1.0 - 2.0 * k / count
    angle = np.pi * (1.0 + np.sqrt(5.0)) * k
    ring = np.sqrt(1.0 - z * z)
    return np.stack([ring * np.cos(angle), ring * np.sin(angle), z], axis=1)


def look_from(eye: np.ndarray) -> Rigid3:
    """camera_from_world of a camera at `eye` that looks at the origin."""
    forward = -eye / np.linalg.norm(eye)
    helper = np.array([0.0, 0.0, 1.0]) if abs(forward[2]) < 0.95 else np.array([1.0, 0.0, 0.0])
    right = np.cross(forward, helper)
    right /= np.linalg.norm(right)
    rotation = np.stack([right, np.cross(forward, right), forward])
    return Rigid3(rotation, -rotation @ eye)
