"""Silhouettes of small objects: a hull rendered into a frame, shifted by the frame's pose error, snapped to colour edges."""

from dataclasses import dataclass

import cv2
import numpy as np

from r2c2r_core.arrays import Image, Mask, Pixels, Vector3
from r2c2r_core.geometry.camera import Intrinsics, project, unproject
from r2c2r_core.model.capture import Frame
from r2c2r_core.segment.occlusion import colour_gradient, refine_border
from r2c2r_core.segment.scene import Scene
from r2c2r_core.segment.things.crops import shrunk
from r2c2r_core.segment.things.pixel_cut import ColourModel, cut_pixels, learn_colours, unmixed
from r2c2r_core.segment.things.pixel_cut import Params as CutParams
from r2c2r_core.segment.things.support import raised, support_offset
from r2c2r_core.segment.things.thing import Thing
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of small objects' silhouettes."""

    around_m: float = param(0.04, "m", "Margin of a crop around the hull, beyond the pose error, to show the background")
    border_cells: float = param(
        0.6, "ratio", "Maximum move of the border in the photo relative to a cell of the shrunk crop", gt=0
    )
    sure_odds: float = param(9.0, "log", "Log-odds of a pixel whose label is known")
    on_support_m: float = param(0.008, "m", "Maximum height above the support of points that belong to the support")
    fine: int = param(
        4,
        "count",
        "Number of subpixels per side when the hull's outline is rasterized",
        ge=1,
        source="four bottles of a second generator: mask areas of 1.04-1.08 of the true ones at 1, of 1.03-1.06 at 4",
    )
    before_m: float = param(
        0.03, "m", "Minimum distance in front of the whole object, beyond the noise, for a pixel to be an occluder"
    )
    attached_odds: float = param(
        3.2, "log", "Log-odds against the object where a handle may be: depth and colour together may override it"
    )


@dataclass(frozen=True, slots=True, eq=False)
class Crop:
    """Photo crop around a hull at the resolution of outline extraction; masks (h, w) of that size."""

    area: tuple[slice, slice]  # rows and columns of the photo
    camera: Intrinsics  # of the crop
    scale: float  # pixels per metre, at the object
    hull: Mask  # its projection
    hidden: Mask  # where an occluder lies in front of it

    @property
    def shrink(self) -> float:
        """Photo pixels per crop pixel."""
        return (self.area[1].stop - self.area[1].start) / self.camera.width

    def rgb(self, photo: Image) -> Image:
        """Crop of the whole photo, at the crop's resolution."""
        part = photo[self.area]
        size = (self.camera.width, self.camera.height)
        return part if part.shape[1::-1] == size else np.asarray(cv2.resize(part, size, interpolation=cv2.INTER_AREA), np.uint8)


def small_mask(thing: Thing, scene: Scene, frame: Frame, band_m: float | None = None) -> tuple[Mask, float]:
    """Visible pixels of a small object, by its hull and the frame's depth and colours, cut along colour edges."""
    mask = np.zeros((frame.rgb_camera.height, frame.rgb_camera.width), bool)
    crop, outline, share = crop_outline(thing, scene, frame, band_m)
    if crop is not None:
        mask[crop.area] = _at_full(outline, crop, scene.balanced(frame.index)[crop.area])
    return mask, share


def crop_outline(
    thing: Thing, scene: Scene, frame: Frame, band_m: float | None = None
) -> tuple[Crop, Mask, float] | tuple[None, Mask, float]:
    """Crop around a small object, its visible pixels there, and its visible fraction; no crop where it is not visible."""
    params = tuned(Params)
    nothing: Mask = np.zeros((1, 1), bool)
    crop = hull_crop(thing, scene, frame)
    if crop is None:
        return None, nothing, 0.0
    share = 1 - float((crop.hull & crop.hidden).sum() / max(crop.hull.sum(), 1))
    if share < 0.08:
        return None, nothing, 0.0
    scale = crop.scale
    rgb = crop.rgb(scene.balanced(frame.index))
    odds = seen_odds(thing, scene, frame, crop)
    shift = _best_shift(crop.hull, odds, colour_gradient(rgb), reach_px=round(thing.pose_error_m * scale))
    hull = _moved(crop.hull, shift)
    odds = odds + _outline_odds(hull, max(1.5, (band_m or thing.border_m) * scale), thing.attached_m * scale)
    odds[crop.hidden] = -params.sure_odds
    for click in thing.clicks:
        if click.frame == frame.index:
            x, y = (click.x - crop.area[1].start) / crop.shrink, (click.y - crop.area[0].start) / crop.shrink
            _mark(odds, x, y, 0.004 * scale, click.label)
    return crop, _held_by(cut_pixels(rgb, odds), hull) & ~crop.hidden, share


