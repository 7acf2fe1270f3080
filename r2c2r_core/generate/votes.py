"""What the frames of a thing say of each voxel: seen as surface, seen free, or in no mask at all."""

from typing import NamedTuple

import cv2
import numpy as np

from r2c2r_core.arrays import Points
from r2c2r_core.generate.evidence import View, moved_edge
from r2c2r_core.generate.variation import Variation
from r2c2r_core.geometry.camera import Intrinsics

_OCCLUDER_GAP_M = 0.03  # depth this much nearer than a voxel belongs to something in front of it


class Votes(NamedTuple):
    """What the frames say of each voxel (flat arrays)."""

    distance_m: np.ndarray  # mean truncated distance to the seen surface; nan where none
    free_m: np.ndarray  # the k-th largest distance into free space; -inf where fewer than k frames see it free
    outside_m: np.ndarray  # least distance outside any frame's mask, at most the truncation; positive: in no mask at all


def collect_votes(centres_world: Points, variation: Variation, truncation: float) -> Votes:
    """Truncated distances, free-space distances and surface votes over the variation's views."""
    count, votes = len(centres_world), variation.carve_votes
    total, weight = np.zeros(count, np.float32), np.zeros(count, np.float32)
    free_count, solid = np.zeros(count, np.uint8), np.zeros(count, np.uint8)
    largest = np.full((votes, count), -np.inf, np.float32)
    outside = np.full(count, truncation, np.float32)
    points = centres_world.astype(np.float32)
    for view in variation.views:
        signed, is_surface, free_m, outside_m = _view_distances(points, view, variation.erosion_px, truncation)
        total[is_surface] += np.clip(signed[is_surface], -truncation, truncation)
        weight[is_surface] += 1
        solid += is_surface & (signed < truncation)
        free_count += free_m > 0
        outside = np.minimum(outside, outside_m)
        for rank in range(votes):  # keep the k largest, sorted
            larger = np.maximum(largest[rank], free_m)
            free_m = np.minimum(largest[rank], free_m)
            largest[rank] = larger
    with np.errstate(invalid="ignore", divide="ignore"):
        distance = np.where(weight > 0, total / weight, np.nan)
    # a few frames whose mask misses a part must not carve what most frames see as surface
    outvoted = free_count < 0.4 * (free_count.astype(np.float32) + solid)
    return Votes(distance, np.where(outvoted, -np.inf, largest[-1]), outside)


def _view_distances(
    points_world: np.ndarray, view: View, erosion_px: float, truncation: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Per voxel, metres: before the seen surface, whether that is known, inside free space (-inf if not), outside the mask.

    Free is what the depth sees through, and what projects outside the mask with nothing nearer in front of it.
    """
    camera_from_world = view.world_from_camera.inverse
    q = points_world @ camera_from_world.rotation.T.astype(np.float32) + camera_from_world.translation.astype(np.float32)
    z = q[:, 2]
    ahead = z > 0.05
    safe = np.where(ahead, z, np.float32(1.0))
    depth, has_depth = _lookup(view.depth_m, q, safe, view.depth_camera)
    has_depth &= ahead & (depth > 0)
    margin_px = erosion_px * 0.5 * view.rgb_camera.fx / view.depth_camera.fx
    outside_px, in_image = _lookup(_outside_distance(view.mask), q, safe, view.rgb_camera)
    in_image &= ahead
    inside = in_image & (outside_px < -margin_px)
    signed = depth - z
    is_surface = inside & has_depth & (signed > -truncation)
    nowhere = np.float32(-np.inf)
    through = np.where(inside & has_depth & (signed > truncation), signed, nowhere)
    beside_m = (outside_px - np.float32(0.5)) * z * np.float32(1.0 / view.rgb_camera.fx)
    beside = np.where(in_image & (outside_px > 0.5) & has_depth & (signed > -_OCCLUDER_GAP_M), beside_m, nowhere)
    return signed, is_surface, np.maximum(through, beside), np.where(in_image, beside_m, np.float32(np.inf))


def _outside_distance(mask: np.ndarray) -> np.ndarray:
    """Signed distance to the mask's edge in pixels, positive outside."""
    mask = moved_edge(mask, 0.0).astype(np.uint8)
    outside = cv2.distanceTransform(1 - mask, cv2.DIST_L2, 3)
    return np.asarray(outside - cv2.distanceTransform(mask, cv2.DIST_L2, 3), dtype=np.float32)


def _lookup(image: np.ndarray, q: np.ndarray, z: np.ndarray, camera: Intrinsics) -> tuple[np.ndarray, np.ndarray]:
    """Values of the pixels that contain the camera-frame points, and whether they lie inside the image."""
    u = q[:, 0] / z * np.float32(camera.fx) + np.float32(camera.cx)
    v = q[:, 1] / z * np.float32(camera.fy) + np.float32(camera.cy)
    inside = (u >= 0) & (v >= 0) & (u < camera.width) & (v < camera.height)
    index = np.where(inside, v, 0).astype(np.int32) * camera.width + np.where(inside, u, 0).astype(np.int32)
    return image.ravel()[index], inside
