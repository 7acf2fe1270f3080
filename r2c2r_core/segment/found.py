"""What clicks found: a front, an appliance or a thing, and its pixels in any frame."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from r2c2r_core.arrays import Mask
from r2c2r_core.kitchen.category import Kind
from r2c2r_core.model.capture import Frame
from r2c2r_core.model.track import FrontPanel, Swing, ThingBox
from r2c2r_core.segment.appliances import appliance_box, appliance_mask
from r2c2r_core.segment.fronts import Front, front_corners, front_mask, front_panel
from r2c2r_core.segment.scene import Scene
from r2c2r_core.segment.silhouettes import small_mask
from r2c2r_core.segment.states import drawn_out, swung, swung_corners
from r2c2r_core.segment.thing_boxes import box_of
from r2c2r_core.segment.things import Thing, thing_mask
from r2c2r_core.segment.trust import expected_iou

_BORDERS_M = {"front": 0.006, "appliance": 0.009, "thing": 0.01}  # how far borders were off, on samples and the real kitchen


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """An object in one frame."""

    mask: Mask  # its visible pixels
    trust: float  # how far to trust them, 0..1
    opened_m: float = 0.0  # how far its front is drawn out; 0 where closed or not to be told
    swing: Swing | None = None  # how its door stands open; None where closed or not to be told


class Found(Protocol):
    """An object found from its clicks: what it is, and its pixels in any frame."""

    @property
    def kind(self) -> Kind:
        """What it turned out to be."""

    @property
    def warnings(self) -> tuple[str, ...]:
        """One line each, for a person."""

    def see(self, frame: Frame) -> View:
        """Its pixels in a frame, and how it stands open there."""

    def panel(self) -> FrontPanel | None:
        """Its flat front, measured."""

    def box(self) -> ThingBox | None:
        """Its box, measured."""


@dataclass(frozen=True, slots=True, eq=False)
class FoundFront:
    """A furniture front."""

    front: Front
    scene: Scene
    swings: bool = True  # a single door; drawers slide, and of a pair each leaf would have to be told apart
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
        trust = expected_iou(mask, share, frame, corners if opened is None else opened, _BORDERS_M["front"])
        return View(mask, trust, out_m, swing)

    def panel(self) -> FrontPanel | None:
        """The rectangle and its handle."""
        return front_panel(self.front)

    def box(self) -> ThingBox | None:
        """Fronts are built into something: no box of their own."""
        return None


@dataclass(frozen=True, slots=True, eq=False)
class FoundAppliance:
    """A box with a front: refrigerator, microwave."""

    front: Front
    scene: Scene
    kind: Kind = "appliance"
    warnings: tuple[str, ...] = ()

    def see(self, frame: Frame) -> View:
        """Its pixels; its door is not told open."""
        mask, share = appliance_mask(self.front, self.scene, frame)
        corners = front_corners(self.front.cell, self.front.run.grid, (0.0, 0.0))
        return View(mask, expected_iou(mask, share, frame, corners, _BORDERS_M["appliance"]))

    def panel(self) -> FrontPanel | None:
        """The rectangle of its front and its handle."""
        return front_panel(self.front)

    def box(self) -> ThingBox | None:
        """The front extruded backwards."""
        return appliance_box(self.front)


@dataclass(frozen=True, slots=True, eq=False)
class FoundThing:
    """A free-standing thing."""

    thing: Thing
    scene: Scene
    small: bool = False  # a visual hull, whose border follows colour
    round: bool = False
    kind: Kind = "thing"
    warnings: tuple[str, ...] = ()

    def see(self, frame: Frame) -> View:
        """Its pixels."""
        mask, share = (small_mask if self.small else thing_mask)(self.thing, self.scene, frame)
        border_m = 0.5 * self.thing.border_m if self.small else _BORDERS_M["thing"]
        sample = self.thing.vertices[:: max(1, len(self.thing.vertices) // 50)]
        return View(mask, expected_iou(mask, share, frame, sample, border_m))

    def panel(self) -> FrontPanel | None:
        """None: things have no front panel."""
        return None

    def box(self) -> ThingBox | None:
        """Its box on its support."""
        centres = np.stack([frame.world_from_camera.translation for frame in self.scene.frames])
        room = self.scene.capture.room
        return box_of(
            self.thing.points, self.thing.support_z_m, room.manhattan_yaw_rad, centres.mean(axis=0), round_thing=self.round
        )