def _at_full(outline: Mask, crop: Crop, photo: Image) -> Mask:
    """A crop's mask at the photo's resolution, its border snapped to the photo's edges."""
    height, width = photo.shape[:2]
    if outline.shape == (height, width):
        return outline
    grown = cv2.resize(outline.astype(np.float32), (width, height), interpolation=cv2.INTER_LINEAR) > 0.5
    cell = max(height, width) / min(tuned(CutParams).largest_px, max(outline.shape))
    return refine_border(photo, np.asarray(grown), max(2, round(tuned(Params).border_cells * cell)))


def _mark(odds: np.ndarray, x_px: float, y_px: float, radius_px: float, label: int) -> None:
    """Fix the label of the pixels under a click, in place."""
    params = tuned(Params)
    row, column = np.ogrid[: odds.shape[0], : odds.shape[1]]
    near = np.hypot(column + 0.5 - x_px, row + 0.5 - y_px) < max(radius_px, 2.0)
    odds[near] = params.sure_odds if label else -params.sure_odds


def seen_odds(thing: Thing, scene: Scene, frame: Frame, crop: Crop) -> np.ndarray:
    """Log-odds of a crop's pixels by the frame's own depth (above the support) and colour."""
    odds = _depth_odds(thing, scene, frame, crop)
    if thing.colours is not None:
        odds = odds + unmixed(thing.colours.odds(cv2.cvtColor(crop.rgb(scene.balanced(frame.index)), cv2.COLOR_RGB2LAB)))
    return odds


def colours_of(thing: Thing, scene: Scene, views: list[Frame], band_m: float) -> ColourModel | None:
    """Colour model of the object against its surroundings, from confident pixels of the views."""
    samples = []
    for frame in views:
        crop, mask, share = crop_outline(thing, scene, frame, band_m)
        if crop is None or share < 0.8 or not mask.any():
            continue
        lab = cv2.cvtColor(crop.rgb(scene.balanced(frame.index)), cv2.COLOR_RGB2LAB)
        odds = _depth_odds(thing, scene, frame, crop)
        inner = cv2.erode(mask.astype(np.uint8), _round(0.25 * band_m * crop.scale)) > 0
        outer = cv2.dilate(mask.astype(np.uint8), _round(0.5 * band_m * crop.scale)) > 0
        samples.append((lab, inner & (odds > -0.5), ~outer & ~crop.hidden & (odds < 0.5)))
    return learn_colours(samples) if samples else None


def usual_shift(thing: Thing, scene: Scene, views: list[Frame]) -> float:
    """Median distance over frames between the hull's outline and its colour edges, metres."""
    shifts = []
    for frame in views:
        crop = hull_crop(thing, scene, frame)
        if crop is not None:
            gradient, odds = colour_gradient(crop.rgb(scene.balanced(frame.index))), seen_odds(thing, scene, frame, crop)
            moved = _best_shift(crop.hull, odds, gradient, round(thing.pose_error_m * crop.scale))
            shifts.append(float(np.hypot(*moved)) / crop.scale)
    return float(np.median(shifts)) if shifts else 0.0


