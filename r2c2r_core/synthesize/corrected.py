"""Preview of a person's corrections by geometry alone, on an object built without them: no stage runs, nothing is certified.

A full run may differ: neighbours are moved, boards are cut again, obstacles reduce limits.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from r2c2r_core.arrays import Vector3
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.inputs import HingeSide, JointLimits, ObjectOverride
from r2c2r_core.model.motion import JointMotion
from r2c2r_core.model.rectangle import TOWARDS
from r2c2r_core.model.scene import Box, ConvexPiece, Joint, Link, SceneObject
from r2c2r_core.synthesize.fixtures.doors import hinge_motion
from r2c2r_core.synthesize.marked import part_of, remarked

_SAME = 1e-3  # m and rad: rounding of files


def corrected(item: SceneObject, said: ObjectOverride, motions: Sequence[JointMotion]) -> SceneObject:
    """The object with a person's size, pose, hinge, limits, colour and states; unchanged without new ones.

    `motions` are the track's measurements, without a person's corrections.
    """
    item = remarked(item, said.states, motions)
    sized = item if said.dimensions_m is None else _sized(item, said.dimensions_m)
    placed = sized if said.pose is None else replace(sized, world_from_object=Rigid3.from_matrix(said.pose))
    hinged = placed if said.hinge is None else _hinged(placed, said.hinge)
    painted = hinged if said.colour is None else _painted(hinged, said.colour)
    return replace(painted, joints=tuple(_limited(joint, painted, said) for joint in painted.joints))


def differs(before: SceneObject, after: SceneObject) -> bool:
    """Whether the object's size, pose, colours or joints changed by more than rounding."""

    def numbers(item: SceneObject) -> np.ndarray:
        joints = [[*j.origin_object, *j.axis_object, j.lower, j.upper] for j in item.joints]
        colours = [link.colour for link in item.links]
        return np.concatenate([np.ravel(part) for part in (item.dimensions_m, item.world_from_object.matrix, joints, colours)])

    return not np.allclose(numbers(before), numbers(after), atol=_SAME)


def _sized(item: SceneObject, dimensions_m: Vector3) -> SceneObject:
    """The object stretched along its axes, which are also its links' axes."""
    share = np.asarray(dimensions_m) / item.dimensions_m
    return replace(
        item,
        dimensions_m=np.asarray(dimensions_m, dtype=np.float64),
        links=tuple(_stretched(link, share) for link in item.links),
        joints=tuple(replace(joint, origin_object=joint.origin_object * share) for joint in item.joints),
    )


def _stretched(link: Link, share: Vector3) -> Link:
    return replace(
        link,
        object_from_link=_shared(link.object_from_link, share),
        boxes=tuple(replace(b, size_m=b.size_m * share, link_from_box=_shared(b.link_from_box, share)) for b in link.boxes),
        pieces=tuple(ConvexPiece(name=piece.name, vertices_link=piece.vertices_link * share) for piece in link.pieces),
        visual=None if link.visual is None else replace(link.visual, vertices=link.visual.vertices * share),
    )


def _shared(pose: Rigid3, share: Vector3) -> Rigid3:
    return Rigid3(pose.rotation, pose.translation * share)


def _hinged(item: SceneObject, side: HingeSide) -> SceneObject:
    """The object with its only leaf on another side; unchanged with several leaves or a drawer."""
    if len(item.joints) != 1:
        return item
    (joint,) = item.joints
    if joint.type == "prismatic":
        slides = abs(joint.axis_object[1]) < 0.5  # a drawer comes out towards -Y
        return replace(item, joints=(replace(joint, axis_object=TOWARDS[side]),)) if slides else item
    leaf = next(link for link in item.links if link.name == joint.child)
    front = _in_object(leaf, max(leaf.of_role("front"), key=lambda box: float(np.prod(box.size_m)), default=None))
    if front is None:
        return item
    motion = hinge_motion(leaf.name, front, side, joint.upper)
    return replace(item, joints=(replace(joint, origin_object=motion.origin_object, axis_object=motion.axis_object),))


def _in_object(link: Link, box: Box | None) -> Box | None:
    return None if box is None else replace(box, link_from_box=link.object_from_link @ box.link_from_box)


def _painted(item: SceneObject, colour: tuple[float, float, float]) -> SceneObject:
    return replace(item, links=tuple(replace(link, colour=colour) for link in item.links))


def _limited(joint: Joint, item: SceneObject, said: ObjectOverride) -> Joint:
    part = part_of(joint, item.name)
    only = JointLimits(said.joint_lower, said.joint_upper) if len(item.joints) == 1 else JointLimits(None, None)
    lower, upper = said.joints.get(joint.name) or said.joints.get(part) or only
    lowest = joint.lower if lower is None else lower
    return replace(joint, lower=lowest, upper=max(lowest, joint.upper if upper is None else upper))
