"""Observation of one object for placement: a few small views centred on it, and its cleaned points."""

from dataclasses import dataclass

import cv2
import numpy as np

from r2c2r_core.align.cleaning import main_body, thin_out
from r2c2r_core.align.view import View, known_corners, look_at, mask_box, unit
from r2c2r_core.arrays import Mask, Points, Vector3
from r2c2r_core.geometry.camera import pixel_centres, sample_through, unproject
from r2c2r_core.geometry.masks import unpack_mask
from r2c2r_core.geometry.views import MaskView, choose_views, stands_open
from r2c2r_core.geometry.visibility import DepthNoise
from r2c2r_core.model.capture import Capture, Depth, Frame
from r2c2r_core.model.track import MaskTrack
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned accuracy of meshes."""

    mesh_m: float = param(
        0.004,
        "m",
        "Median distance from scan to mesh, part of the expected depth residual",
        source="measured over the sample kitchens (benchmarks/baseline.json)",
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Observation:
    """Evidence against which a placement is scored."""

    views: tuple[View, ...]
    points_world: Points
    towards_camera: Points  # unit, per point
    noise_m: np.ndarray  # per point
    frame_index: np.ndarray  # per point, int
    centre_world: Vector3
    size_m: float  # diagonal of the visible part, from the points or from the masks at the points' distance


def observe(capture: Capture, track: MaskTrack, *, view_count: int, size_px: int, point_count: int) -> Observation:
    """Views from different sides with their pixels and points."""
    found = {
        frame: masked_points(frame, capture.images.depth(frame.index), unpack_mask(track.masks[frame.index]))
        for frame in choose_frames(capture, track, view_count)
    }
    frames = _in_one_state(found, track)
    points, towards, noise, seen_in = [np.zeros((0, 3))], [np.zeros((0, 3))], [np.zeros(0)], [np.zeros(0, np.int64)]
    for frame in frames:
        points.append(frame.world_from_camera.apply(found[frame]))
        towards.append(unit(frame.world_from_camera.translation - points[-1]))
        noise.append(placing_noise(capture.depth_noise, found[frame][:, 2]))
        seen_in.append(np.full(len(points[-1]), frame.index))
    all_points = np.concatenate(points)
    keep = main_body(all_points)
    all_points = all_points[keep]
    centre = _centre(all_points, track)
    views = tuple(look_at(capture, track, frame, centre, size_px) for frame in frames)
    size = max(float(np.linalg.norm(np.ptp(all_points, axis=0))) if len(all_points) else 0.0, _silhouette_size(views, centre))
    chosen = thin_out(all_points, point_count)
    return Observation(
        views=views,
        points_world=all_points[chosen],
        towards_camera=np.concatenate(towards)[keep][chosen],
        noise_m=np.concatenate(noise)[keep][chosen],
        frame_index=np.concatenate(seen_in)[keep][chosen],
        centre_world=centre,
        size_m=size,
    )


def _silhouette_size(views: tuple[View, ...], centre: Vector3) -> float:
    """Diagonal of the masks at the object's distance: dark glass returns no depth, but has a silhouette."""
    boxes = np.array([mask_box(v) for v in views]).reshape(-1, 4)
    distance = np.array([np.linalg.norm(v.world_from_camera.translation - centre) for v in views])
    return float(np.median(np.hypot(boxes[:, 2] - boxes[:, 0], boxes[:, 3] - boxes[:, 1]) * distance)) if len(views) else 0.0


def placing_noise(noise: DepthNoise, depth_m: np.ndarray) -> np.ndarray:
    """Expected standard deviation between depth and a correctly placed mesh, metres: noise of both."""
    return np.hypot(noise.sigma(depth_m), tuned(Params).mesh_m)


def choose_frames(capture: Capture, track: MaskTrack, count: int) -> tuple[Frame, ...]:
    """Up to `count` frames with large, complete, sharp masks, spread over the viewing directions."""
    known = [f for f in capture.frames if f.index in track.masks]
    known = [f for f in known if f.index not in track.opened_frames] or known  # with the leaf open, its front is elsewhere
    largest = max((track.masks[f.index].area_px for f in known), default=0)
    known = [f for f in known if track.masks[f.index].area_px >= max(48.0, 0.08 * largest)]
    if not known:
        return ()
    target = _rough_centre(capture, track, max(known, key=lambda f: track.masks[f.index].area_px))
    views = [
        MaskView(
            frame_index=frame.index,
            mask=track.masks[frame.index],
            sharpness=frame.sharpness,
            confidence=track.confidence.get(frame.index, 1.0),
            from_object=frame.world_from_camera.translation - target,
        )
        for frame in known
    ]
    chosen = {view.frame_index for view in choose_views(views, count)}
    return tuple(frame for frame in known if frame.index in chosen)


def _in_one_state(found: dict[Frame, Points], track: MaskTrack) -> tuple[Frame, ...]:
    """Frames that show a front where it was measured, not open; all frames, where none do or there is no front."""
    if track.front is None:
        return tuple(found)
    front_from_world = track.front.world_from_front.inverse
    closed = [
        frame
        for frame, points in found.items()
        if not stands_open(-front_from_world.apply(frame.world_from_camera.apply(points))[:, 1])
    ]
    return tuple(closed or found)


def masked_points(frame: Frame, depth: Depth, mask: Mask) -> Points:
    """Camera-frame points of the depth pixels well inside the mask; depth is used at its own resolution."""
    if not mask.any():
        return np.zeros((0, 3))
    per_depth_px = mask.shape[1] / frame.depth_camera.width
    thickness = 2.0 * float(cv2.distanceTransform(mask.astype(np.uint8), cv2.DIST_L2, 3).max())
    margin = min(per_depth_px, 0.15 * thickness)  # the centre of a thin bottle must remain
    inner = cv2.distanceTransform(np.pad(mask, 1).astype(np.uint8), cv2.DIST_L2, 3)[1:-1, 1:-1] > margin
    hit, within = sample_through(inner, frame.rgb_camera, frame.depth_camera)
    valid = hit & within & depth.valid & (depth.metres > 0)
    return unproject(pixel_centres(frame.depth_camera)[valid], depth.metres[valid].astype(np.float64), frame.depth_camera)


def _rough_centre(capture: Capture, track: MaskTrack, frame: Frame) -> Vector3:
    """Initial estimate of the object's position, before its points are gathered."""
    known = known_corners(track)
    if len(known):
        return np.asarray(known.mean(axis=0))
    points = masked_points(frame, capture.images.depth(frame.index), unpack_mask(track.masks[frame.index]))
    if not len(points):
        return np.asarray(frame.world_from_camera.apply(np.array([0.0, 0.0, 1.0])))
    return np.asarray(frame.world_from_camera.apply(np.median(points, axis=0)))


def _centre(points: Points, track: MaskTrack) -> Vector3:
    """Centre of the visible points, or of the measured box without points."""
    if len(points):
        return np.asarray((np.quantile(points, 0.02, axis=0) + np.quantile(points, 0.98, axis=0)) / 2)
    known = known_corners(track)
    return np.asarray(known.mean(axis=0)) if len(known) else np.zeros(3)
