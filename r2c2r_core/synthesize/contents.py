"""Things in drawers: each lies on the floor of its drawer's tray, clear of its sides, and moves with that drawer."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from r2c2r_core.arrays import Points, Vector3
from r2c2r_core.geometry.boxes import box_corners
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.motion import JointMotion
from r2c2r_core.model.scene import Joint, Link, SceneObject
from r2c2r_core.synthesize.layout import Params as LayoutParams
from r2c2r_core.tuning import tuned


def in_drawers(
    things: Sequence[SceneObject],
    carriers: Mapping[str, JointMotion],
    units: Sequence[SceneObject],
    fixed: Collection[str],
    failures: dict[str, str],
) -> list[SceneObject]:
    """Things placed in the drawers that carry them; one whose drawer is no object of the scene is left out, with the reason.

    `carriers` are the motions of the drawers that each thing lies in, by the thing's name. The things named in `fixed` stay
    where a person put them, in a drawer or not.
    """
    placed = []
    for thing in things:
        found = _drawer_of(thing, carriers[thing.name], units)
        if thing.name in fixed:
            placed.append(replace(thing, carried_by=found and found[1].name))
        elif found is None:
            failures[thing.name] = (
                f"synthesize: {thing.name}: it lies in a drawer that is no object of the scene; click that drawer's front"
            )
        else:
            placed.append(_placed(thing, *found))
    return placed


def _drawer_of(thing: SceneObject, carrier: JointMotion, units: Sequence[SceneObject]) -> tuple[SceneObject, Link] | None:
    """The unit and the link whose tray a thing lies in."""
    for unit in units:
        centre = unit.world_from_object.inverse.apply((unit.final_from_placed @ thing.world_from_object).translation)
        links = {link.name: link for link in unit.links}
        for joint in unit.joints:
            low, high = _span(links[joint.child])
            if _moves_as(unit, joint, carrier) and ((low < centre) & (centre < high)).all():
                return unit, links[joint.child]
    return None


def _moves_as(unit: SceneObject, joint: Joint, carrier: JointMotion) -> bool:
    axis = unit.world_from_object.turn(joint.axis_object)
    return joint.type == carrier.kind and float(axis @ carrier.axis_world) > np.sqrt(0.5)


def _placed(thing: SceneObject, unit: SceneObject, drawer: Link) -> SceneObject:
    """The thing moved by its drawer's displacement in the layout, then onto the tray's floor and between its sides."""
    pose = unit.final_from_placed @ thing.world_from_object
    points = unit.world_from_object.inverse.apply(pose.apply(_points(thing)))
    shift = np.array([_into(points, drawer, axis) for axis in range(3)])
    world = Rigid3(translation=unit.world_from_object.turn(shift)) @ pose
    return replace(
        thing,
        world_from_object=world,
        final_from_placed=world @ thing.world_from_object.inverse @ thing.final_from_placed,
        carried_by=drawer.name,
    )


def _into(points: Points, drawer: Link, axis: int) -> float:
    """Shift along an axis of the unit that moves points (n, 3) between the boards beside their centre; down to the floor."""
    low, high = points.min(axis=0), points.max(axis=0)
    centre, gap = (low + high) / 2, tuned(LayoutParams).rest_gap_m
    others = [k for k in range(3) if k != axis]
    beside = [(a[axis], b[axis]) for a, b in _boards(drawer) if ((a < centre) & (centre < b))[others].all()]
    least = max((end for _, end in beside if end < centre[axis]), default=-np.inf) + gap
    most = min((start for start, _ in beside if start > centre[axis]), default=np.inf) - gap
    if axis == 2:
        return float(least - low[2]) if np.isfinite(least) else 0.0
    if most - least < high[axis] - low[axis]:
        return float((least + most) / 2 - centre[axis])
    return float(max(least - low[axis], 0.0) + min(most - high[axis], 0.0))


def _span(link: Link) -> tuple[Vector3, Vector3]:
    """Low and high corner of a link's boards, in the object's frame."""
    ends = list(_boards(link)) or [(np.zeros(3), np.zeros(3))]
    return np.min([low for low, _ in ends], axis=0), np.max([high for _, high in ends], axis=0)


def _boards(link: Link) -> Iterator[tuple[Vector3, Vector3]]:
    """Low and high corner of each board of a link, in the object's frame."""
    for box in link.boxes:
        corners = (link.object_from_link @ box.link_from_box).apply(box_corners(box.size_m))
        yield corners.min(axis=0), corners.max(axis=0)


def _points(thing: SceneObject) -> Points:
    """Collider points of a thing, in its frame."""
    link = thing.links[0]
    return link.object_from_link.apply(np.concatenate([piece.vertices_link for piece in link.pieces]))
