"""Image edges of a box: colour changes across its projected edges, as candidates (edge-based tracking, RAPiD; Harris 1990).

A box is (7,): yaw in radians, then left, right, front, back, bottom, top in metres, in the frame of its initial front:
+X right, +Y back, +Z up, rotated about the origin by the yaw.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np

from r2c2r_core.arrays import DepthMetres, Image, Points
from r2c2r_core.geometry.camera import Intrinsics, project
from r2c2r_core.geometry.transforms import Rigid3, rotation_about_z
from r2c2r_core.geometry.visibility import DepthNoise
from r2c2r_core.model.capture import Frame
from r2c2r_core.segment.scene import Scene
from r2c2r_core.tuning import param, tuned

YAW, LEFT, RIGHT, FRONT, BACK, BOTTOM, TOP = range(7)
"""Places of a box's parameters."""

_PARTS, _SAMPLES = 3, 10  # per edge, and per part: a rotated edge shows in its parts
_STEP_PX = 0.5  # along the profile across an edge
_SMOOTH = np.array([1.0, 2.0, 3.0, 2.0, 1.0]) / 9.0  # over those steps: a pixel to either side
_MOST_PEAKS = 6  # per profile


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the box edges in photographs."""

    beside_m: float = param(0.02, "m", "Minimum distance of a camera beyond a face's plane to see the face")
    shortest_px: float = param(10.0, "px", "Minimum length of a third of an edge: shorter ones have no direction")
    in_view: float = param(0.6, "share", "Minimum unoccluded fraction of the samples of an edge part")
    hidden_m: float = param(0.05, "m", "Minimum distance of depth in front of an edge, beyond its noise, for an occluder")
    least_contrast: float = param(
        3.0,
        "grey",
        "Minimum CIELAB change over two pixels, averaged along a part, for an edge candidate",
        source="twice the change that image noise of 3 levels leaves",
    )
    usual_contrast: float = param(5.0, "grey", "Contrast at which an edge candidate is as likely the box's as not")
    outlier: float = param(
        0.15,
        "ratio",
        "Likelihood that no peak is the box's edge, relative to a peak exactly on it",
        source="0.05 to 0.15 give the same boxes of three sample kitchens",
    )
    pixel_px: float = param(1.0, "px", "Standard deviation of an edge's position in a photograph: blur and pose error")


class Photo(NamedTuple):
    """A frame in which the box is visible."""

    lab: Image
    camera: Intrinsics
    depth_m: DepthMetres  # of the same view; 0 where unknown
    world_from_camera: Rigid3
    noise: DepthNoise


class EdgeView(NamedTuple):
    """Edge candidates in one photograph across the parts of a box's edges (m parts)."""

    camera: Intrinsics
    camera_from_front: Rigid3
    parts: np.ndarray  # (m,) indices among all edge parts
    uv_px: np.ndarray  # (m, 2, 2) their initial end points
    normals: np.ndarray  # (m, 2) across them
    metres_per_px: np.ndarray  # (m,)
    peaks_px: np.ndarray  # (m, k) positions of colour changes, along the normals
    contrasts: np.ndarray  # (m, k), 0 where there is no such peak


class Association(NamedTuple):
    """Expected positions of one view's edge parts over their candidates (the expectation step)."""

    target_px: np.ndarray  # (m,)
    weight: np.ndarray  # (m,) 1/px: square root of the probability that a candidate is the edge, over its spread
    gain: np.ndarray  # (m,) log-likelihood ratio over no candidate being the edge


def photo_of(scene: Scene, frame: Frame) -> Photo:
    """Photo of a frame, in CIELAB, with its depth."""
    lab = cv2.cvtColor(scene.rgb(frame.index), cv2.COLOR_RGB2LAB)
    return Photo(lab, frame.rgb_camera, scene.filled_depth(frame.index), frame.world_from_camera, scene.noise)


def look_across(box: np.ndarray, photos: Sequence[Photo], world_from_front: Rigid3, reach_m: float) -> list[EdgeView]:
    """Edge candidates per photograph within `reach_m` of the box's visible edges; photographs without any are left out."""
    views = (_look(box, photo, photo.world_from_camera.inverse @ world_from_front, reach_m) for photo in photos)
    return [view for view in views if view is not None]


