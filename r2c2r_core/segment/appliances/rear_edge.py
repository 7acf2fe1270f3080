"""Rear edge of an appliance by change-point detection: depth beyond it lies on the wall, not on the face's continuation.

Colour does not separate a white microwave from a white wall, and points on its sides thin out where they are seen at a flat
angle. Each depth pixel whose ray crosses the plane of a face tells how far behind the crossing the surface is: zero where the
face continues, the remaining distance to the wall where it has ended. The edge is the change point of all frames together.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from r2c2r_core.geometry.camera import depth_points
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.kitchen.category import Size
from r2c2r_core.model.capture import Frame
from r2c2r_core.segment.appliances.edges import BOTTOM, FRONT, LEFT, RIGHT, TOP
from r2c2r_core.segment.scene import Scene
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of rear-edge detection."""

    flattest: float = param(0.08, "cosine", "Minimum cosine between a ray and the face's normal for the ray to count")
    from_share: float = param(
        0.3,
        "share",
        "Depth behind the front from which a face is examined, relative to the minimum depth: doors end there",
    )
    margin: float = param(0.1, "share", "Fraction of a face ignored at either of its edges along the depth", lt=0.5)
    beyond_m: float = param(0.08, "m", "Distance past the greatest possible depth up to which rays count")
    before_m: float = param(0.05, "m", "Distance in front of the face beyond which a point belongs to an occluder")
    bin_m: float = param(0.01, "m", "Width of the bins along the face", gt=0)
    least: int = param(6, "count", "Minimum number of pixels per bin, and of a frame on either part of a face", ge=1)
    least_bins: int = param(8, "count", "Minimum number of bins with data")
    least_gap_m: float = param(0.015, "m", "Minimum gap between the rear edge and the surface behind it")
    clearer: float = param(0.5, "ratio", "Maximum misfit relative to that of a face without an end")


def rear_edge(
    box: np.ndarray, depth: Size, farthest_m: float, frames: Sequence[Frame], scene: Scene, world_from_front: Rigid3
) -> np.ndarray:
    """Intervals (n, 2) of y (m, frame of the front) in which the top, left and right faces of a box end, where depth shows it.

    `box` gives the faces; a face exists up to the category's minimum `depth` and ends within `farthest_m`.
    """
    params = tuned(Params)
    ends = []
    for face, other in ((TOP, (LEFT, RIGHT)), (LEFT, (BOTTOM, TOP)), (RIGHT, (BOTTOM, TOP))):
        crossings, behind = [np.zeros(0)], [np.zeros(0)]
        for frame in frames:
            y, gap = _continued(box, face, box[list(other)], frame, scene, world_from_front)
            within = (y > params.from_share * depth.low) & (y < farthest_m + params.beyond_m)
            y, gap = y[within], gap[within]
            known = y < depth.low
            if known.sum() < params.least or np.count_nonzero(~known) < params.least:
                continue
            crossings.append(y)
            behind.append(gap - np.median(gap[known]))  # the frame's own pose error
        found = _change_point(np.concatenate(crossings), np.concatenate(behind))
        if found is not None:
            ends.append(found)
    return np.array(ends).reshape(-1, 2)


def _continued(
    box: np.ndarray, face: int, other: np.ndarray, frame: Frame, scene: Scene, world_from_front: Rigid3
) -> tuple[np.ndarray, np.ndarray]:
    """Crossing (y) of each pixel's ray with a face's plane, and the distance along y from there to the measured surface."""
    params = tuned(Params)
    axis, side = (2, 1.0) if face == TOP else (0, 1.0 if face == RIGHT else -1.0)
    front_from_camera = world_from_front.inverse @ frame.world_from_camera
    eye = front_from_camera.translation
    if side * (eye[axis] - box[face]) <= 0:
        return np.zeros(0), np.zeros(0)
    depth_m = scene.depth(frame.index)
    hit = front_from_camera.apply(depth_points(depth_m, frame.depth_camera)[depth_m > 0])
    ray = hit - eye
    steep = side * ray[:, axis] < -params.flattest * np.linalg.norm(ray, axis=1)
    share = (box[face] - eye[axis]) / np.where(steep, ray[:, axis], -1.0 * side)
    crossing = eye + share[:, None] * ray
    margin = params.margin * (other[1] - other[0])
    inside = steep & (crossing[:, 2 - axis] > other[0] + margin) & (crossing[:, 2 - axis] < other[1] - margin)
    gap = (hit - crossing)[:, 1]
    inside &= (crossing[:, 1] > box[FRONT]) & (gap > -params.before_m) & (ray[:, 1] > 0)
    return crossing[inside, 1], gap[inside]


def _change_point(crossing: np.ndarray, behind: np.ndarray) -> tuple[float, float] | None:
    """The last y on the face and the first y on the wall; None where no edge shows.

    Bins of y are split by least absolute deviations. Between the two lie the pixels that a phone drops at an edge.
    """
    params = tuned(Params)
    index = np.floor(crossing / params.bin_m).astype(int)
    bins = np.array([k for k in np.unique(index) if np.count_nonzero(index == k) >= params.least])
    if len(bins) < params.least_bins:
        return None
    y = (bins + 0.5) * params.bin_m
    gap = np.array([np.median(behind[index == k]) for k in bins])
    walls = [float(np.median(gap[k:] + y[k:])) for k in range(1, len(bins) - 1)]  # upright wall: the gap shrinks as y grows
    misfits = [np.abs(gap[:k]).sum() + np.abs(gap[k:] + y[k:] - wall).sum() for k, wall in enumerate(walls, 1)]
    best = int(np.argmin(misfits)) + 1
    to_the_wall = walls[best - 1] - y[best] < params.least_gap_m  # the face ends where the wall begins
    if to_the_wall or misfits[best - 1] > params.clearer * np.abs(gap).sum():
        return None
    return float(y[best - 1]), float(y[best] - params.bin_m / 2)
