"""Lifting of matched pixels to 3D points: photo keypoints to the world, render keypoints to the mesh (paper eq. 1)."""

from typing import NamedTuple

import numpy as np

from r2c2r_core.align.render import MeshView
from r2c2r_core.arrays import DepthMetres, Pixels, Points
from r2c2r_core.geometry.camera import sample_nearest, unproject


class Lifted(NamedTuple):
    """Correspondences of one photo with the rendered views."""

    frame_index: int
    points_mesh: Points
    points_world: Points
    noise_m: np.ndarray  # standard deviation of the world point along its ray, from depth noise
    rays: Points  # unit, from the camera to the world point
    pixel_m: np.ndarray  # width of one pixel of the photo at the world point


def depth_at(uv_px: Pixels, depth_m: DepthMetres) -> np.ndarray:
    """Depth of the pixel that contains uv, 0 where unknown or where its neighbours differ by more than 6 %."""
    value, inside = sample_nearest(depth_m, uv_px)
    steady = inside & (value > 0)
    for step in ((1.5, 0.0), (-1.5, 0.0), (0.0, 1.5), (0.0, -1.5)):
        near, near_inside = sample_nearest(depth_m, uv_px + np.array(step))
        steady &= near_inside & (np.abs(near - value) < 0.06 * value)
    return np.where(steady, value, 0.0).astype(np.float64)


def lift_render(view: MeshView, uv_px: Pixels, centre: np.ndarray, radius: float) -> tuple[Points, np.ndarray]:
    """Mesh-frame points of render pixels, and a mask of those that hit the surface.

    Eq. 1 with separate fx and fy and the true principal point (method.md row 8).
    """
    depth = depth_at(uv_px, view.depth)
    points = view.camera_from_mesh.inverse.apply(unproject(uv_px, depth, view.camera))
    return points * radius + centre, depth > 0
