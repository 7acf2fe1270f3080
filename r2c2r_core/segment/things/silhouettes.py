"""Silhouettes of small things: a hull rendered into a frame, shifted by that frame's pose error, snapped to colour edges."""

from dataclasses import dataclass

import cv2
import numpy as np

from r2c2r_core.arrays import Mask, Pixels, Points, Vector3
from r2c2r_core.geometry.camera import project, unproject
from r2c2r_core.model.capture import Frame
from r2c2r_core.segment.occlusion import colour_gradient
from r2c2r_core.segment.scene import Scene
from r2c2r_core.segment.things.pixel_cut import ColourModel, cut_pixels, learn_colours
from r2c2r_core.segment.things.thing import Thing
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """How a small thing's outline is drawn."""

    sure_odds: float = param(9.0, "log", "of a pixel that is known")
    on_support_m: float = param(0.008, "m", "above the support: lower points are the support's")
    pose_error_m: float = param(0.04, "m", "of the height of a support between frames, at most")
    attached_m: float = param(0.035, "m", "from the hull: handles and caps that it lacks")
    attached_odds: float = param(3.2, "log", "of such a place: depth and colour together may add it")


def small_mask(thing: Thing, scene: Scene, frame: Frame, band_m: float | None = None) -> tuple[Mask, float]:
    """The visible pixels of a small thing: where its hull, this frame's depth and its colours say, cut along colour edges."""
    params = tuned(Params)
    camera = frame.rgb_camera
    empty = np.zeros((camera.height, camera.width), bool)
    view = hull_view(thing, scene, frame, pad_m=thing.pose_error_m + 0.03)
    if view is None:
        return empty, 0.0
    hull, hidden, area, scale = view
    share = 1 - float((hull & hidden).sum() / max(hull.sum(), 1))
    if share < 0.08:
        return empty, 0.0
    rgb = scene.rgb(frame.index)[area]
    odds = seen_odds(thing, scene, frame, area)
    hull = _moved(hull, _best_shift(hull, odds, colour_gradient(rgb), reach_px=round(thing.pose_error_m * scale)))
    odds = odds + _outline_odds(hull, max(1.5, (band_m or thing.border_m) * scale), params.attached_m * scale)
    odds[hidden] = -params.sure_odds
    for click in thing.clicks:
        if click.frame == frame.index:
            _mark(odds, click.x - area[1].start, click.y - area[0].start, 0.004 * scale, click.label)
    empty[area] = _held_by(cut_pixels(rgb, odds), hull) & ~hidden
    return empty, share


def _mark(odds: np.ndarray, x_px: float, y_px: float, radius_px: float, label: int) -> None:
    """Settle the pixels under a click."""
    params = tuned(Params)
    row, column = np.ogrid[: odds.shape[0], : odds.shape[1]]
    near = np.hypot(column + 0.5 - x_px, row + 0.5 - y_px) < max(radius_px, 2.0)
    odds[near] = params.sure_odds if label else -params.sure_odds


def seen_odds(thing: Thing, scene: Scene, frame: Frame, area: tuple[slice, slice]) -> np.ndarray:
    """Log-odds of each pixel of a crop by what the frame itself shows there: depth above the support, and colour."""
    odds = _depth_odds(thing, scene, frame, area)
    if thing.colours is not None:
        odds = odds + thing.colours.odds(cv2.cvtColor(scene.rgb(frame.index)[area], cv2.COLOR_RGB2LAB))
    return odds


