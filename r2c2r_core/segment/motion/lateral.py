"""Displacement of a leaf in its own plane, from where the plane's depth ends: depth on its face is the same in all states."""

from dataclasses import dataclass

import numpy as np

from r2c2r_core.geometry.camera import pixel_rays, project
from r2c2r_core.model.capture import Frame
from r2c2r_core.segment.motion.hypotheses import Hypothesis
from r2c2r_core.segment.motion.leaf import Leaf
from r2c2r_core.segment.scene import Scene
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the detection of a leaf's trailing edge."""

    column_m: float = param(0.008, "m", "Width of the columns whose depth is pooled", gt=0)
    on_plane_m: float = param(
        0.012, "m", "Maximum distance of a column's median depth from the closed plane to lie on the leaf"
    )
    least_points: int = param(6, "count", "Minimum number of depth points in a column", ge=1)
    least_columns: float = param(0.6, "share", "Minimum fraction of the closed place's columns that a frame must show")
    least_clear: float = param(0.85, "share", "Minimum fraction of those that must lie on the right side of the edge")
    edge_m: float = param(
        0.005, "m", "Standard deviation of an edge in depth", source="half a pixel of a phone's LiDAR at 1.5 m"
    )


def slid(leaf: Leaf, hypothesis: Hypothesis, scene: Scene, frame: Frame) -> tuple[float, float] | None:
    """Displacement of the leaf in a frame and its standard deviation, metres; None where the frame does not determine it."""
    params = tuned(Params)
    x, off = _over_plane(leaf, scene, frame)
    x = x * float(np.sign(hypothesis.axis[0]))  # along the sliding direction
    half = leaf.half_m[0]
    edges = np.arange(-half, half + params.column_m, params.column_m)
    number = np.digitize(x, edges) - 1
    medians = np.array(
        [np.median(off[number == k]) if (number == k).sum() >= params.least_points else np.nan for k in range(len(edges) - 1)]
    )
    shown = np.flatnonzero(np.isfinite(medians))
    if len(shown) < params.least_columns * len(medians):
        return None
    on = np.abs(medians[shown]) < params.on_plane_m
    right = np.concatenate([[0], np.cumsum(~on)]) + np.concatenate([np.cumsum(on[::-1])[::-1], [0]])
    best = int(np.argmax(right))
    if right[best] < params.least_clear * len(shown) or best == len(shown):
        return None
    if best == 0:
        return 0.0, params.edge_m
    edge, reach = edges[shown[best]], 2 * params.column_m
    about = np.abs(x - edge) < reach
    share = (np.abs(off[about]) < params.on_plane_m).mean()  # fraction of a strip around the edge that the leaf covers
    return float(edge + reach - 2 * reach * share + half), params.edge_m


def _over_plane(leaf: Leaf, scene: Scene, frame: Frame) -> tuple[np.ndarray, np.ndarray]:
    """Unoccluded depth within the closed outline: x where its ray meets the plane, and metres behind the plane."""
    params = tuned(Params)
    camera, depth = frame.depth_camera, scene.depth(frame.index)
    outline = frame.world_from_camera.inverse.apply(leaf.corners)
    if outline[:, 2].min() < 0.1:
        return np.zeros(0), np.zeros(0)
    uv = project(outline, camera)
    low = np.clip(np.floor(uv.min(axis=0)), 0, [camera.width, camera.height]).astype(int)
    high = np.clip(np.ceil(uv.max(axis=0)), 0, [camera.width, camera.height]).astype(int)
    row, column = np.nonzero(depth[low[1] : high[1], low[0] : high[0]] > 0)
    row, column = row + low[1], column + low[0]
    rays = pixel_rays(np.stack([column + 0.5, row + 0.5], axis=1), camera)
    front_from_camera = leaf.world_from_front.inverse @ frame.world_from_camera
    turned, origin = front_from_camera.turn(rays), front_from_camera.translation
    z = -origin[1] / np.where(np.abs(turned[:, 1]) < 1e-6, 1e-6, turned[:, 1])  # where the ray meets the plane
    met = origin + z[:, None] * turned
    off = origin[1] + depth[row, column] * turned[:, 1]
    half_w, half_h = leaf.half_m
    inside = (z > 0) & (np.abs(met[:, 0]) < half_w) & (np.abs(met[:, 2]) < 0.9 * half_h) & (off > -params.on_plane_m)
    return met[inside, 0], off[inside]