def displacements(parts: Points, view: EdgeView) -> np.ndarray:
    """Displacements (m,) of the middles of a box's `edge_parts` from their initial positions, along the normals, px."""
    ends = parts[view.parts].reshape(-1, 3)
    uv_px = project(view.camera_from_front.apply(ends), view.camera).reshape(-1, 2, 2)
    return np.asarray((((uv_px - view.uv_px).mean(axis=1)) * view.normals).sum(axis=1))


def associate(offset_px: np.ndarray, view: EdgeView, spread_m: float) -> Association:
    """Expectation step for parts at these displacements: candidates by contrast and distance, or none of them (outlier)."""
    params = tuned(Params)
    scale = view.metres_per_px
    sigma_px = np.hypot(spread_m / scale, params.pixel_px)
    away = (offset_px[:, None] - view.peaks_px) / sigma_px[:, None]
    likelihood = view.contrasts / (view.contrasts + params.usual_contrast) * np.exp(-0.5 * away**2)
    total = likelihood.sum(axis=1)
    chance = total / (total + params.outlier)
    target = (likelihood * view.peaks_px).sum(axis=1) / np.maximum(total, 1e-12)
    return Association(target, np.sqrt(chance) / sigma_px, np.log1p(total / params.outlier))


def shares(views: Sequence[EdgeView], independent: float) -> list[np.ndarray]:
    """Weights (m,) of each view's parts: a part seen in more than `independent` photographs counts as that many.

    A line beside the edge misleads all photographs alike, so their errors are correlated.
    """
    count = np.bincount(np.concatenate([np.zeros(0, int), *(view.parts for view in views)]), minlength=1)
    return [np.minimum(independent / count[view.parts], 1.0) for view in views]


def hidden(photo: Photo, uv_px: np.ndarray, z_m: np.ndarray) -> np.ndarray:
    """Mask of the points in front of which the photo's depth shows an occluder."""
    params = tuned(Params)
    rows, columns = photo.depth_m.shape
    row = np.clip(uv_px[..., 1] * rows / photo.camera.height, 0, rows - 1).astype(int)
    column = np.clip(uv_px[..., 0] * columns / photo.camera.width, 0, columns - 1).astype(int)
    return photo.noise.occluded(photo.depth_m[row, column], z_m, params.hidden_m)


def _look(box: np.ndarray, photo: Photo, camera_from_front: Rigid3, reach_m: float) -> EdgeView | None:
    params = tuned(Params)
    faced = _faced(box, camera_from_front)
    ends = edge_parts(box)
    local = camera_from_front.apply(ends.reshape(-1, 3)).reshape(ends.shape)
    if not faced.any() or local[..., 2].min() < 0.2:
        return None
    uv = project(local.reshape(-1, 3), photo.camera).reshape(-1, 2, 2)
    along = uv[:, 1] - uv[:, 0]
    length = np.linalg.norm(along, axis=1)
    metres_per_px = local[..., 2].mean(axis=1) / photo.camera.fx
    margin = reach_m / metres_per_px[:, None] + 2.0
    inside = ((uv.min(axis=1) > margin) & (uv.max(axis=1) < [photo.camera.width, photo.camera.height] - margin)).all(axis=1)
    share = (np.arange(_SAMPLES) + 0.5) / _SAMPLES
    samples = uv[:, None, 0] + share[:, None] * along[:, None]
    z = local[:, None, 0, 2] + share * (local[:, 1, 2] - local[:, 0, 2])[:, None]
    shown = ~hidden(photo, samples, z)
    parts = np.flatnonzero(faced & inside & (length > params.shortest_px) & (shown.mean(axis=1) > params.in_view))
    if not len(parts):
        return None
    normals = np.stack([-along[parts, 1], along[parts, 0]], axis=1) / length[parts, None]
    steps = int(np.ceil(reach_m / metres_per_px[parts].min() / _STEP_PX))
    offsets = np.arange(-steps - 4, steps + 5) * _STEP_PX
    contrast = _contrasts(photo.lab, samples[parts], normals, shown[parts], offsets)
    peaks, contrasts = _peaks(contrast, offsets, reach_m / metres_per_px[parts], params.least_contrast)
    return EdgeView(photo.camera, camera_from_front, parts, uv[parts], normals, metres_per_px[parts], peaks, contrasts)


