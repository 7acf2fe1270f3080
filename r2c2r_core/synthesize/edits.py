"""Small corrections of a measured object: the layout is made of these."""

from dataclasses import replace

from r2c2r_core.arrays import Vector3
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.synthesize.dimensions import MeasuredObject


def moved(item: MeasuredObject, shift: Vector3) -> MeasuredObject:
    """The object, translated in the world."""
    pose = Rigid3(item.world_from_object.rotation, item.world_from_object.translation + shift)
    return replace(item, world_from_object=pose)


def trimmed(item: MeasuredObject, axis: int, sign: float, amount_m: float) -> MeasuredObject:
    """The object with one face drawn in: `axis` and `sign` name the face in the object frame."""
    size = item.dimensions_m.copy()
    size[axis] -= amount_m
    shift = -sign * amount_m / 2 * item.world_from_object.rotation[:, axis]
    return replace(moved(item, shift), dimensions_m=size)


def edge_moved(item: MeasuredObject, sign: float, inwards_m: float) -> MeasuredObject:
    """The front with one side edge (-1 left, +1 right) drawn in, or let out where negative; its handle stays in the room."""
    handle, shift = item.handle, sign * inwards_m / 2
    if handle is not None:  # while the front's centre moves
        handle = replace(handle, left_m=handle.left_m + shift, right_m=handle.right_m + shift)
    return replace(trimmed(item, 0, sign, inwards_m), handle=handle)
