"""Visibility of a projected surface in one frame: per-pixel depth test, with a colour watershed at an occluder's border."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from r2c2r_core.arrays import Image, Mask, Pixels, Points, Vector3
from r2c2r_core.geometry.camera import Intrinsics, project, ray_slopes
from r2c2r_core.geometry.masks import box_around
from r2c2r_core.model.capture import Frame
from r2c2r_core.model.inputs import PromptPoint
from r2c2r_core.segment.holes import find_hole
from r2c2r_core.segment.scene import Scene
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the visibility test."""

    near_m: float = param(0.08, "m", "Distance of the near plane at which polygons are clipped")
    confirm_m: float = param(0.03, "m", "Maximum distance of depth from a side of a carcass, beyond the noise, to confirm it")


@dataclass(frozen=True, slots=True, kw_only=True)
class Tolerance:
    """Maximum distance of depth from the model beyond its noise, metres."""

    front_m: float = 0.06  # handles protrude by up to 5 cm
    behind_m: float = 0.06
    fused: bool = True  # whether the fused surface replaces missing sensor depth: not for moved objects


@dataclass(frozen=True, slots=True, eq=False)
class Facet:
    """A flat convex polygon in the world. A facet to `confirm` is drawn only where depth agrees with it."""

    corners_world: Points
    confirm: bool = False

    @property
    def normal(self) -> Vector3:
        """Unit normal."""
        normal = np.cross(self.corners_world[1] - self.corners_world[0], self.corners_world[2] - self.corners_world[0])
        return np.asarray(normal / np.linalg.norm(normal))


def visible_mask(facets: list[Facet], scene: Scene, frame: Frame, tolerance: Tolerance | None = None) -> tuple[Mask, float]:
    """Unoccluded pixels of the facets, at RGB resolution, and the visible fraction of their projection."""
    tolerance = tolerance or Tolerance()
    camera = frame.rgb_camera
    total = np.zeros((camera.height, camera.width), bool)
    projected = visible = 0
    for facet in facets:
        outline = project_polygon(facet.corners_world, frame, camera)
        if outline is None:
            continue
        box = _bounds(outline, camera, margin=8)
        if box is None:
            continue
        inside = fill_polygon(outline, box)
        if not inside.any():
            continue
        shown = _shown(inside, box, facet, scene, frame, tolerance)
        projected += int(inside.sum()) if not facet.confirm else 0
        visible += int(shown.sum()) if not facet.confirm else 0
        left, top, right, bottom = box
        total[top:bottom, left:right] |= shown
    return total, visible / projected if projected else float(total.any())


def _shown(
    inside: Mask, box: tuple[int, int, int, int], facet: Facet, scene: Scene, frame: Frame, tolerance: Tolerance
) -> Mask:
    model = _plane_depth(frame, frame.rgb_camera, box, facet.corners_world[0], facet.normal)
    sensor, seen = _crop_depths(scene, frame, box)
    if facet.confirm:
        return inside & _smoothed(scene.noise.agrees(seen, model, tuned(Params).confirm_m), scene, frame)
    # The fused surface shows the background through holes from glass and gloss: only the sensor may say "behind".
    behind = scene.noise.seen_through(sensor, model, tolerance.behind_m)
    hidden = scene.noise.occluded(seen if tolerance.fused else sensor, model, tolerance.front_m) | behind
    hidden = _smoothed(hidden, scene, frame)
    if not (hidden & inside).any():
        return inside
    if (hidden | ~inside).all():
        return np.zeros_like(inside)
    left, top, right, bottom = box
    band = max(2, round(1.5 * frame.rgb_camera.width / frame.depth_camera.width))
    refined = refine_border(scene.rgb(frame.index)[top:bottom, left:right], inside & ~hidden, band, within=inside)
    return refined


def refine_border(rgb: Image, mask: Mask, band_px: int, *, within: Mask | None = None) -> Mask:
    """Mask with its border moved to the strongest colour edge within `band_px`; nothing is added outside `within`."""
    solid = mask.astype(np.uint8)
    element = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * band_px + 1, 2 * band_px + 1))
    outer = np.ones_like(mask) if within is None else within
    # Pixels beyond the outline belong to neither side: they must not erode the mask there.
    padded = np.where(outer, solid, 1).astype(np.uint8) if within is not None else solid
    sure = cv2.erode(padded, element, borderType=cv2.BORDER_REPLICATE) > 0
    sure &= mask
    not_sure = cv2.dilate(solid, element) > 0
    markers = np.zeros(mask.shape, np.int32)
    markers[sure] = 1
    markers[outer & ~not_sure] = 2
    if not (markers == 1).any() or not (markers == 2).any():
        return mask
    return np.asarray((flood(colour_gradient(rgb), markers, outer) == 1) & outer)


def seeded(mask: Mask, clicks: Sequence[PromptPoint], scene: Scene, frame: Frame) -> Mask:
    """Mask with all positive clicks in its frame and no negative one: a watershed grows from those on its wrong side.

    It may reach as far as their own side, and over the hole in the depth image that they lie in, but not past colour edges.
    """
    own = [(int(click.x), int(click.y), click) for click in clicks if click.frame == frame.index]
    wrong = [(x, y, click) for x, y, click in own if mask[y, x] != (click.label == 1)]
    if not wrong:
        return mask
    free = np.zeros(mask.shape, np.uint8)
    for x, y, click in wrong:
        others = (mask != (click.label == 1)).astype(np.uint8)
        away = 0 if others.all() else int(cv2.distanceTransform(others, cv2.DIST_L2, 5)[y, x])
        cv2.circle(free, (x, y), away + 2, 1, -1)
        hole = find_hole(frame, scene.depth(frame.index), click.x, click.y)
        free |= others & at_size(hole, mask) if hole is not None else 0
    markers = np.where(free > 0, 0, np.where(mask, 1, 2)).astype(np.int32)
    for x, y, click in own:
        markers[y, x] = 1 if click.label == 1 else 2
    return np.asarray(flood(colour_gradient(scene.rgb(frame.index)), markers) == 1)


