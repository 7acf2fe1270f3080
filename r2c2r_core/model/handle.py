"""Where a hand opens a joint: a grip to hold, or a point to push."""

from dataclasses import dataclass
from typing import Literal

from r2c2r_core.arrays import Vector3
from r2c2r_core.geometry.transforms import Rigid3

HandleKind = Literal["bar", "knob", "push"]
"""A grip with room behind it, one that is solid down to the front, or a front without either."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Room:
    """Free lengths round a closed grip, in m, up to `handles.FAR_M`: every collider of the scene and its floor counted."""

    before_m: float  # for a hand that backs off against the approach
    beside_m: tuple[float, float]  # for a finger, from the grip's faces: against the handle's y, along it
    depth_m: tuple[float, float]  # how deep a finger goes beside it, from its outer face: on the same two sides


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Handle:
    """One handle of a joint, everything closed.

    Its frame is that of a parallel gripper which holds it: origin in the grip's centre (of a push: on the front's face), x
    along the grip, y the way the fingers close, z the approach, into the front.
    """

    name: str  # unique in the bundle; starts with its link's name
    joint: str
    link: str  # that it belongs to
    kind: HandleKind
    world_from_handle: Rigid3
    opening_world: Vector3  # unit: where its origin first moves as the joint opens
    size_m: Vector3  # of the grip along its own axes; a push: the length of its edge, 0, 0
    protrusion_m: float  # from the front's outer face to the grip's
    gap_m: float  # between the grip and the front, where fingers hook in; 0: a knob or a push
    room: Room

    @property
    def grasp_width_m(self) -> float:
        """What the fingers must close on."""
        return float(self.size_m[1])
