"""Photographs onto a mesh: each texel is a robust blend of the sharp, frontal, unhidden frames that see it."""

from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np

from r2c2r_core.arrays import Colours, Faces, Image, Points
from r2c2r_core.generate.charts import Atlas
from r2c2r_core.generate.consistency import render_depth, sensor_depth
from r2c2r_core.generate.evidence import View, moved_edge
from r2c2r_core.generate.unseen import fill_unseen, own_texels, spread_colours
from r2c2r_core.geometry.camera import project, sample_nearest
from r2c2r_core.geometry.transforms import Rigid3

_LEAST_COSINE = 0.2
_GRAZING_COSINE = 0.5
_HIDDEN_M = 0.015
_SENSOR_GAP_M = 0.03
_VIEWS_PER_SIDE = 9
_POWER = 4.0  # (cos^2 * sharpness / z^2)^4 nearly picks the best frame and still hides seams (backends.md §2.6)
_NEXT_VIEW = 0.05  # what a flat side's next-best frame keeps of its weight: poses differ by millimetres, a blend ghosts
_OUTLIER_LEVELS = 40.0  # grey levels: a highlight or an occluder's fringe stands further from the median of the frames
_EDGE_SHARE = 0.006  # of the mask's size: the dark gap and the blurred outline that its edge may hold
_REMAP_WIDTH = 1024  # cv2.remap needs each side below 32767


class Baked(NamedTuple):
    """A texture, and how much of it was seen."""

    texture: Image
    seen_fraction: float  # of the covered texels


def bake(
    atlas: Atlas,
    vertices_world: Points,
    faces: Faces,
    world_from_local: Rigid3,
    views: Sequence[View],
    front_y_m: float | None = None,
) -> Baked:
    """The texture of an atlas whose points are in the local frame; unseen texels get plausible colours.

    `front_y_m` is where furniture has its front face: the other sides then go by their own material, or the plain tint.
    """
    eyes = world_from_local.inverse.apply(np.array([view.eye_world for view in views]))
    wanted = np.ones((len(views), 6), dtype=bool) if front_y_m is None else _best_views(atlas, eyes, views)
    used: np.ndarray = np.asarray(wanted.any(axis=1))
    frames = [view for view, is_used in zip(views, used, strict=True) if is_used]
    samples, weights = _gather(atlas, vertices_world, faces, world_from_local, frames, wanted[used])
    if front_y_m is not None:
        _prefer_best(weights, atlas.chart)
    colours, seen = _blend(samples, weights)
    seen &= own_texels(atlas, seen, front_y_m)
    texture = np.zeros((*atlas.size, 3), np.uint8)
    texture.reshape(-1, 3)[atlas.texel] = fill_unseen(colours, seen, atlas, front_y_m, eyes.mean(axis=0))
    return Baked(spread_colours(texture, atlas), float(seen.mean()) if len(seen) else 0.0)


