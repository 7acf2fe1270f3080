"""How well a mesh, where its generator believes it is, reproduces the masks and the depth it came from."""

from collections.abc import Mapping, Sequence
from functools import lru_cache

import cv2
import numpy as np

from r2c2r_core.arrays import DepthMetres, Faces, Mask, Points
from r2c2r_core.generate.evidence import View
from r2c2r_core.geometry.camera import sample_through
from r2c2r_core.geometry.masks import mask_iou
from r2c2r_core.geometry.raster import rasterize
from r2c2r_core.geometry.visibility import DepthNoise

_RENDER_PX = 240  # long side of the view; finer changes the IoU by less than its noise
_OCCLUDER_GAP_M = 0.05
_WORST_DEPTH_M = 0.2  # backends.md §2.7
_DEPTH_WEIGHT = 2.0  # per metre, against 1 per unit of IoU (backends.md §2.7)
JUDGES = 8  # views of the pool, best first, that judge every shape of an object alike
VIEWS_KEPT = 24  # an object's pool: what is known of a view is asked for again by every candidate
COPIED_COST = 0.05  # of IoU: carving copies the masks' errors, it has to agree with them better than a clean shape


def self_consistency(vertices_world: Points, faces: Faces, maskable: np.ndarray, views: Sequence[View]) -> dict[str, float]:
    """`mask_iou` of the visible silhouette and `depth_residual_m`, means over the views.

    A front's mask leaves its carcass out, except where a bare side shows: the better of both silhouettes counts.
    """
    overlaps, residuals = [], []
    for view in views:
        depth = render_depth(vertices_world, faces[maskable], view)
        sensor = sensor_depth(view, depth.shape)
        mask = mask_at(view, depth.shape)
        overlap = _visible_iou(depth, sensor, mask, view.noise)
        if not maskable.all():
            whole = render_depth(vertices_world, faces, view)
            overlap = max(overlap, _visible_iou(whole, sensor, mask, view.noise))
        overlaps.append(overlap)
        both = (depth > 0) & (sensor > 0) & mask
        if both.sum() >= 20:
            residuals.append(float(np.minimum(np.abs(depth - sensor)[both], _WORST_DEPTH_M).mean()))
    metrics = {"mask_iou": float(np.mean(overlaps))} if overlaps else {}
    return {**metrics, "depth_residual_m": float(np.mean(residuals))} if residuals else metrics


def disagreement(fit: Mapping[str, float]) -> float:
    """What `self_consistency` measured as one cost, 0 for a perfect fit, in units of IoU."""
    return 1.0 - fit["mask_iou"] + _DEPTH_WEIGHT * fit.get("depth_residual_m", 0.0)


def silhouette_iou(vertices_world: Points, faces: Faces, views: Sequence[View]) -> float:
    """Mean IoU of the visible silhouette with the masks."""
    scores = []
    for view in views:
        depth = render_depth(vertices_world, faces, view)
        scores.append(_visible_iou(depth, sensor_depth(view, depth.shape), mask_at(view, depth.shape), view.noise))
    return float(np.mean(scores))


def render_depth(vertices_world: Points, faces: Faces, view: View) -> DepthMetres:
    """The mesh's depth in the view's crop, at a small size."""
    camera = view.rgb_camera
    scale = min(1.0, _RENDER_PX / max(camera.width, camera.height))
    small = camera.resized(max(round(camera.width * scale), 1), max(round(camera.height * scale), 1))
    return rasterize(vertices_world, faces, np.ones((len(vertices_world), 3)), small, view.world_from_camera.inverse).depth_m


@lru_cache(maxsize=VIEWS_KEPT)
def mask_at(view: View, shape: tuple[int, ...]) -> Mask:
    """The view's mask at another size of its crop."""
    small = cv2.resize(view.mask.astype(np.uint8) * 255, (shape[1], shape[0]), interpolation=cv2.INTER_AREA)
    return np.asarray(small > 127)


@lru_cache(maxsize=VIEWS_KEPT)
def sensor_depth(view: View, shape: tuple[int, ...]) -> DepthMetres:
    """The measured depth at the pixels of the view's colour crop resized to `shape`; 0 where unknown."""
    rgb = view.rgb_camera.resized(shape[1], shape[0])
    values, inside = sample_through(view.depth_m, view.depth_camera, rgb)
    return np.where(inside, values, 0.0).astype(np.float32)


def _visible_iou(depth: DepthMetres, sensor: DepthMetres, mask: Mask, noise: DepthNoise) -> float:
    """IoU of the silhouette with the mask, leaving out pixels where something nearer hides the mesh."""
    hidden = (depth > 0) & noise.occluded(sensor, depth, _OCCLUDER_GAP_M) & ~mask
    return mask_iou((depth > 0) & ~hidden, mask)
