"""Gravity-aligned bounding boxes of partly seen objects."""

from dataclasses import dataclass

import numpy as np

from r2c2r_core.arrays import Points, Vector3
from r2c2r_core.geometry.boxes import box_at_yaw, upright_box
from r2c2r_core.geometry.transforms import Rigid3, front_rotation
from r2c2r_core.model.track import ThingBox
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of object boxes."""

    trim: float = param(0.01, "share", "Fraction of the points ignored at either end of each axis", ge=0, lt=0.5)
    snap_area: float = param(
        1.06, "ratio", "Maximum footprint of the room-aligned box, relative to the smallest box, for it to be preferred"
    )


def box_of(
    points_world: Points,
    support_z_m: float | None,
    manhattan_yaw_rad: float,
    towards_world: Vector3,
    *,
    round_thing: bool = False,
) -> ThingBox:
    """Object box aligned with the room where that fits, else of least area; its front faces `towards_world` (the cameras).

    A round object is as deep as it is wide: only its width is measured across the view, because its back is not seen.
    """
    params = tuned(Params)
    if round_thing:
        return _round_box(points_world, support_z_m, towards_world)
    smallest = upright_box(points_world, trim=params.trim)
    aligned = box_at_yaw(points_world, manhattan_yaw_rad, trim=params.trim)
    box = aligned if aligned.size_m[:2].prod() < params.snap_area * smallest.size_m[:2].prod() else smallest
    centre = box.world_from_box.translation.copy()
    bottom, top = centre[2] - box.size_m[2] / 2, centre[2] + box.size_m[2] / 2
    if support_z_m is not None and support_z_m < top:
        bottom = support_z_m
    centre[2] = (bottom + top) / 2
    outward = _facing(box.world_from_box.rotation, towards_world - centre)
    rotation = front_rotation(outward)
    across = abs(rotation[:, 0] @ box.world_from_box.rotation[:, 0]) > 0.5
    width, depth = (box.size_m[0], box.size_m[1]) if across else (box.size_m[1], box.size_m[0])
    return ThingBox(
        world_from_object=Rigid3(rotation, centre),
        dimensions_m=np.array([width, depth, top - bottom]),
        support_z_m=float(bottom),
    )


def _facing(rotation: np.ndarray, towards: Vector3) -> Vector3:
    """Outward normal of the box side that points most towards a direction."""
    sides = [sign * rotation[:, axis] for axis in (0, 1) for sign in (1.0, -1.0)]
    return np.asarray(max(sides, key=lambda side: float(side @ towards)))


def _round_box(points_world: Points, support_z_m: float | None, towards_world: Vector3) -> ThingBox:
    params = tuned(Params)
    towards = towards_world - points_world.mean(axis=0)
    rotation = front_rotation(towards)
    local = points_world @ rotation
    low, high = np.quantile(local, [params.trim / 2, 1 - params.trim / 2], axis=0)
    width, top = high[0] - low[0], high[2]
    bottom = support_z_m if support_z_m is not None and support_z_m < top else low[2]
    centre = rotation @ np.array([(low[0] + high[0]) / 2, low[1] + width / 2, (bottom + top) / 2])
    return ThingBox(
        world_from_object=Rigid3(rotation, centre),
        dimensions_m=np.array([width, width, top - bottom]),
        support_z_m=float(bottom),
    )
