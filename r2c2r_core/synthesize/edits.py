"""Elementary edits of a measured object, from which the layout is composed."""

from dataclasses import replace

from r2c2r_core.arrays import Vector3
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.synthesize.dimensions import MeasuredObject


def moved(item: MeasuredObject, shift: Vector3) -> MeasuredObject:
    """The object, translated in the world."""
    pose = Rigid3(item.world_from_object.rotation, item.world_from_object.translation + shift)
    return replace(item, world_from_object=pose)


def trimmed(item: MeasuredObject, axis: int, sign: float, amount_m: float) -> MeasuredObject:
    """The object with one face moved inwards: `axis` and `sign` name the face in the object frame."""
    size = item.dimensions_m.copy()
    size[axis] -= amount_m
    shift = -sign * amount_m / 2 * item.world_from_object.rotation[:, axis]
    return replace(moved(item, shift), dimensions_m=size)


def edge_moved(item: MeasuredObject, axis: int, sign: float, inwards_m: float) -> MeasuredObject:
    """The front with one edge moved inwards, or outwards where negative; its handle stays fixed in the world.

    `axis` and `sign` name the edge in the object frame: 0 left (-1) or right (+1), 2 bottom or top.
    """
    handle, shift = item.handle, sign * inwards_m / 2
    if handle is not None:  # although the front's centre moves
        ends = ("left_m", "right_m") if axis == 0 else ("bottom_m", "top_m")
        handle = replace(handle, **{end: getattr(handle, end) + shift for end in ends})
    return replace(trimmed(item, axis, sign, inwards_m), handle=handle)
