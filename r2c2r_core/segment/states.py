"""Open and closed: how far a drawer's front stands out of its place in one frame."""

import numpy as np

from r2c2r_core.geometry.camera import project, unproject
from r2c2r_core.model.capture import Frame
from r2c2r_core.segment.fronts import Front, front_corners
from r2c2r_core.segment.scene import Scene

_CLOSED_M = 0.03  # nearer its place it is closed: pose error and handles
_FARTHEST_M = 0.6
_FLAT_M = 0.015  # a front is this flat, what else stands before one is not
_MOST = 0.6  # of the depth points before the front, that must lie on the flat
_SPAN = 0.7  # of the front's width and height, that they must span
_BESIDE_M, _BESIDE_SHARE = 0.05, 0.35  # beyond its edges the flat must end: the same outline, not a board before it


def drawn_out(front: Front, scene: Scene, frame: Frame) -> float:
    """Metres a flat of the front's own outline stands before its place; 0 where closed, hidden or not to be told."""
    lift, x, z = _points_before(front, scene, frame)
    half_w, half_h = front.cell.width * front.run.grid.cell_m / 2, front.cell.height * front.run.grid.cell_m / 2
    inside = (np.abs(x) < 0.95 * half_w) & (np.abs(z) < 0.95 * half_h)
    shown = lift[inside & (lift > -_CLOSED_M)]
    if len(shown) < 60 or (np.abs(shown) < _CLOSED_M).mean() > 0.4:
        return 0.0
    counts, edges = np.histogram(shown, bins=np.arange(_CLOSED_M, _FARTHEST_M, 0.005))
    peak = int(np.argmax(np.convolve(counts, np.ones(5), mode="same")))
    out = float(edges[peak] + 0.0025)
    flat = np.abs(lift - out) < _FLAT_M
    own, beside = flat & inside, flat & ~inside & (np.abs(x) > half_w + 0.01) & (np.abs(x) < half_w + _BESIDE_M)
    spans = np.ptp(np.quantile(np.stack([x[own], z[own]]), [0.03, 0.97], axis=1), axis=0) if own.sum() > 60 else np.zeros(2)
    density = own.sum() / (4 * 0.95**2 * half_w * half_h)
    around = beside.sum() / (4 * half_h * (_BESIDE_M - 0.01))
    is_front = own.sum() > _MOST * len(shown) and (spans > _SPAN * 1.9 * np.array([half_w, half_h])).all()
    return out if is_front and around < _BESIDE_SHARE * density else 0.0


def _points_before(front: Front, scene: Scene, frame: Frame) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Depth points about the front, as height over its plane, and x to the right and z up from its middle."""
    grid, camera, depth = front.run.grid, frame.depth_camera, scene.depth(frame.index)
    corners = front_corners(front.cell, grid, (0.0, 0.0))
    seen = frame.world_from_camera.inverse.apply(np.concatenate([corners, corners + grid.outward * _FARTHEST_M]))
    nothing = np.zeros(0)
    if seen[:4, 2].min() < 0.2:
        return nothing, nothing, nothing
    uv = project(np.maximum(seen, [-np.inf, -np.inf, 0.2]), camera)
    left, top = np.clip(np.floor(uv.min(axis=0)), 0, [camera.width, camera.height]).astype(int)
    right, bottom = np.clip(np.ceil(uv.max(axis=0)), 0, [camera.width, camera.height]).astype(int)
    row, column = np.nonzero(depth[top:bottom, left:right] > 0)
    row, column = row + top, column + left
    points = unproject(np.stack([column + 0.5, row + 0.5], axis=1), depth[row, column].astype(np.float64), camera)
    local = (frame.world_from_camera.apply(points) - corners.mean(axis=0)) @ grid.world_from_plane.rotation
    return -local[:, 1], local[:, 0], local[:, 2]
