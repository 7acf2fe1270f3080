"""Height offset of a frame: the height at which its depth shows the support, minus the true one (vertical pose error)."""

from collections.abc import Sequence

import numpy as np

from r2c2r_core.arrays import Points, Vector3
from r2c2r_core.geometry.camera import project, unproject
from r2c2r_core.model.capture import Frame
from r2c2r_core.segment.scene import Scene

_POSE_ERROR_M = 0.04  # maximum height offset of a support between frames


def support_offset(scene: Scene, frame: Frame, support_z_m: float | None, centre: Vector3) -> float:
    """Height offset of one frame, metres: how much too high its depth shows the support around the object."""
    if support_z_m is None:
        return 0.0
    depth = scene.depth(frame.index)
    camera = frame.depth_camera
    local = frame.world_from_camera.inverse.apply(centre)
    if local[2] < 0.2:
        return 0.0
    u, v = project(local, camera)
    reach = 0.22 * camera.fx / local[2]
    rows = slice(int(np.clip(v - reach, 0, camera.height)), int(np.clip(v + reach, 0, camera.height)), 2)
    columns = slice(int(np.clip(u - reach, 0, camera.width)), int(np.clip(u + reach, 0, camera.width)), 2)
    patch = depth[rows, columns]
    if not (patch > 0).any():
        return 0.0
    row, column = np.nonzero(patch > 0)
    uv = np.stack([columns.start + 2 * column + 0.5, rows.start + 2 * row + 0.5], axis=1)
    heights = frame.world_from_camera.apply(unproject(uv, patch[row, column].astype(np.float64), camera))[:, 2] - support_z_m
    near = heights[np.abs(heights) < _POSE_ERROR_M]
    if len(near) < 60:
        return 0.0
    counts, edges = np.histogram(near, bins=round(2 * _POSE_ERROR_M / 0.004), range=(-_POSE_ERROR_M, _POSE_ERROR_M))
    peak = float(edges[int(np.argmax(np.convolve(counts, [1, 2, 1], mode="same")))] + 0.002)
    return float(np.median(near[np.abs(near - peak) < 0.008]))


def raised(points: Points, lift_m: float) -> Points:
    """World points raised by a height."""
    return points + np.array([0.0, 0.0, lift_m])


def pose_spread(offsets_m: Sequence[float]) -> float:
    """Median absolute deviation of the frames' height offsets of a support."""
    offsets = np.array(offsets_m)
    return float(np.median(np.abs(offsets - np.median(offsets)))) if len(offsets) else 0.0