def colours_of(thing: Thing, scene: Scene, views: list[Frame], band_m: float) -> ColourModel | None:
    """Colours on the thing against those around it, from where views are sure."""
    samples = []
    for frame in views:
        view = hull_view(thing, scene, frame, pad_m=thing.pose_error_m + 0.04)
        mask, share = small_mask(thing, scene, frame, band_m)
        if view is None or share < 0.8 or not mask.any():
            continue
        _, hidden, area, scale = view
        lab = cv2.cvtColor(scene.rgb(frame.index)[area], cv2.COLOR_RGB2LAB)
        odds = _depth_odds(thing, scene, frame, area)
        inner = cv2.erode(mask[area].astype(np.uint8), _round(0.25 * band_m * scale)) > 0
        outer = cv2.dilate(mask[area].astype(np.uint8), _round(0.5 * band_m * scale)) > 0
        samples.append((lab, inner & (odds > -0.5), ~outer & ~hidden & (odds < 0.5)))
    return learn_colours(samples) if samples else None


def support_offset(scene: Scene, frame: Frame, support_z_m: float | None, centre: Vector3) -> float:
    """How much higher than it stands one frame's depth shows the support around the thing: that frame's pose error."""
    params = tuned(Params)
    if support_z_m is None:
        return 0.0
    depth = scene.depth(frame.index)
    camera = frame.depth_camera
    local = frame.world_from_camera.inverse.apply(centre[None])[0]
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
    near = heights[np.abs(heights) < params.pose_error_m]
    if len(near) < 60:
        return 0.0
    counts, edges = np.histogram(
        near, bins=round(2 * params.pose_error_m / 0.004), range=(-params.pose_error_m, params.pose_error_m)
    )
    peak = float(edges[int(np.argmax(np.convolve(counts, [1, 2, 1], mode="same")))] + 0.002)
    return float(np.median(near[np.abs(near - peak) < 0.008]))


def usual_shift(thing: Thing, scene: Scene, views: list[Frame]) -> float:
    """How far the hull's outline lies from the colour edges it belongs to, metres, in the middle of the frames."""
    shifts = []
    for frame in views:
        view = hull_view(thing, scene, frame, pad_m=thing.pose_error_m + 0.03)
        if view is not None:
            hull, _, area, scale = view
            gradient, odds = colour_gradient(scene.rgb(frame.index)[area]), seen_odds(thing, scene, frame, area)
            shifts.append(float(np.hypot(*_best_shift(hull, odds, gradient, round(thing.pose_error_m * scale)))) / scale)
    return float(np.median(shifts)) if shifts else 0.0


def raised(points: Points, lift_m: float) -> Points:
    """World points lifted by a height."""
    return points + np.array([0.0, 0.0, lift_m])


def hull_view(thing: Thing, scene: Scene, frame: Frame, pad_m: float) -> tuple[Mask, Mask, tuple[slice, slice], float] | None:
    """The hull's projection and the occluders in the crop around it, the crop, and pixels a metre."""
    camera = frame.rgb_camera
    offset = support_offset(scene, frame, thing.support_z_m, thing.vertices.mean(axis=0))
    local = frame.world_from_camera.inverse.apply(raised(thing.vertices, offset))
    if local[:, 2].min() < 0.15:
        return None
    uv = project(local, camera)
    scale = camera.fx / float(np.median(local[:, 2]))
    pad = pad_m * scale + 6
    left, top = int(max(uv[:, 0].min() - pad, 0)), int(max(uv[:, 1].min() - pad, 0))
    right, bottom = int(min(uv[:, 0].max() + pad, camera.width)), int(min(uv[:, 1].max() + pad, camera.height))
    if right - left < 6 or bottom - top < 6:
        return None
    hull = _splat(uv - [left, top], (bottom - top, right - left), thing.spacing_m * scale)
    if hull.sum() < 8:
        return None
    area = (slice(top, bottom), slice(left, right))
    return hull > 0, occluders(thing, scene, frame, area), area, scale


def occluders(thing: Thing, scene: Scene, frame: Frame, area: tuple[slice, slice] | None = None) -> Mask:
    """Colour pixels (all, or of an area) where something stands clearly nearer than the thing."""
    nearest = float(frame.world_from_camera.inverse.apply(thing.vertices)[:, 2].min())
    depth = scene.filled_depth(frame.index)
    return _at_colour(scene.noise.occluded(depth, nearest, 0.03), frame, area)