def _best_views(atlas: Atlas, eyes_local: Points, views: Sequence[View]) -> np.ndarray:
    """(view, chart): whether the view is among the most useful for that side: frontal, near, sharp."""
    wanted = np.zeros((len(views), 6), dtype=bool)
    sharp = np.array([0.3 + 0.7 * view.sharpness for view in views])
    for chart in np.unique(atlas.chart):
        normal = np.eye(3)[chart // 2] * (1.0 if chart % 2 else -1.0)
        towards = eyes_local - atlas.points[atlas.chart == chart].mean(axis=0)
        distance = np.maximum(np.linalg.norm(towards, axis=1), 0.05)
        usefulness = np.maximum(towards @ normal / distance, 0.0) ** 2 / distance**2 * sharp
        best = np.argsort(-usefulness, kind="stable")[:_VIEWS_PER_SIDE]
        wanted[best[usefulness[best] > 0], chart] = True
    return wanted


def _prefer_best(weights: np.ndarray, chart: np.ndarray) -> None:
    """Scale the weights, in place, so that the frame that shows most of a side best carries it."""
    for side in np.unique(chart):
        texels = np.flatnonzero(chart == side)
        order = np.argsort(-weights[:, texels].sum(axis=1), kind="stable")
        for rank, view in enumerate(order):
            weights[view, texels] *= max(_NEXT_VIEW**rank, 1e-9)


def _gather(
    atlas: Atlas,
    vertices_world: Points,
    faces: Faces,
    world_from_local: Rigid3,
    views: Sequence[View],
    wanted: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Colours (k, t, 3) and weights (k, t) of the texels in the views; weight 0 where a view does not show the texel."""
    count = len(atlas.points)
    samples = np.zeros((len(views), count, 3), np.uint8)
    weights = np.zeros((len(views), count), np.float32)
    points, normals = atlas.points.astype(np.float32), atlas.normals.astype(np.float32)
    for k, view in enumerate(views):
        camera_from_local = view.world_from_camera.inverse @ world_from_local
        towards = camera_from_local.inverse.translation.astype(np.float32) - points
        cosine = np.einsum("ij,ij->i", towards, normals) / np.maximum(np.sqrt(np.einsum("ij,ij->i", towards, towards)), 1e-9)
        facing = np.flatnonzero((cosine > _LEAST_COSINE) & wanted[k, atlas.chart])
        if len(facing) == 0:
            continue
        in_camera = _moved(points[facing], camera_from_local)
        depth = render_depth(vertices_world, faces, view)
        colours, shown = _look_up(view, in_camera, depth, cosine[facing] < _GRAZING_COSINE)
        z = np.maximum(in_camera[:, 2], 0.05)
        weight = (cosine[facing] ** 2 * (0.3 + 0.7 * view.sharpness) / z**2) ** _POWER
        weights[k, facing] = np.where(shown, weight, 0.0)
        samples[k, facing] = colours
    return samples, weights


def _look_up(view: View, in_camera: np.ndarray, depth: np.ndarray, grazing: np.ndarray) -> tuple[Colours, np.ndarray]:
    """The view's colour at each camera-frame point, and whether it shows the point.

    It must lie in the mask, behind nothing of the mesh, and where the sensor measured, not behind anything else. On grazing
    sides, where a mask that is a pixel too wide smears the neighbour over a hand's breadth, depth must confirm the surface.
    """
    z = in_camera[:, 2]
    camera = view.rgb_camera
    uv = np.where(z[:, None] > 0.05, project(in_camera, camera), np.float32(np.nan))
    in_mask, inside = sample_nearest(moved_edge(view.mask, -max(1.0, _EDGE_SHARE * np.sqrt(view.mask.sum()))), uv)
    surface, _ = sample_nearest(depth, uv * (depth.shape[1] / camera.width, depth.shape[0] / camera.height))
    sensor = sensor_depth(view, depth.shape)
    measured, _ = sample_nearest(sensor, uv * (depth.shape[1] / camera.width, depth.shape[0] / camera.height))
    hidden = view.noise.occluded(measured, z, _SENSOR_GAP_M)
    beyond = view.noise.seen_through(measured, z, _SENSOR_GAP_M) & grazing
    return _sample_bilinear(view.rgb, uv), inside & in_mask & (z < surface + _HIDDEN_M) & ~hidden & ~beyond


def _moved(points: np.ndarray, transform: Rigid3) -> np.ndarray:
    """The points (n, 3) through the transform, in single precision, a column at a time."""
    r, t = transform.rotation.astype(np.float32), transform.translation.astype(np.float32)
    x, y, z = points[:, 0], points[:, 1], points[:, 2]
    return np.stack([x * r[k, 0] + y * r[k, 1] + z * r[k, 2] + t[k] for k in range(3)], axis=1)


def _blend(samples: np.ndarray, weights: np.ndarray) -> tuple[Colours, np.ndarray]:
    """Weighted mean of the samples that agree with the median brightness, after levelling the views' exposures."""
    seen = np.asarray((weights > 0).any(axis=0))
    if len(samples) == 0 or not seen.any():
        return np.zeros((weights.shape[1], 3), np.uint8), np.zeros(weights.shape[1], dtype=bool)
    grey = np.stack([_grey(sample) for sample in samples])
    shown = weights > 0
    median = _median_shown(grey, shown)
    gains = np.array([_gain(grey[k], median, shown[k]) for k in range(len(samples))], np.float32)
    median = _median_shown(grey * gains[:, None], shown)
    agreement = np.exp(-(((grey * gains[:, None] - median) / _OUTLIER_LEVELS) ** 2))
    final = weights / np.maximum(weights.max(axis=0), 1e-30) * (agreement + 1e-4)
    total = final.sum(axis=0)
    colours = np.zeros((weights.shape[1], 3), np.float32)
    for k in range(len(samples)):
        colours += samples[k] * (gains[k] * final[k] / np.maximum(total, 1e-12))[:, None]
    return np.round(colours).clip(0, 255).astype(np.uint8), seen


def _grey(colours: Colours) -> np.ndarray:
    """The mean of the channels, a channel at a time: numpy is slow along an axis of three."""
    red, green, blue = (colours[:, k].astype(np.float32) for k in range(3))
    return np.asarray((red + green + blue) / np.float32(3.0))


def _median_shown(grey: np.ndarray, shown: np.ndarray) -> np.ndarray:
    """Lower median over the views that show each texel (highlights are bright)."""
    ordered = np.where(shown, grey, np.float32(np.inf)).T.copy()  # numpy sorts rows that lie together faster
    ordered.sort(axis=1)
    middle = np.maximum(shown.sum(axis=0) - 1, 0) // 2
    values = ordered[np.arange(len(middle)), middle]
    return np.asarray(np.where(np.isfinite(values), values, np.float32(0.0)))


def _gain(grey: np.ndarray, median: np.ndarray, shown: np.ndarray) -> float:
    """The factor that brings one view to the common exposure."""
    usable = shown & (grey > 15) & (median > 15)
    if usable.sum() < 50:
        return 1.0
    return float(np.clip(np.median(median[usable] / grey[usable]), 0.7, 1.4))


def _sample_bilinear(image: Image, uv_px: np.ndarray) -> Colours:
    """Colours at continuous pixel positions; outside gives the border."""
    count = len(uv_px)
    rows = -(-count // _REMAP_WIDTH)
    x, y = (np.zeros(rows * _REMAP_WIDTH, np.float32) for _ in range(2))
    limited = np.clip(np.nan_to_num(uv_px), -1e4, 1e4)
    x[:count], y[:count] = limited[:, 0] - 0.5, limited[:, 1] - 0.5
    shape = (rows, _REMAP_WIDTH)
    colours = cv2.remap(image, x.reshape(shape), y.reshape(shape), cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(colours.reshape(-1, 3)[:count])
