"""A clicked appliance: its box, and the mask of that box in any frame."""

from dataclasses import dataclass, field

from r2c2r_core.kitchen.category import Category, Kind
from r2c2r_core.model.capture import Frame
from r2c2r_core.model.motion import JointMotion
from r2c2r_core.model.track import FrontPanel, ThingBox
from r2c2r_core.segment.appliances.box import appliance_box, appliance_mask
from r2c2r_core.segment.appliances.seams import drawer_seams, panel_seams
from r2c2r_core.segment.expected_iou import expected_iou
from r2c2r_core.segment.found import View
from r2c2r_core.segment.fronts.front import Front, front_panel
from r2c2r_core.segment.motion.board import open_mask
from r2c2r_core.segment.motion.filmed import FilmedLeaves
from r2c2r_core.segment.motion.leaf import Leaf
from r2c2r_core.segment.scene import Scene

_BORDER_M = 0.009  # usual position error of a mask's border (measured on samples and the real kitchen)


@dataclass(frozen=True, slots=True, eq=False)
class FoundAppliance:
    """A segmented box with a front: refrigerator, microwave."""

    front: Front
    scene: Scene
    category: Category
    depth_seen: bool  # whether its depth was observed, not assumed
    kind: Kind = "appliance"
    warnings: tuple[str, ...] = ()
    _leaves: FilmedLeaves = field(init=False, repr=False)

    def __post_init__(self) -> None:
        seams_m = drawer_seams(self.front) if self.category.over_drawer is not None else ()
        leaf = Leaf.of_appliance(self.front.rectangle)
        panels_m = panel_seams(self.front) if self.category.beside_panel else ()
        leaves = FilmedLeaves(leaf, self.category, self.scene, self.front.depth_m, seams_m, panels_m)
        object.__setattr__(self, "_leaves", leaves)

    def see(self, frame: Frame) -> View:
        """Visible pixels of the box and of its doors where they stand open, with their confidence."""
        mask, share = appliance_mask(self.front, self.scene, frame)
        for opened in self._leaves.open_in(frame.index):
            mask = mask | open_mask(opened, self.scene, frame)[0]
        return View(mask, expected_iou(mask, share, frame, self.front.outline.corners, _BORDER_M))

    def panel(self) -> FrontPanel | None:
        """Front rectangle with its handle."""
        return front_panel(self.front)

    def motions(self) -> tuple[JointMotion, ...]:
        """Joint motions of its doors in the recording."""
        return self._leaves.motions

    def box(self) -> ThingBox | None:
        """Box of the front extruded backwards."""
        return appliance_box(self.front, depth_seen=self.depth_seen)
