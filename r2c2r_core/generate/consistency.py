"""Consistency of a posed mesh with the masks and depth of its views."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np

from r2c2r_core.arrays import DepthMetres, Faces, Mask, Points
from r2c2r_core.generate.evidence import View
from r2c2r_core.geometry.camera import sample_through
from r2c2r_core.geometry.masks import mask_iou
from r2c2r_core.geometry.raster import rasterize
from r2c2r_core.geometry.visibility import DepthNoise
from r2c2r_core.tuning import param, tuned

VIEWS_KEPT = 24  # size of an object's pool: every candidate needs the same per-view data again


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the comparison with masks and depth."""

    render_px: int = param(
        240, "px", "Long side of the rendered view", source="finer changes the IoU by less than its noise", ge=32
    )
    occluder_gap_m: float = param(
        0.05, "m", "Minimum distance, beyond the depth noise, in front of the object for measured depth to occlude it"
    )
    worst_depth_m: float = param(0.2, "m", "Limit to which the error of a depth pixel is clipped", source="backends.md 2.7")
    depth_weight: float = param(
        2.0, "score", "Cost per metre of depth error, relative to 1 per unit of IoU", source="backends.md 2.7"
    )
    whole_m: float = param(
        0.9,
        "m",
        "Longest side of an object for which depth_weight applies; for smaller ones errors scale with 1/size",
        source="the chair of backends.md 2.7",
        gt=0,
    )
    judges: int = param(
        8, "count", "Number of views of the pool, best first, on which every shape of an object is judged", ge=1
    )
    copied_cost: float = param(
        0.05, "score", "Cost of carving, which reproduces mask errors: it must agree with the masks better than a clean shape"
    )


def self_consistency(vertices_world: Points, faces: Faces, maskable: np.ndarray, views: Sequence[View]) -> dict[str, float]:
    """Mean `mask_iou` of the visible silhouette and mean `depth_residual_m` over the views, and the mesh's longest side,
    `size_m`.

    A front's mask excludes its carcass, except where a bare side shows: the better of both silhouettes counts.
    """
    params = tuned(Params)
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
            residuals.append(float(np.minimum(np.abs(depth - sensor)[both], params.worst_depth_m).mean()))
    size = {"size_m": float(np.ptp(vertices_world, axis=0).max())}
    metrics = {"mask_iou": float(np.mean(overlaps)), **size} if overlaps else {}
    return {**metrics, "depth_residual_m": float(np.mean(residuals))} if residuals else metrics


def disagreement(fit: Mapping[str, float]) -> float:
    """Combined cost of the `self_consistency` metrics, 0 for a perfect fit, in units of IoU."""
    params = tuned(Params)
    smaller = max(params.whole_m / fit["size_m"], 1.0)
    return 1.0 - fit["mask_iou"] + params.depth_weight * smaller * fit.get("depth_residual_m", 0.0)


def silhouette_iou(vertices_world: Points, faces: Faces, views: Sequence[View]) -> float:
    """Mean IoU of the visible silhouette with the masks."""
    scores = []
    for view in views:
        depth = render_depth(vertices_world, faces, view)
        scores.append(_visible_iou(depth, sensor_depth(view, depth.shape), mask_at(view, depth.shape), view.noise))
    return float(np.mean(scores))


def render_depth(vertices_world: Points, faces: Faces, view: View) -> DepthMetres:
    """The mesh's depth rendered in the view's crop at reduced size."""
    camera = view.rgb_camera
    scale = min(1.0, tuned(Params).render_px / max(camera.width, camera.height))
    small = camera.resized(max(round(camera.width * scale), 1), max(round(camera.height * scale), 1))
    return rasterize(vertices_world, faces, np.ones((len(vertices_world), 3)), small, view.world_from_camera.inverse).depth_m


@lru_cache(maxsize=VIEWS_KEPT)
def mask_at(view: View, shape: tuple[int, ...]) -> Mask:
    """The view's mask resampled to another size of its crop."""
    small = cv2.resize(view.mask.astype(np.uint8) * 255, (shape[1], shape[0]), interpolation=cv2.INTER_AREA)
    return np.asarray(small > 127)


@lru_cache(maxsize=VIEWS_KEPT)
def sensor_depth(view: View, shape: tuple[int, ...]) -> DepthMetres:
    """Measured depth at the pixels of the view's colour crop resized to `shape`; 0 where unknown."""
    rgb = view.rgb_camera.resized(shape[1], shape[0])
    values, inside = sample_through(view.depth_m, view.depth_camera, rgb)
    return np.where(inside, values, 0.0).astype(np.float32)


def _visible_iou(depth: DepthMetres, sensor: DepthMetres, mask: Mask, noise: DepthNoise) -> float:
    """IoU of the silhouette with the mask, ignoring pixels where something nearer occludes the mesh."""
    hidden = (depth > 0) & noise.occluded(sensor, depth, tuned(Params).occluder_gap_m) & ~mask
    return mask_iou((depth > 0) & ~hidden, mask)
