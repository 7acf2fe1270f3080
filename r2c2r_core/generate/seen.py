"""Observation of a free-standing object: its depth points and the box that bounds them."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from r2c2r_core.arrays import Points, Vector3
from r2c2r_core.errors import GenerationFailed
from r2c2r_core.generate.evidence import Evidence, masked_points
from r2c2r_core.generate.variation import Variation
from r2c2r_core.geometry.transforms import Rigid3, rotation_about_z
from r2c2r_core.kitchen.names import category_of
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters for selecting an object's depth points."""

    least_points: int = param(60, "count", "Minimum number of depth points of an object")
    component_cell_m: float = param(0.03, "m", "Side of the cells whose connected components separate objects", gt=0)


class Seen(NamedTuple):
    """An object as observed in one draw's frames, in its box's frame (gravity-aligned, origin at the box's centre)."""

    world_from_local: Rigid3
    points: Points
    low: Vector3  # corners of the carved volume
    high: Vector3
    floor: float | None  # height of its support; None where unknown


def observe_thing(evidence: Evidence, variation: Variation) -> Seen:
    """The object's points and box; raises GenerationFailed with too little depth."""
    world_from_local = _local_frame(evidence)
    points = _object_points(evidence, variation, world_from_local)
    return Seen(world_from_local, points, *_prior_box(evidence, variation, points, world_from_local))


def _local_frame(evidence: Evidence) -> Rigid3:
    """The track's box frame; without one, a frame along the room's dominant directions at the median of the points."""
    if evidence.track.box is not None:
        return evidence.track.box.world_from_object
    points = np.concatenate([masked_points(v) for v in evidence.pool])
    if len(points) < tuned(Params).least_points:
        raise GenerationFailed(
            f"{evidence.track.name}: {len(points)} depth points inside its masks", hint="scan it from nearer"
        )
    return Rigid3(rotation_about_z(evidence.capture.room.manhattan_yaw_rad), np.median(points, axis=0))


def _object_points(evidence: Evidence, variation: Variation, world_from_local: Rigid3) -> Points:
    """Depth points of the object in the local frame: its largest connected component."""
    params = tuned(Params)
    found = [masked_points(view, variation.erosion_px) for view in variation.views]
    points = world_from_local.inverse.apply(np.concatenate(found))
    if len(points) < params.least_points:
        raise GenerationFailed(
            f"{evidence.track.name}: {len(points)} depth points inside its masks, {params.least_points} needed",
            hint="scan it from nearer, or upload a mesh",
        )
    return _largest_cluster(points)


def _largest_cluster(points: Points) -> Points:
    """Points of the largest component of coarse occupied cells; removes background seen through slats or past edges."""
    from scipy import ndimage

    cell = np.floor((points - points.min(axis=0)) / tuned(Params).component_cell_m).astype(int)
    counts = np.zeros(cell.max(axis=0) + 1, dtype=np.int64)
    np.add.at(counts, tuple(cell.T), 1)
    labels, count = ndimage.label(counts >= 2, structure=np.ones((3, 3, 3)))
    if count <= 1:
        return points
    sizes = ndimage.sum(counts, labels, index=np.arange(1, count + 1))
    return points[labels[tuple(cell.T)] == 1 + int(np.argmax(sizes))]


def _prior_box(
    evidence: Evidence, variation: Variation, points: Points, world_from_local: Rigid3
) -> tuple[Vector3, Vector3, float | None]:
    """Corners of the carved volume and the height of its support (local), None where unknown."""
    percentile = variation.bbox_percentile
    low, high = np.percentile(points, percentile, axis=0), np.percentile(points, 100 - percentile, axis=0)
    box = evidence.track.box
    if box is None:
        return low, high, None
    half = np.asarray(box.dimensions_m) / 2
    eyes = world_from_local.inverse.apply(np.array([v.eye_world for v in variation.views]))
    for axis in (0, 1):  # a side that no camera faces keeps the track's box, if that reaches further
        if not (eyes[:, axis] > half[axis]).any():
            high[axis] = max(high[axis], half[axis] * variation.depth_scale)
        if not (eyes[:, axis] < -half[axis]).any():
            low[axis] = min(low[axis], -half[axis] * variation.depth_scale)
    floor = box.support_z_m - float(world_from_local.translation[2])
    # Often only the top is observed of a table, and of a thing in a drawer.
    reaches_down = category_of(evidence.track.category).on_legs or box.carrier is not None
    if low[2] - floor > 0.5 * (high[2] - low[2]) and not reaches_down:  # hangs or stands on something else
        return low, high, None
    low[2] = floor
    return low, high, floor