def hull_crop(thing: Thing, scene: Scene, frame: Frame) -> Crop | None:
    """Crop around the hull with a margin; None where the frame does not show it, or from too near."""
    camera = frame.rgb_camera
    offset = support_offset(scene, frame, thing.support_z_m, thing.vertices.mean(axis=0))
    local = frame.world_from_camera.inverse.apply(raised(thing.vertices, offset))
    if local[:, 2].min() < 0.15:
        return None
    uv = project(local, camera)
    scale = camera.fx / float(np.median(local[:, 2]))
    pad = (thing.pose_error_m + tuned(Params).around_m) * scale + 6
    left, top = int(max(uv[:, 0].min() - pad, 0)), int(max(uv[:, 1].min() - pad, 0))
    right, bottom = int(min(uv[:, 0].max() + pad, camera.width)), int(min(uv[:, 1].max() + pad, camera.height))
    if right - left < 6 or bottom - top < 6:
        return None
    area = (slice(top, bottom), slice(left, right))
    small = shrunk(camera, area)
    shrink = (right - left) / small.width
    hull = splat(project(local, small), (small.height, small.width), thing.spacing_m * scale / shrink)
    if hull.sum() < 8:
        return None
    return Crop(area, small, scale / shrink, hull > 0, _occluders(thing, scene, frame, area, small))


def _occluders(thing: Thing, scene: Scene, frame: Frame, area: tuple[slice, slice], camera: Intrinsics) -> Mask:
    """Pixels of a crop where something lies clearly in front of the object."""
    nearest = float(frame.world_from_camera.inverse.apply(thing.vertices)[:, 2].min())
    flags = scene.noise.occluded(scene.filled_depth(frame.index), nearest, tuned(Params).before_m)
    row = _depth_index(area[0], camera.height, frame.rgb_camera.height, flags.shape[0])
    column = _depth_index(area[1], camera.width, frame.rgb_camera.width, flags.shape[1])
    return flags[row[:, None], column]


def _depth_odds(thing: Thing, scene: Scene, frame: Frame, crop: Crop) -> np.ndarray:
    """Log-odds by depth: above the support near the object, or on the support or behind, or unknown (0)."""
    camera, depth = frame.depth_camera, scene.depth(frame.index)
    rows = _depth_index(crop.area[0], crop.camera.height, frame.rgb_camera.height, camera.height)
    columns = _depth_index(crop.area[1], crop.camera.width, frame.rgb_camera.width, camera.width)
    first_row, first_column = int(rows[0]), int(columns[0])
    patch = depth[first_row : rows[-1] + 1, first_column : columns[-1] + 1]
    v, u = np.mgrid[first_row : first_row + patch.shape[0], first_column : first_column + patch.shape[1]] + 0.5
    seen = unproject(np.stack([u, v], axis=-1), patch.astype(np.float64), camera)
    points = frame.world_from_camera.apply(seen.reshape(-1, 3)).reshape(seen.shape)
    low, high = thing.vertices.min(axis=0), thing.vertices.max(axis=0)
    slack = 0.015 + 0.5 * thing.pose_error_m
    near = _within(points, low - slack, high + slack)
    verdict = np.where(near, 1.0, -1.0)
    if thing.support_z_m is not None:
        offset = support_offset(scene, frame, thing.support_z_m, thing.vertices.mean(axis=0))
        standing = _within(points[..., :2], low, high)
        on_support = points[..., 2] < thing.support_z_m + offset + tuned(Params).on_support_m
        verdict = np.where(on_support, np.where(standing & near, 0.0, -1.0), verdict)  # its base is as low as the support
    coarse = max(frame.rgb_camera.width / camera.width / crop.shrink, 1.0)
    odds = np.where(patch > 0, verdict, 0.0) * (2.0 / np.sqrt(coarse))
    at = np.ix_(rows - first_row, columns - first_column)
    return np.asarray(cv2.blur(odds[at].astype(np.float32), (2 * round(coarse) + 1,) * 2))


def _within(points: np.ndarray, low: Vector3, high: Vector3) -> np.ndarray:
    """Mask of the points (..., axes) that lie between two corners along every axis."""
    axes = range(points.shape[-1])  # one axis at a time: numpy is slow along an axis of length three
    return np.asarray(np.logical_and.reduce([(points[..., k] > low[k]) & (points[..., k] < high[k]) for k in axes]))


