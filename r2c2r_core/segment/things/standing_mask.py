"""Masks of floor-standing objects: a pixel cut over depth labels, and over colours where depth fails."""

from dataclasses import dataclass

import cv2
import numpy as np

from r2c2r_core.arrays import Mask, Pixels, Points
from r2c2r_core.geometry.camera import Intrinsics, depth_points, project, sample_through
from r2c2r_core.model.capture import Frame
from r2c2r_core.segment.occlusion import refine_border
from r2c2r_core.segment.scene import Scene
from r2c2r_core.segment.things.crops import shrunk
from r2c2r_core.segment.things.depth_cloud import clean_depth
from r2c2r_core.segment.things.pixel_cut import ColourModel, cut_pixels, learn_colours
from r2c2r_core.segment.things.silhouettes import splat
from r2c2r_core.segment.things.slab import height_of
from r2c2r_core.segment.things.standing import OFF, ON, UNKNOWN, Standing
from r2c2r_core.segment.things.support import raised
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of floor-standing objects' masks."""

    around_m: float = param(0.08, "m", "Margin of a crop around the object")
    cut_px: int = param(220, "px", "Maximum longer side of the image that is cut: legs are thin", ge=32)
    depth_odds: float = param(2.5, "log", "Log-odds of a depth pixel on the object")
    behind_odds: float = param(
        1.5, "log", "Log-odds against a depth pixel off the object: sensors lose thin parts to the background"
    )
    voxel_odds: float = param(
        2.0, "log", "Log-odds of a pixel that the object's voxels cover, and against one that they do not"
    )
    fades_m: float = param(
        0.05, "m", "Distance outside the voxels over which the log-odds fall to that bound: depth loses thin parts"
    )
    colour_gain: float = param(1.6, "ratio", "Weight of colour log-odds relative to small objects: parts have few colours")
    reach_m: float = param(0.04, "m", "Maximum distance of object pixels from its voxels and from the floor under them")
    far_odds: float = param(6.0, "log", "Log-odds against a pixel farther away")
    before_m: float = param(
        0.05, "m", "Minimum distance in front of the whole object, beyond the noise, for a pixel to be an occluder"
    )
    model_frames: int = param(12, "count", "Maximum number of frames that colours are learned from", ge=1)


@dataclass(frozen=True, slots=True, eq=False)
class _Crop:
    area: tuple[slice, slice]
    camera: Intrinsics
    scale: float
    voxels: Mask  # covered by the object's voxels
    on: Mask  # depth on the object
    off: Mask  # depth on something else
    reach: Mask  # between its voxels and the floor under them, where legs may be that no depth shows
    hidden: Mask  # depth on an occluder
    rgb: np.ndarray


