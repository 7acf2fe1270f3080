"""A clicked free-standing object: its box, and its mask in any frame."""

from dataclasses import dataclass, replace

import numpy as np

from r2c2r_core.arrays import Mask
from r2c2r_core.kitchen.category import Kind
from r2c2r_core.model.capture import Frame
from r2c2r_core.model.carrier import Carrier
from r2c2r_core.model.motion import JointMotion
from r2c2r_core.model.track import FrontPanel, ThingBox
from r2c2r_core.segment.expected_iou import expected_iou
from r2c2r_core.segment.found import Found, View
from r2c2r_core.segment.occlusion import fill_polygon, project_polygon
from r2c2r_core.segment.scene import Scene
from r2c2r_core.segment.things.boxes import box_of
from r2c2r_core.segment.things.silhouettes import small_mask
from r2c2r_core.segment.things.standing import Standing
from r2c2r_core.segment.things.standing_mask import standing_mask
from r2c2r_core.segment.things.thing import Thing, thing_mask

_BORDER_M = 0.01  # usual position error of a mask's border (measured on samples and the real kitchen)


class Loose:
    """Measurements that no free-standing object has: it has no front, and moves as a whole."""

    __slots__ = ()

    def panel(self) -> FrontPanel | None:
        """None: free-standing objects have no front panel."""
        return None

    def motions(self) -> tuple[JointMotion, ...]:
        """No motions: free-standing objects move as a whole."""
        return ()


@dataclass(frozen=True, slots=True, eq=False)
class FoundThing(Loose):
    """A segmented free-standing object."""

    thing: Thing
    scene: Scene
    small: bool = False  # a visual hull, whose border follows colour
    round: bool = False
    standing: Standing | None = None  # on the floor, such as a chair or a table
    kind: Kind = "thing"
    warnings: tuple[str, ...] = ()

    def see(self, frame: Frame) -> View:
        """Visible pixels of the object in a frame, with their confidence."""
        if self.standing is not None:
            mask, share = standing_mask(self.standing, self.scene, frame)
        else:
            mask, share = (small_mask if self.small else thing_mask)(self.thing, self.scene, frame)
        border_m = 0.5 * self.thing.border_m if self.small else _BORDER_M
        sample = self.thing.vertices[:: max(1, len(self.thing.vertices) // 50)]
        return View(mask, expected_iou(mask, share, frame, sample, border_m))

    def box(self) -> ThingBox | None:
        """Box of the object on its support."""
        centres = np.stack([frame.world_from_camera.translation for frame in self.scene.frames])
        points = self.thing.vertices if self.standing is None else self.standing.levelled
        yaw_rad, support_m = self.scene.capture.room.manhattan_yaw_rad, self.thing.support_z_m
        return box_of(points, support_m, yaw_rad, centres.mean(axis=0), round_thing=self.round)


@dataclass(frozen=True, slots=True, eq=False)
class FoundCarried(Loose):
    """A thing in a drawer, segmented in the scene as seen from that drawer (motion/carried.py)."""

    thing: Found
    scene: Scene  # as seen from the drawer
    carrier: Carrier
    kind: Kind = "thing"
    warnings: tuple[str, ...] = ()

    def see(self, frame: Frame) -> View:
        """Visible pixels in a frame that shows the drawer open; none in others."""
        carried = self.carrier.frame(frame) if frame.index in self.scene.rendered_mm else None
        if carried is None:
            return View(np.zeros((frame.rgb_camera.height, frame.rgb_camera.width), bool), 0.0)
        seen = self.thing.see(carried)
        return replace(seen, mask=seen.mask & ~self._behind_front(carried))

    def _behind_front(self, carried: Frame) -> Mask:
        """Pixels of the drawer's front, which hides what lies close behind it: depth cannot tell the two apart."""
        camera, front = carried.rgb_camera, self.carrier.front
        outline = project_polygon(front.corners, carried, camera)
        is_outside = (carried.world_from_camera.translation - front.centre) @ front.outward > 0
        if outline is None or not is_outside:
            return np.zeros((camera.height, camera.width), bool)
        return fill_polygon(outline, (0, 0, camera.width, camera.height))

    def box(self) -> ThingBox | None:
        """Box of the thing with its drawer closed."""
        box = self.thing.box()
        return None if box is None else replace(box, carrier=self.carrier)
