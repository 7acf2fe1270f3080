"""Image edges of a box: colour changes across its projected edges, each a candidate (edge-based tracking, RAPiD; Harris 1990).

A box is (7,): yaw in radians, then left, right, front, back, bottom, top in metres, in the frame of its front as first thought:
+X right, +Y back, +Z up, turned about the origin by the yaw.
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

_PARTS, _SAMPLES = 3, 10  # of an edge, and of a part: a turned edge shows in its parts
_STEP_PX = 0.5  # along the profile across an edge
_SMOOTH = np.array([1.0, 2.0, 3.0, 2.0, 1.0]) / 9.0  # over those steps: a pixel to either side
_MOST_PEAKS = 6  # of a profile


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Which edges of a box a photograph is asked for, and what counts as a change of colour."""

    beside_m: float = param(0.02, "m", "a camera this far beyond a face's plane sees the face")
    shortest_px: float = param(10.0, "px", "a third of an edge that is shorter has no direction")
    in_view: float = param(0.6, "share", "of the samples of a part that nothing hides")
    hidden_m: float = param(0.05, "m", "depth nearer by more, beyond its noise, belongs to something in front")
    least_contrast: float = param(
        3.0,
        "grey",
        "change of CIELAB over two pixels, mean along a part",
        source="twice what image noise of 3 levels leaves of it",
    )
    usual_contrast: float = param(5.0, "grey", "the same of an edge that is as likely the box's as not")
    outlier: float = param(
        0.15,
        "ratio",
        "likelihood that no peak is the box's edge, to that of one at its very place",
        source="0.05 to 0.15 give the same boxes of three sample kitchens",
    )
    pixel_px: float = param(1.0, "px", "standard deviation of an edge in a photograph: blur and pose error")


class Photo(NamedTuple):
    """A frame in which the box stands."""

    lab: Image
    camera: Intrinsics
    depth_m: DepthMetres  # of the same view; 0 where unknown
    world_from_camera: Rigid3
    noise: DepthNoise


class EdgeView(NamedTuple):
    """What one photograph shows across the parts of a box's edges (m parts)."""

    camera: Intrinsics
    camera_from_front: Rigid3
    parts: np.ndarray  # (m,) which of all parts of edges
    uv_px: np.ndarray  # (m, 2, 2) their ends as first thought
    normals: np.ndarray  # (m, 2) across them
    metres_per_px: np.ndarray  # (m,)
    peaks_px: np.ndarray  # (m, k) where colour changes, along the normals
    contrasts: np.ndarray  # (m, k), 0 where there is no such peak


class Association(NamedTuple):
    """Where the parts of one view's edges should be, expected over their candidates."""

    target_px: np.ndarray  # (m,)
    weight: np.ndarray  # (m,) 1/px: square root of the chance that a candidate is the edge, over its spread
    gain: np.ndarray  # (m,) log-likelihood ratio over no candidate being the edge


def photo_of(scene: Scene, frame: Frame) -> Photo:
    """What a frame shows."""
    lab = cv2.cvtColor(scene.rgb(frame.index), cv2.COLOR_RGB2LAB)
    return Photo(lab, frame.rgb_camera, scene.filled_depth(frame.index), frame.world_from_camera, scene.noise)


def look_across(box: np.ndarray, photos: Sequence[Photo], world_from_front: Rigid3, reach_m: float) -> list[EdgeView]:
    """What each photograph shows within `reach_m` of the box's visible edges; those that show none are left out."""
    views = (_look(box, photo, photo.world_from_camera.inverse @ world_from_front, reach_m) for photo in photos)
    return [view for view in views if view is not None]


def displacements(parts: Points, view: EdgeView) -> np.ndarray:
    """How far (m,) the middles of a box's `edge_parts` lie from where they were first thought, along the normals, px."""
    ends = parts[view.parts].reshape(-1, 3)
    uv_px = project(view.camera_from_front.apply(ends), view.camera).reshape(-1, 2, 2)
    return np.asarray((((uv_px - view.uv_px).mean(axis=1)) * view.normals).sum(axis=1))


def associate(offset_px: np.ndarray, view: EdgeView, spread_m: float) -> Association:
    """The expectation step for parts at these displacements: candidates by contrast and distance, or none of them."""
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
    """How much each view's parts count (m,): a part that more than `independent` photographs show counts as that many.

    A line beside the edge misleads all photographs alike.
    """
    count = np.bincount(np.concatenate([np.zeros(0, int), *(view.parts for view in views)]), minlength=1)
    return [np.minimum(independent / count[view.parts], 1.0) for view in views]


def hidden(photo: Photo, uv_px: np.ndarray, z_m: np.ndarray) -> np.ndarray:
    """Whether the photo's depth shows something in front of each point."""
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
    """Change of colour over two pixels (m, offsets) along the normals, of the mean over each part's samples in view."""
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
    """Places and heights (m, k) of the highest peaks of each profile, to parts of a step; height 0 where there are fewer."""
    before, at, after = contrast[:, :-2], contrast[:, 1:-1], contrast[:, 2:]
    is_peak = (at > before) & (at >= after) & (at > least) & (np.abs(offsets[1:-1]) <= reach_px[:, None])
    is_peak[:, :3] = is_peak[:, -3:] = False  # rolled over from the other end
    height = np.where(is_peak, at, 0.0)
    order = np.argsort(-height, axis=1, kind="stable")[:, :_MOST_PEAKS]
    bend = before - 2 * at + after
    shift = np.where(bend < 0, 0.5 * (before - after) / np.where(bend < 0, bend, -1.0), 0.0)
    place = offsets[1:-1] + shift * _STEP_PX
    return np.take_along_axis(place, order, axis=1), np.take_along_axis(height, order, axis=1)


def _faced(box: np.ndarray, camera_from_front: Rigid3) -> np.ndarray:
    """Which parts of edges bound a face that the camera looks at; none of a box seen from behind."""
    params = tuned(Params)
    x, y, z = camera_from_front.inverse.translation @ rotation_about_z(float(box[YAW]))
    front, above = y < box[FRONT] - params.beside_m, z > box[TOP] + params.beside_m
    left, right = x < box[LEFT] - params.beside_m, x > box[RIGHT] + params.beside_m
    edges = [front, front, front and left, front and right, front, front and above]
    return np.repeat([*edges, front and (above or left), front and (above or right)], _PARTS)


def edge_parts(box: np.ndarray) -> Points:
    """Ends (8 edges x parts, 2, 3) in the front's frame of the edges whose parts are asked for.

    Upright: front left and right, back left and right. Level: top front, back, left and right. The foot lies in shadow.
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
