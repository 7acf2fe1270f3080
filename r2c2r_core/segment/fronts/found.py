"""A front that clicks found: its rectangle, and its mask in any frame, closed, drawn out or swung open."""

from dataclasses import dataclass

from r2c2r_core.kitchen.category import Kind
from r2c2r_core.model.capture import Frame
from r2c2r_core.model.track import FrontPanel, ThingBox
from r2c2r_core.segment.expected_iou import expected_iou
from r2c2r_core.segment.found import View
from r2c2r_core.segment.fronts.articulation import drawn_out, swung, swung_corners
from r2c2r_core.segment.fronts.front import Front, front_corners, front_mask, front_panel
from r2c2r_core.segment.scene import Scene
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """How well a front's borders are known."""

    border_m: float = param(0.006, "m", "how far borders are off", source="measured on samples and the real kitchen")


@dataclass(frozen=True, slots=True, eq=False)
class FoundFront:
    """A furniture front."""

    front: Front
    scene: Scene
    swings: bool = True  # a single door; drawers slide, and of a pair each leaf would have to be told apart
    fit: float = 1.0  # 0..1: how well its size fits its category
    kind: Kind = "front"
    warnings: tuple[str, ...] = ()

    def see(self, frame: Frame) -> View:
        """Its pixels where it stands in the frame: closed, drawn out or swung open."""
        corners = front_corners(self.front.cell, self.front.run.grid, (0.0, 0.0))
        out_m = drawn_out(self.front, self.scene, frame)
        swing = swung(self.front, self.scene, frame) if self.swings and not out_m else None
        opened = corners + self.front.run.grid.outward * out_m if out_m else None
        if swing is not None:
            opened = swung_corners(self.front, swing)
        mask, share = front_mask(self.front, self.scene, frame, opened)
        trust = expected_iou(mask, share, frame, corners if opened is None else opened, tuned(Params).border_m, self.fit)
        return View(mask, trust, out_m, swing)

    def panel(self) -> FrontPanel | None:
        """The rectangle and its handle."""
        return front_panel(self.front)

    def box(self) -> ThingBox | None:
        """Fronts are built into something: no box of their own."""
        return None