def _contrasts(lab: Image, samples: np.ndarray, normals: np.ndarray, shown: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    """Colour change over two pixels (m, offsets) along the normals, averaged over each part's visible samples."""
    at = samples[:, :, None] + offsets[:, None] * normals[:, None, None] - 0.5
    u, v = (np.ascontiguousarray(at[..., k].reshape(len(at), -1), dtype=np.float32) for k in (0, 1))
    colours = cv2.remap(lab, u, v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE).reshape(*at.shape[:3], 3)
    share = shown / shown.sum(axis=1, keepdims=True)
    mean = np.einsum("msdc,ms->mdc", colours.astype(np.float64), share)
    smooth = np.sum([weight * np.roll(mean, k - 2, axis=1) for k, weight in enumerate(_SMOOTH)], axis=0)
    change = np.zeros(mean.shape[:2])
    change[:, 2:-2] = np.linalg.norm(smooth[:, 4:] - smooth[:, :-4], axis=2)
    return change


def _peaks(contrast: np.ndarray, offsets: np.ndarray, reach_px: np.ndarray, least: float) -> tuple[np.ndarray, np.ndarray]:
    """Subsample positions and heights (m, k) of the highest peaks of each profile; height 0 where there are fewer."""
    before, at, after = contrast[:, :-2], contrast[:, 1:-1], contrast[:, 2:]
    is_peak = (at > before) & (at >= after) & (at > least) & (np.abs(offsets[1:-1]) <= reach_px[:, None])
    is_peak[:, :3] = is_peak[:, -3:] = False  # wrapped around from the other end
    height = np.where(is_peak, at, 0.0)
    order = np.argsort(-height, axis=1, kind="stable")[:, :_MOST_PEAKS]
    bend = before - 2 * at + after
    shift = np.where(bend < 0, 0.5 * (before - after) / np.where(bend < 0, bend, -1.0), 0.0)
    place = offsets[1:-1] + shift * _STEP_PX
    return np.take_along_axis(place, order, axis=1), np.take_along_axis(height, order, axis=1)


def _faced(box: np.ndarray, camera_from_front: Rigid3) -> np.ndarray:
    """Mask of the edge parts that bound a face towards the camera; none of a box seen from behind."""
    params = tuned(Params)
    x, y, z = camera_from_front.inverse.translation @ rotation_about_z(float(box[YAW]))
    front, above = y < box[FRONT] - params.beside_m, z > box[TOP] + params.beside_m
    left, right = x < box[LEFT] - params.beside_m, x > box[RIGHT] + params.beside_m
    edges = [front, front, front and left, front and right, front, front and above]
    return np.repeat([*edges, front and (above or left), front and (above or right)], _PARTS)


def edge_parts(box: np.ndarray) -> Points:
    """End points (8 edges x parts, 2, 3) in the front's frame of the edge parts compared with photographs.

    Upright: front left and right, back left and right. Level: top front, back, left and right. The bottom edges lie in shadow.
    """
    yaw, left, right, front, back, bottom, top = box
    low = bottom + 0.05 * (top - bottom)
    upright = [((x, y, low), (x, y, top)) for y in (front, back) for x in (left, right)]
    level = [((left, y, top), (right, y, top)) for y in (front, back)] + [
        ((x, front, top), (x, back, top)) for x in (left, right)
    ]
    ends = np.array([*upright, *level]) @ rotation_about_z(float(yaw)).T
    share = np.linspace(0.03, 0.97, _PARTS + 1)[:, None]
    points = ends[:, None, 0] + share * (ends[:, 1] - ends[:, 0])[:, None]
    return np.stack([points[:, :-1], points[:, 1:]], axis=2).reshape(-1, 2, 3)
