"""Grasp points of a joint: a grip to hold, or a point to push."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from r2c2r_core.arrays import Vector3
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.motion import Source
from r2c2r_core.model.scene import GripPart

HandleKind = Literal["bar", "knob", "push"]
"""A grip with a gap behind it, a grip solid down to the front, or a front without either."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Room:
    """Clearances around a grip with all joints closed, in m, up to `handles.FAR_M`, from all colliders and the floor."""

    before_m: float  # for a hand that retreats against the approach direction
    beside_m: tuple[float, float]  # for a finger, from the grip's faces: against the handle's y, along it
    depth_m: tuple[float, float]  # depth available to a finger beside it, from its outer face: on the same two sides


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Handle:
    """One handle of a joint, everything closed.

    Its frame is that of a parallel gripper that holds it: origin at the grip's centre (of a push: on the front's face), x along
    the grip, y the closing direction of the fingers, z the approach, into the front.
    """

    name: str  # unique in the bundle; starts with its link's name
    joint: str
    link: str  # that carries it
    kind: HandleKind
    world_from_handle: Rigid3
    opening_world: Vector3  # unit: initial direction of its origin as the joint opens
    size_m: Vector3  # size of the grip along its own axes; a push: the length of its edge, 0, 0
    protrusion_m: float  # from the front's outer face to the grip's
    gap_m: float  # between the grip and the front, where fingers hook in; 0: a knob or a push
    room: Room
    sources: Mapping[GripPart, Source] = field(default_factory=dict)
    confidence: float | None = None  # that there is a handle here, 0..1; None: a push

    @property
    def grasp_width_m(self) -> float:
        """Width that the fingers must close on."""
        return float(self.size_m[1])
