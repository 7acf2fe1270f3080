"""Voxel votes of an object's frames: observed surface, observed free space, or outside the masks."""

from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np

from r2c2r_core.arrays import Points
from r2c2r_core.generate.evidence import View, moved_edge
from r2c2r_core.generate.variation import Variation
from r2c2r_core.geometry.camera import project, sample_nearest
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of voxel votes."""

    block: int = param(4, "count", "Side of the blocks of voxels that are tested as one first", ge=1)
    occluder_gap_m: float = param(0.03, "m", "Distance in front of a voxel beyond which depth belongs to an occluder")


class Votes(NamedTuple):
    """Votes of the frames for each voxel (flat arrays)."""

    distance_m: np.ndarray  # mean truncated distance to the observed surface; nan without one
    free_m: np.ndarray  # the k-th largest distance into free space; -inf where fewer than k frames see it free
    surfaces: np.ndarray  # number of frames that see a surface within the truncation
    outside_m: np.ndarray  # minimum distance outside a frame's mask, clipped to the truncation; positive: outside every mask


def collect_votes(centres_world: Points, variation: Variation, truncation: float) -> Votes:
    """Truncated distances, free-space distances and surface votes over the variation's views."""
    count, votes = len(centres_world), variation.carve_votes
    total, weight = np.zeros(count, np.float32), np.zeros(count, np.float32)
    free_count, solid = np.zeros(count, np.uint16), np.zeros(count, np.uint16)
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
    return Votes(distance, np.where(outvoted, -np.inf, largest[-1]), solid, outside)


def grid_votes(
    centres_local: Points,
    shape: tuple[int, int, int],
    voxel_m: float,
    variation: Variation,
    truncation: float,
    world_from_local: Rigid3,
) -> Votes:
    """Votes of a whole grid (last axis fastest), coarse to fine: blocks clearly outside the masks are not refined."""
    params = tuned(Params)
    grid = centres_local.reshape(*shape, 3)
    middles = grid[np.ix_(*[np.minimum(np.arange(0, n, params.block) + params.block // 2, n - 1) for n in shape])]
    reach = max(
        params.block * voxel_m, truncation
    )  # from a block's centre to its furthest voxel, and at least the truncation distance
    away = _is_outside(world_from_local.apply(middles.reshape(-1, 3)), variation, truncation, reach).reshape(middles.shape[:3])
    for axis in range(3):
        away = np.repeat(away, params.block, axis=axis)
    near = np.flatnonzero(~away[: shape[0], : shape[1], : shape[2]])
    known = collect_votes(world_from_local.apply(centres_local[near]), variation, truncation)
    votes = Votes(*(np.full(len(centres_local), value, np.float32) for value in (np.nan, truncation, 0.0, truncation)))
    for values, found in zip(votes, known, strict=True):
        values[near] = found
    return votes


def _is_outside(points_world: Points, variation: Variation, truncation: float, reach_m: float) -> np.ndarray:
    """Whether enough frames see each point free and further than `reach_m` outside their masks."""
    free, solid = np.zeros(len(points_world), np.int64), np.zeros(len(points_world), np.int64)
    for view in variation.views:
        _, is_surface, free_m, outside_m = _view_distances(
            points_world.astype(np.float32), view, variation.erosion_px, truncation
        )
        free += (free_m > reach_m) & np.isfinite(outside_m) & (outside_m > reach_m)
        solid += is_surface
    return np.asarray((free >= variation.carve_votes) & (free > solid))


def _view_distances(
    points_world: np.ndarray, view: View, erosion_px: float, truncation: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Per voxel: distance in front of the observed surface (metres), whether that is valid, distance into free space (-inf if
    not free), distance outside the mask.

    Free space is what the depth sees through, and what projects outside the mask without a nearer occluder.
    """
    camera_from_world = view.world_from_camera.inverse
    q = points_world @ camera_from_world.rotation.T.astype(np.float32) + camera_from_world.translation.astype(np.float32)
    z = q[:, 2]
    ahead = z > 0.05
    depth, has_depth = sample_nearest(view.depth_m, project(q, view.depth_camera))
    has_depth &= ahead & (depth > 0)
    margin_px = erosion_px * 0.5 * view.rgb_camera.fx / view.depth_camera.fx
    outside_px, in_image = sample_nearest(_outside_distance(view.mask), project(q, view.rgb_camera))
    in_image &= ahead
    inside = in_image & (outside_px < -margin_px)
    signed = depth - z
    is_surface = inside & has_depth & (signed > -truncation)
    nowhere = np.float32(-np.inf)
    through = np.where(inside & has_depth & (signed > truncation), signed, nowhere)
    beside_m = (outside_px - np.float32(0.5)) * z * np.float32(1.0 / view.rgb_camera.fx)
    beside = np.where(in_image & (outside_px > 0.5) & has_depth & (signed > -tuned(Params).occluder_gap_m), beside_m, nowhere)
    return signed, is_surface, np.maximum(through, beside), np.where(in_image, beside_m, np.float32(np.inf))


def _outside_distance(mask: np.ndarray) -> np.ndarray:
    """Signed distance to the mask's edge in pixels, positive outside."""
    mask = moved_edge(mask, 0.0).astype(np.uint8)
    outside = cv2.distanceTransform(1 - mask, cv2.DIST_L2, 3)
    return np.asarray(outside - cv2.distanceTransform(mask, cv2.DIST_L2, 3), dtype=np.float32)