def standing_colours(found: Standing, scene: Scene, frames: tuple[Frame, ...]) -> ColourModel | None:
    """Colour model of the object against its surroundings, from pixels where voxels and depth agree."""
    params = tuned(Params)
    some = frames[:: max(1, len(frames) // (3 * params.model_frames))]  # not all of them see it
    crops = [crop for frame in some if (crop := _crop_of(found, scene, frame)) is not None]
    samples = []
    for crop in crops[:: max(1, len(crops) // params.model_frames)]:
        near = cv2.dilate(crop.voxels.astype(np.uint8), np.ones((9, 9), np.uint8)) > 0
        off = ~near if found.top is None else ~near | crop.off  # objects on a slab lie in front of it
        samples.append((cv2.cvtColor(crop.rgb, cv2.COLOR_RGB2LAB), crop.on & crop.voxels, off & ~crop.hidden))
    return learn_colours(samples) if samples else None


def standing_mask(found: Standing, scene: Scene, frame: Frame) -> tuple[Mask, float]:
    """Visible pixels of the object in a frame, and the fraction of its voxels that nothing hides."""
    params = tuned(Params)
    mask = np.zeros((frame.rgb_camera.height, frame.rgb_camera.width), bool)
    crop = _crop_of(found, scene, frame)
    if crop is None:
        return mask, 0.0
    share = 1 - float((crop.voxels & crop.hidden).sum() / max(crop.voxels.sum(), 1))
    odds = params.depth_odds * crop.on.astype(np.float32) - params.behind_odds * crop.off.astype(np.float32)
    odds = cv2.blur(odds, (3, 3))
    outside = cv2.distanceTransform((~crop.voxels).astype(np.uint8), cv2.DIST_L2, 5)
    odds += np.where(
        crop.voxels, params.voxel_odds, -params.voxel_odds * np.minimum(outside / (params.fades_m * crop.scale + 1), 1.0)
    )
    if found.thing.colours is not None:
        odds += params.colour_gain * found.thing.colours.odds(cv2.cvtColor(crop.rgb, cv2.COLOR_RGB2LAB))
    odds[~crop.reach] = -params.far_odds
    odds[crop.hidden & ~crop.on] -= params.far_odds
    small = cut_pixels(crop.rgb, odds, params.cut_px)
    photo = scene.balanced(frame.index)[crop.area]
    height, width = photo.shape[:2]
    grown = np.asarray(cv2.resize(small.astype(np.float32), (width, height), interpolation=cv2.INTER_LINEAR) > 0.5)
    cell = max(height, width) / min(params.cut_px, max(small.shape))
    mask[crop.area] = refine_border(photo, grown, max(1, round(0.6 * cell))) if cell > 1.5 else grown
    return mask, share


def _crop_of(found: Standing, scene: Scene, frame: Frame) -> _Crop | None:
    params = tuned(Params)
    camera = frame.rgb_camera
    lift = found.region.lift(scene, frame)
    local = frame.world_from_camera.inverse.apply(raised(found.thing.vertices, lift))
    local = local[local[:, 2] > 0.15]
    if len(local) < 0.3 * len(found.thing.vertices):
        return None
    uv = project(local, camera)
    inside = ((uv >= 0) & (uv < [camera.width, camera.height])).all(axis=1)
    if inside.sum() < 20:
        return None
    uv, local = uv[inside], local[inside]
    scale = camera.fx / float(np.median(local[:, 2]))
    pad = params.around_m * scale + 6
    left, top = (int(v) for v in np.maximum(uv.min(axis=0) - pad, 0))
    right, bottom = (int(v) for v in np.minimum(uv.max(axis=0) + pad, [camera.width, camera.height]))
    if right - left < 8 or bottom - top < 8:
        return None
    area = (slice(top, bottom), slice(left, right))
    small = shrunk(camera, area)
    shrink = (right - left) / small.width
    voxels = splat(project(local, small), (small.height, small.width), found.size_m * scale / shrink) > 0
    reach = _hull_of(project(_with_feet(found, frame, lift), small), small, params.reach_m * scale / shrink)
    label, nearer = _depth_labels(found, scene, frame, small, lift)
    part = scene.balanced(frame.index)[area]
    rgb = cv2.resize(part, (small.width, small.height), interpolation=cv2.INTER_AREA)
    return _Crop(area, small, scale / shrink, voxels, label == ON, label == OFF, reach, nearer, np.asarray(rgb))


def _with_feet(found: Standing, frame: Frame, lift_m: float) -> Points:
    """Camera-frame points of the object's voxels and of the floor under them, in front of the camera."""
    voxels = found.thing.vertices[::3]
    feet = np.column_stack([voxels[:, :2], np.full(len(voxels), found.thing.support_z_m or 0.0)])
    local = frame.world_from_camera.inverse.apply(raised(np.concatenate([voxels, feet]), lift_m))
    return local[local[:, 2] > 0.15]


def _hull_of(uv_px: Pixels, camera: Intrinsics, margin_px: float) -> Mask:
    """Convex hull of pixels, dilated by a margin."""
    canvas = np.zeros((camera.height, camera.width), np.uint8)
    outline = cv2.convexHull(np.clip(uv_px, -(2**14), 2**14).astype(np.float32).round().astype(np.int32))
    cv2.fillConvexPoly(canvas, outline, 1)
    cv2.polylines(canvas, [outline], True, 1, thickness=max(1, 2 * round(margin_px)))
    return canvas > 0


def _depth_labels(found: Standing, scene: Scene, frame: Frame, camera: Intrinsics, lift: float) -> tuple[np.ndarray, Mask]:
    """Labels of a crop's pixels by depth, and the mask of pixels in front of the object."""
    depth = clean_depth(scene.depth(frame.index))
    world = raised(frame.world_from_camera.apply(depth_points(depth, frame.depth_camera).reshape(-1, 3)), -lift)
    label = np.where(depth.ravel() > 0, found.label_of(world), UNKNOWN).reshape(depth.shape).astype(np.uint8)
    nearest = float(np.quantile(frame.world_from_camera.inverse.apply(found.thing.vertices)[:, 2], 0.02))
    nearer = (label == OFF) & scene.noise.occluded(depth, nearest, tuned(Params).before_m)
    if found.top is not None:
        nearer |= (label == OFF) & (world[:, 2] > height_of(found.top, world)).reshape(depth.shape)
    label, inside = sample_through(label, frame.depth_camera, camera)
    nearer, _ = sample_through(nearer, frame.depth_camera, camera)
    return np.where(inside, label, UNKNOWN), inside & nearer