def _at_colour(flags: Mask, frame: Frame, area: tuple[slice, slice] | None) -> Mask:
    """Flags of depth pixels at the colour pixels that they lie under."""
    width, height = frame.rgb_camera.width, frame.rgb_camera.height
    rows, columns = area or (slice(0, height), slice(0, width))
    row = np.arange(rows.start, rows.stop) * flags.shape[0] // height
    column = np.arange(columns.start, columns.stop) * flags.shape[1] // width
    return flags[row[:, None], column]


def _depth_odds(thing: Thing, scene: Scene, frame: Frame, area: tuple[slice, slice]) -> np.ndarray:
    """Log-odds by depth: above the support and about where the thing stands, or else on the support, behind, or unknown (0)."""
    camera, depth = frame.depth_camera, scene.depth(frame.index)
    rows = _depth_index(area[0], frame.rgb_camera.height, camera.height)
    columns = _depth_index(area[1], frame.rgb_camera.width, camera.width)
    first_row, first_column = int(rows[0]), int(columns[0])
    patch = depth[first_row : rows[-1] + 1, first_column : columns[-1] + 1]
    v, u = np.mgrid[first_row : first_row + patch.shape[0], first_column : first_column + patch.shape[1]] + 0.5
    seen = unproject(np.stack([u, v], axis=-1), patch.astype(np.float64), camera)
    points = frame.world_from_camera.apply(seen.reshape(-1, 3)).reshape(seen.shape)
    low, high = thing.vertices.min(axis=0), thing.vertices.max(axis=0)
    slack = 0.015 + 0.5 * thing.pose_error_m
    near = ((points[..., :2] > low[:2] - slack) & (points[..., :2] < high[:2] + slack)).all(axis=-1)
    near &= (points[..., 2] > low[2] - slack) & (points[..., 2] < high[2] + slack)
    verdict = np.where(near, 1.0, -1.0)
    if thing.support_z_m is not None:
        offset = support_offset(scene, frame, thing.support_z_m, thing.vertices.mean(axis=0))
        standing = ((points[..., :2] > low[:2]) & (points[..., :2] < high[:2])).all(axis=-1)
        on_support = points[..., 2] < thing.support_z_m + offset + tuned(Params).on_support_m
        verdict = np.where(on_support, np.where(standing & near, 0.0, -1.0), verdict)  # the foot of it is as low
    coarse = max(frame.rgb_camera.width / camera.width, 1.0)
    odds = np.where(patch > 0, verdict, 0.0) * (2.0 / np.sqrt(coarse))
    at = np.ix_(rows - first_row, columns - first_column)
    return np.asarray(cv2.blur(odds[at].astype(np.float32), (2 * round(coarse) + 1,) * 2))


def _depth_index(span: slice, colour_size: int, depth_size: int) -> np.ndarray:
    """The depth row or column of each colour one."""
    return ((np.arange(span.start, span.stop) + 0.5) * depth_size / colour_size).astype(int)


def _outline_odds(hull: Mask, band_px: float, attached_px: float) -> np.ndarray:
    """Log-odds by the hull: little near its outline, and not everything where a handle may be (`attached_px` around it)."""
    params = tuned(Params)
    outside = cv2.distanceTransform((~hull).astype(np.uint8), cv2.DIST_L2, 5)
    inside = cv2.distanceTransform(np.pad(hull, 1).astype(np.uint8), cv2.DIST_L2, 5)[1:-1, 1:-1]
    deep = min(band_px, 0.5 * float(inside.max()))
    steps = np.where(hull, (inside - 0.5) / max(deep, 0.5), (0.5 - outside) / band_px)
    odds = np.clip(steps * (1 + steps**2 / 4), -params.attached_odds, params.sure_odds)
    odds[outside > attached_px] = -params.sure_odds
    return np.asarray(odds)


