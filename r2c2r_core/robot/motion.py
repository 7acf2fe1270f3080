"""Poses of a moving part along its joint's travel, and of a tool that holds it."""

from dataclasses import dataclass

import numpy as np

from r2c2r_core.arrays import Vector3
from r2c2r_core.errors import StageError
from r2c2r_core.geometry.transforms import Rigid3, joint_transform, rotation_about
from r2c2r_core.robot.handles import Part, part_of
from r2c2r_core.robot.rig import Rig

_HINGE = 3  # mjtJoint


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Travel:
    """Travel of one joint, in the world."""

    part: Part
    hinged: bool
    axis: Vector3
    anchor: Vector3  # on the axis
    world_from_closed: Rigid3  # of the part's body
    upper: float  # rad or m, from the closed position
    address: int  # of its position in qpos

    def world_from_body(self, position: float) -> Rigid3:
        """The part's pose at a joint position."""
        return joint_transform(self.axis, self.anchor, position, turns=self.hinged) @ self.world_from_closed

    def radius_of(self, point_body: Vector3) -> float:
        """Metres travelled by a point of the part per radian, or per metre."""
        if not self.hinged:
            return 1.0
        arm = self.world_from_closed.apply(point_body) - self.anchor
        return float(np.linalg.norm(np.cross(self.axis, arm)))

    def position(self, rig: Rig) -> float:
        """Current position of the joint."""
        return float(rig.data.qpos[self.address])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Hold:
    """A grasp: the tool's pose on the part, and how the wrist follows the motion."""

    body_from_tool: Rigid3
    wide_m: float  # width between the pads during the approach
    held_m: float  # width between the pads in contact
    starts: float = 0.0  # joint position at which the grasp begins
    follow: float = 1.0  # fraction of a hinge's rotation that the wrist follows; below 1, the bar turns between the pads

    def world_from_tool(self, travel: Travel, position: float, back_m: float = 0.0) -> Rigid3:
        """The tool's pose at a joint position, retracted by `back_m` along the approach."""
        pose = travel.world_from_body(position) @ self.body_from_tool
        rotation = pose.rotation
        if travel.hinged and self.follow < 1.0:
            rotation = rotation_about(travel.axis, (self.follow - 1.0) * position) @ rotation
        return Rigid3(rotation, pose.translation - back_m * rotation[:, 0])


def travel_of(rig: Rig, joint: str) -> Travel | None:
    """Travel of a joint of the scene; None where no moved body has a board. Raises StageError if it cannot open from 0."""
    import mujoco

    part = part_of(rig.model, joint)
    if part is None:
        return None
    entry = rig.model.joint(joint)
    lower, upper = map(float, entry.range)
    if not lower <= 0 < upper:
        raise StageError(f"{joint}: its range is {lower:.4g} .. {upper:.4g}", hint="0 is closed, and positive opens")
    data = mujoco.MjData(rig.model)
    mujoco.mj_kinematics(rig.model, data)
    return Travel(
        part=part,
        hinged=int(entry.type[0]) == _HINGE,
        axis=data.xaxis[entry.id].copy(),
        anchor=data.xanchor[entry.id].copy(),
        world_from_closed=Rigid3(data.xmat[part.body].reshape(3, 3).copy(), data.xpos[part.body].copy()),
        upper=upper,
        address=int(entry.qposadr[0]),
    )