def at_size(flags: Mask, mask: Mask) -> Mask:
    """Flags of the depth image at the size of a mask."""
    return cv2.resize(flags.astype(np.uint8), mask.shape[::-1], interpolation=cv2.INTER_NEAREST) > 0


def flood(ridges: np.ndarray, markers: np.ndarray, within: Mask | None = None) -> np.ndarray:
    """Watershed labels: marked regions grow over the unmarked (0) pixels of `within` until they meet on the ridges.

    Equals skimage's watershed, at the cost of the unmarked pixels alone: skimage queues all marked pixels, though only those at
    the rim can grow.
    """
    from skimage.segmentation import watershed

    free = markers == 0 if within is None else (markers == 0) & within
    if not free.any():
        return markers
    area = box_around(free, 1)
    rim = cv2.dilate(free[area].astype(np.uint8), cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))) > 0
    if within is not None:
        rim &= within[area]
    labels = markers.copy()
    grown = watershed(ridges[area], np.where(rim, markers[area], 0), mask=rim)
    labels[area] = np.where(rim, grown, markers[area])
    return labels


def colour_gradient(rgb: Image) -> np.ndarray:
    """Maximum Sobel magnitude over the Lab channels."""
    lab = cv2.GaussianBlur(cv2.cvtColor(rgb, cv2.COLOR_RGB2LAB), (0, 0), 1.0).astype(np.float32)
    dx, dy = cv2.Sobel(lab, cv2.CV_32F, 1, 0), cv2.Sobel(lab, cv2.CV_32F, 0, 1)
    return np.asarray(np.sqrt(dx**2 + dy**2).max(axis=2))


def project_polygon(corners_world: Points, frame: Frame, camera: Intrinsics) -> Pixels | None:
    """Outline in continuous pixels of a world polygon, clipped at the near plane; None when it is behind."""
    params = tuned(Params)
    corners = frame.world_from_camera.inverse.apply(corners_world)
    clipped = []
    for current, following in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        if current[2] >= params.near_m:
            clipped.append(current)
        if (current[2] >= params.near_m) != (following[2] >= params.near_m):
            t = (params.near_m - current[2]) / (following[2] - current[2])
            clipped.append(current + t * (following - current))
    if len(clipped) < 3:
        return None
    return project(np.stack(clipped), camera)


def fill_polygon(outline_px: Pixels, box: tuple[int, int, int, int]) -> Mask:
    """Mask of the pixels of a box (left, top, right, bottom) inside an outline given in continuous coordinates."""
    left, top, right, bottom = box
    canvas = np.zeros((bottom - top, right - left), np.uint8)
    points = np.clip((outline_px - [left + 0.5, top + 0.5]) * 16, -(2**20), 2**20)
    cv2.fillPoly(canvas, [np.round(points).astype(np.int32)], 1, shift=4)
    return canvas > 0


def _bounds(outline_px: Pixels, camera: Intrinsics, margin: int) -> tuple[int, int, int, int] | None:
    low, high = outline_px.min(axis=0), outline_px.max(axis=0)
    left, top = max(int(max(low[0], 0)) - margin, 0), max(int(max(low[1], 0)) - margin, 0)
    right = min(int(min(high[0], camera.width)) + margin + 1, camera.width)
    bottom = min(int(min(high[1], camera.height)) + margin + 1, camera.height)
    if high[0] <= 0 or high[1] <= 0 or low[0] >= camera.width or low[1] >= camera.height or right <= left or bottom <= top:
        return None
    return left, top, right, bottom


def _plane_depth(
    frame: Frame, camera: Intrinsics, box: tuple[int, int, int, int], point: Vector3, normal: Vector3
) -> np.ndarray:
    left, top, right, bottom = box
    seen = frame.world_from_camera.inverse
    local_normal, local_point = seen.rotation @ normal, seen.apply(point)
    x, y = ray_slopes(np.arange(left, right), np.arange(top, bottom), camera)
    slope = x[None] * local_normal[0] + y[:, None] * local_normal[1] + local_normal[2]
    with np.errstate(divide="ignore"):
        z = (local_point @ local_normal) / slope
    return np.where(np.isfinite(z) & (z > 0), z, 1e3).astype(np.float32)


def _crop_depths(scene: Scene, frame: Frame, box: tuple[int, int, int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Sensor depth, and the same filled from the fused surface, at the colour pixels of a box."""
    left, top, right, bottom = box
    sensor, filled = scene.depth(frame.index), scene.filled_depth(frame.index)
    column = ((np.arange(left, right) + 0.5) * filled.shape[1] / frame.rgb_camera.width).astype(int)
    row = ((np.arange(top, bottom) + 0.5) * filled.shape[0] / frame.rgb_camera.height).astype(int)
    area = np.ix_(row, column)
    return sensor[area], filled[area]


def _smoothed(flags: Mask, scene: Scene, frame: Frame) -> Mask:
    """Flags with the steps of coarse depth pixels smoothed, and single pixels removed."""
    size = max(3, 2 * round(frame.rgb_camera.width / scene.depth(frame.index).shape[1]) + 1)
    return np.asarray(cv2.blur(flags.astype(np.float32), (size, size)) > 0.5)
