"""A clicked front: its rectangle, and its mask in any frame at the leaves' pose there."""

from dataclasses import dataclass, field, replace

import numpy as np

from r2c2r_core.kitchen.category import Category, Kind
from r2c2r_core.model.capture import Frame
from r2c2r_core.model.motion import JointMotion
from r2c2r_core.model.track import FrontPanel, ThingBox
from r2c2r_core.segment.expected_iou import expected_iou
from r2c2r_core.segment.found import View
from r2c2r_core.segment.fronts.front import Front, front_mask, front_panel, sides_mask
from r2c2r_core.segment.motion.board import open_mask
from r2c2r_core.segment.motion.filmed import FilmedLeaves
from r2c2r_core.segment.motion.leaf import Leaf, OpenLeaf
from r2c2r_core.segment.scene import Scene

_BORDER_M = 0.006  # usual position error of a mask's border (measured on samples and the real kitchen)


@dataclass(frozen=True, slots=True, eq=False)
class FoundFront:
    """A segmented furniture front."""

    front: Front
    scene: Scene
    category: Category
    fit: float = 1.0  # 0..1: how well its size fits its category
    slides: float = 0.0  # probability that it slides sideways
    kind: Kind = "front"
    warnings: tuple[str, ...] = ()
    _leaves: FilmedLeaves = field(init=False, repr=False)

    def __post_init__(self) -> None:
        leaf = Leaf.of(self.front.rectangle)
        object.__setattr__(self, "_leaves", FilmedLeaves(leaf, self.category, self.scene, self.front.depth_m))

    def see(self, frame: Frame) -> View:
        """Visible pixels of the front at its leaves' pose in the frame, with their confidence."""
        opened = self._leaves.open_in(frame.index)
        if opened:
            return self._opened(opened, frame)
        mask, share = front_mask(self.front, self.scene, frame)
        return View(mask, expected_iou(mask, share, frame, self.front.outline.corners, _BORDER_M, self.fit))

    def _opened(self, opened: tuple[OpenLeaf, ...], frame: Frame) -> View:
        """Mask of its open leaves, and of those of a pair that stay closed."""
        parts = [open_mask(one, self.scene, frame) for one in opened]
        corners = [one.leaf.corners for one in opened]
        for leaf in self._leaves.closed_in(frame.index):
            corners.append(leaf.corners)
            parts.append(front_mask(self.front, self.scene, frame, corners[-1]))
        mask = np.logical_or.reduce([sides_mask(self.front, self.scene, frame), *(part for part, _ in parts)])
        share = float(np.mean([share for _, share in parts]))
        return View(mask, expected_iou(mask, share, frame, np.concatenate(corners), _BORDER_M, self.fit))

    def panel(self) -> FrontPanel | None:
        """Front rectangle with its handle."""
        return replace(front_panel(self.front), slides=self.slides)

    def motions(self) -> tuple[JointMotion, ...]:
        """Joint motions of its leaves in the recording."""
        return self._leaves.motions

    def box(self) -> ThingBox | None:
        """None: built-in fronts have no box of their own."""
        return None