def _held_by(mask: Mask, hull: Mask) -> Mask:
    """The parts of a mask that lie mostly on the hull."""
    count, labels = cv2.connectedComponents(mask.astype(np.uint8), connectivity=4)
    total = np.bincount(labels.ravel(), minlength=count)
    within = np.bincount(labels[hull], minlength=count)
    kept = within > 0.3 * np.maximum(total, 1)
    kept[0] = False
    return np.asarray(kept[labels])


def _round(radius_px: float) -> np.ndarray:
    size = 2 * max(1, round(radius_px)) + 1
    return cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))


def _splat(uv_px: Pixels, shape: tuple[int, int], spacing_px: float) -> np.ndarray:
    """The filled outline of points that are about `spacing_px` apart."""
    height, width = shape
    pad = int(spacing_px) + 2
    canvas = np.zeros((height + 2 * pad, width + 2 * pad), np.uint8)
    column, row = np.floor(uv_px[:, 0]).astype(int) + pad, np.floor(uv_px[:, 1]).astype(int) + pad
    inside = (column >= 0) & (row >= 0) & (column < canvas.shape[1]) & (row < canvas.shape[0])
    canvas[row[inside], column[inside]] = 1
    size = 2 * max(1, round(0.8 * spacing_px)) + 1
    element = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    return np.asarray(cv2.morphologyEx(canvas, cv2.MORPH_CLOSE, element)[pad:-pad, pad:-pad])


def _best_shift(hull: Mask, odds: np.ndarray, gradient: np.ndarray, reach_px: int) -> tuple[int, int]:
    """The small move of the hull onto likely pixels and strong edges: pose error, nought where poses are right."""
    contours, _ = cv2.findContours(hull.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    outline = np.concatenate(contours)[:, 0]
    outline = outline[:: max(1, len(outline) // 160)]
    limited = np.minimum(cv2.GaussianBlur(gradient, (0, 0), 1.0), np.quantile(gradient, 0.97) + 1e-6)
    height, width = hull.shape
    steps = np.arange(-reach_px, reach_px + 1, max(1, reach_px // 10))
    dy, dx = (grid.ravel() for grid in np.meshgrid(steps, steps, indexing="ij"))
    x, y = outline[:, 0] + dx[:, None], outline[:, 1] + dy[:, None]
    inside = (x >= 0) & (y >= 0) & (x < width) & (y < height)
    strength = np.where(inside, limited[np.clip(y, 0, height - 1), np.clip(x, 0, width - 1)], 0).sum(axis=1)
    value = strength / np.maximum(inside.sum(axis=1), 1) / float(limited.max())
    value += _overlap(hull, odds, reach_px)[dy + reach_px, dx + reach_px] - 0.3 * np.hypot(dx, dy) / max(reach_px, 1)
    value[inside.sum(axis=1) < 0.5 * len(outline)] = -np.inf
    best = int(np.argmax(value))
    return (int(dx[best]), int(dy[best])) if np.isfinite(value[best]) else (0, 0)


def _overlap(hull: Mask, odds: np.ndarray, reach_px: int) -> np.ndarray:
    """Mean odds inside the hull less those around it, for every move (dy, dx) up to `reach_px`, from index `reach_px`."""
    ring = (cv2.dilate(hull.astype(np.uint8), _round(0.15 * np.sqrt(hull.sum()))) > 0) & ~hull
    template = hull / max(hull.sum(), 1) - ring / max(ring.sum(), 1)
    padded = np.pad(odds.astype(np.float32), reach_px)
    return np.asarray(cv2.matchTemplate(padded, template.astype(np.float32), cv2.TM_CCORR))


def _moved(hull: Mask, shift: tuple[int, int]) -> Mask:
    move = np.array([[1, 0, shift[0]], [0, 1, shift[1]]], np.float32)
    return np.asarray(cv2.warpAffine(hull.astype(np.uint8), move, (hull.shape[1], hull.shape[0]), flags=cv2.INTER_NEAREST) > 0)