def _depth_index(span: slice, cells: int, colour_size: int, depth_size: int) -> np.ndarray:
    """Depth row or column under the centre of each of the cells that a span of colour pixels is divided into."""
    at = span.start + (np.arange(cells) + 0.5) * (span.stop - span.start) / cells
    return (at * depth_size / colour_size).astype(int)


def _outline_odds(hull: Mask, band_px: float, attached_px: float) -> np.ndarray:
    """Log-odds by distance to the hull's outline: weak near it, and bounded where a handle may be (`attached_px` around it)."""
    params = tuned(Params)
    outside = cv2.distanceTransform((~hull).astype(np.uint8), cv2.DIST_L2, 5)
    inside = cv2.distanceTransform(np.pad(hull, 1).astype(np.uint8), cv2.DIST_L2, 5)[1:-1, 1:-1]
    deep = min(band_px, 0.5 * float(inside.max()))
    steps = np.where(hull, (inside - 0.5) / max(deep, 0.5), (0.5 - outside) / band_px)
    odds = np.clip(steps * (1 + steps**2 / 4), -params.attached_odds, params.sure_odds)
    odds[outside > attached_px] = -params.sure_odds
    return np.asarray(odds)


def _held_by(mask: Mask, hull: Mask) -> Mask:
    """Connected parts of a mask with more than 30 % of their pixels on the hull."""
    count, labels = cv2.connectedComponents(mask.astype(np.uint8), connectivity=4)
    total = np.bincount(labels.ravel(), minlength=count)
    within = np.bincount(labels[hull], minlength=count)
    kept = within > 0.3 * np.maximum(total, 1)
    kept[0] = False
    return np.asarray(kept[labels])


def _round(radius_px: float) -> np.ndarray:
    size = 2 * max(1, round(radius_px)) + 1
    return cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))


def splat(uv_px: Pixels, shape: tuple[int, int], spacing_px: float) -> np.ndarray:
    """Filled outline of points about `spacing_px` apart: the pixels covered by half or more."""
    fine = tuned(Params).fine
    height, width = shape[0] * fine, shape[1] * fine
    pad = fine * (int(spacing_px) + 2)
    canvas = np.zeros((height + 2 * pad, width + 2 * pad), np.uint8)
    column, row = (np.floor(fine * uv_px[:, axis]).astype(int) + pad for axis in (0, 1))
    inside = (column >= 0) & (row >= 0) & (column < canvas.shape[1]) & (row < canvas.shape[0])
    canvas[row[inside], column[inside]] = 1
    filled = cv2.morphologyEx(canvas, cv2.MORPH_CLOSE, _round(0.8 * fine * spacing_px))[pad:-pad, pad:-pad]
    covered = filled.reshape(shape[0], fine, shape[1], fine).sum(axis=(1, 3), dtype=np.int64)
    return np.asarray(2 * covered >= fine**2, np.uint8)


def _best_shift(hull: Mask, odds: np.ndarray, gradient: np.ndarray, reach_px: int) -> tuple[int, int]:
    """Shift (x, y) of the hull onto likely pixels and strong edges: the frame's pose error, zero where poses are right."""
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
    """Mean odds inside the hull minus those around it, per shift (dy, dx) up to `reach_px` (no shift at index `reach_px`)."""
    ring = (cv2.dilate(hull.astype(np.uint8), _round(0.15 * np.sqrt(hull.sum()))) > 0) & ~hull
    template = hull / max(hull.sum(), 1) - ring / max(ring.sum(), 1)
    padded = np.pad(odds.astype(np.float32), reach_px)
    return np.asarray(cv2.matchTemplate(padded, template.astype(np.float32), cv2.TM_CCORR))


def _moved(hull: Mask, shift: tuple[int, int]) -> Mask:
    move = np.array([[1, 0, shift[0]], [0, 1, shift[1]]], np.float32)
    return np.asarray(cv2.warpAffine(hull.astype(np.uint8), move, (hull.shape[1], hull.shape[0]), flags=cv2.INTER_NEAREST) > 0)
