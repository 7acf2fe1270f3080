"""From clicks to an object: tries what the category suggests first, then what the scan suggests."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from r2c2r_core.arrays import Mask, Points, Vector3
from r2c2r_core.errors import ObjectNotSeen
from r2c2r_core.model.capture import Frame
from r2c2r_core.model.inputs import ObjectPrompt
from r2c2r_core.model.track import FrontPanel, Swing, ThingBox
from r2c2r_core.segment.appliance_clicks import appliance_front
from r2c2r_core.segment.appliances import appliance_box, appliance_mask
from r2c2r_core.segment.categories import CategoryHint, Kind
from r2c2r_core.segment.fronts import (
    Front,
    find_front,
    front_corners,
    front_mask,
    front_panel,
    seen_sides,
    wall_behind,
)
from r2c2r_core.segment.planes import PlaneRegion, region_at
from r2c2r_core.segment.scene import Scene
from r2c2r_core.segment.silhouettes import small_mask
from r2c2r_core.segment.small import find_small, glimpse_small
from r2c2r_core.segment.states import drawn_out, swung, swung_corners
from r2c2r_core.segment.thing_boxes import box_of
from r2c2r_core.segment.things import Thing, ThingConfig, find_thing, thing_mask
from r2c2r_core.segment.trust import expected_iou
from r2c2r_core.segment.workbench import Workbench

if TYPE_CHECKING:
    from r2c2r_core.segment.geometric import Found

_BORDERS_M = {"front": 0.006, "appliance": 0.009, "thing": 0.01}  # how far borders were off, on samples and the real kitchen
_SMALL_M = 0.25  # things below this radius are carved by silhouettes


@dataclass(frozen=True, slots=True, eq=False)
class FoundFront:
    """A furniture front."""

    front: Front
    scene: Scene
    swings: bool = True  # a single door; drawers slide, and of a pair each leaf would have to be told apart
    kind: Kind = "front"
    warnings: tuple[str, ...] = ()

    def mask(self, frame: Frame) -> tuple[Mask, float]:
        """Visible pixels and how far to trust them."""
        corners = front_corners(self.front.cell, self.front.run.grid, (0.0, 0.0))
        opened = self._opened(frame, corners)
        mask, share = front_mask(self.front, self.scene, frame, opened)
        return mask, expected_iou(mask, share, frame, corners if opened is None else opened, _BORDERS_M["front"])

    def opened_m(self, frame: Frame) -> float:
        """How far it is drawn out in a frame."""
        return drawn_out(self.front, self.scene, frame)

    def swung(self, frame: Frame) -> Swing | None:
        """How its door stands open in a frame; None for drawers."""
        return swung(self.front, self.scene, frame) if self.swings else None

    def _opened(self, frame: Frame, corners: Points) -> Points | None:
        """Its corners where it stands open in a frame."""
        out_m = self.opened_m(frame)
        if out_m > 0:
            return corners + self.front.run.grid.outward * out_m
        swing = self.swung(frame)
        return swung_corners(self.front, swing) if swing is not None else None

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

    def mask(self, frame: Frame) -> tuple[Mask, float]:
        """Visible pixels and how far to trust them."""
        mask, share = appliance_mask(self.front, self.scene, frame)
        corners = front_corners(self.front.cell, self.front.run.grid, (0.0, 0.0))
        return mask, expected_iou(mask, share, frame, corners, _BORDERS_M["appliance"])

    def opened_m(self, frame: Frame) -> float:
        """Appliances do not move; their doors are not told open."""
        return 0.0

    def swung(self, frame: Frame) -> Swing | None:
        """None, as above."""
        return None

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

    def mask(self, frame: Frame) -> tuple[Mask, float]:
        """Visible pixels and how far to trust them."""
        mask, share = (small_mask if self.small else thing_mask)(self.thing, self.scene, frame)
        border_m = 0.5 * self.thing.border_m if self.small else _BORDERS_M["thing"]
        return mask, expected_iou(mask, share, frame, self.thing.vertices[:: max(1, len(self.thing.vertices) // 50)], border_m)

    def opened_m(self, frame: Frame) -> float:
        """Things do not open."""
        return 0.0

    def swung(self, frame: Frame) -> Swing | None:
        """None, as above."""
        return None

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


def find_object(bench: Workbench, prompt: ObjectPrompt, hint: CategoryHint, positives: Points, negatives: Points) -> "Found":
    """The object under the clicks; raises ObjectNotSeen when neither a front nor a thing is there."""
    if hint.kind == "front":
        found = _front(bench, hint, positives, negatives)
        if found is not None:
            return found
    if hint.kind == "appliance":
        appliance = _appliance(bench, prompt, hint, negatives)
        if appliance is not None:
            return appliance
    thing = _thing(bench, prompt, hint, positives, negatives) if len(positives) else None
    if thing is not None:
        warnings = (
            ()
            if hint.kind != "front"
            else (f"no flat front under the click: treated as a thing of its own ({prompt.category})",)
        )
        return replace(thing, warnings=warnings)
    raise ObjectNotSeen(
        f"{prompt.name}: no surface of its own under {len(positives)} click(s)",
        hint="click on its middle, or add a second click",
    )


def glimpse_object(bench: Workbench, hint: CategoryHint, positives: Points, negatives: Points) -> "Found | None":
    """A first look at what is slow to find, from depth alone: small things. None for the rest, which are found at once."""
    if hint.kind != "thing" or hint.thing.radius_m >= _SMALL_M or not len(positives):
        return None
    small = glimpse_small(bench.scene, positives, negatives, hint.thing, _structure_off(bench, positives[0]))
    return FoundThing(small, bench.scene, small=True, round=hint.thing.round) if small is not None else None


def _front(bench: Workbench, hint: CategoryHint, positives: Points, negatives: Points) -> FoundFront | None:
    region = region_at(bench.planes, positives[0])
    run = bench.run_of(region) if region is not None else None
    if run is None:
        return None
    front = find_front(run, positives, negatives, pair=hint.pair, size=hint.size, stacked=hint.stacked)
    if front is None:
        return None
    front = replace(front, depth_m=wall_behind(run, front.cell, bench.scene.capture.room, hint.depth_m) or hint.depth_m)
    return FoundFront(replace(front, sides=seen_sides(front, bench.scene)), bench.scene, swings=not (hint.pair or hint.stacked))


def _appliance(bench: Workbench, prompt: ObjectPrompt, hint: CategoryHint, negatives: Points) -> FoundAppliance | None:
    front, seen = appliance_front(bench, prompt, hint, negatives) or (None, False)
    if front is None:
        return None
    usual = f"its depth was not seen: {front.depth_m:.2f} m is usual for a {prompt.category}"
    return FoundAppliance(front, bench.scene, warnings=() if seen else (usual,))


def _thing(
    bench: Workbench, prompt: ObjectPrompt, hint: CategoryHint, positives: Points, negatives: Points
) -> FoundThing | None:
    config = hint.thing
    positives = _on_thing(bench, prompt, positives, config)
    if config.radius_m < _SMALL_M:
        small = find_small(bench.scene, positives, negatives, config, _structure_off(bench, positives[0]))
        if small is not None:
            return FoundThing(replace(small, clicks=prompt.points), bench.scene, small=True, round=config.round)
    thing = find_thing(bench.scene, positives, negatives, config)
    return FoundThing(thing, bench.scene) if thing is not None else None


def _on_thing(bench: Workbench, prompt: ObjectPrompt, positives: Points, config: ThingConfig) -> Points:
    """The clicks' points, those that fell on what is behind the thing drawn forward to it; farther ones are left out."""
    points = [positives[0]]
    across = 1.2 * config.width_m + 0.02 if config.width_m is not None else 2.2 * config.radius_m
    clicks = [click for click in prompt.points if click.label == 1]
    for click, seen in zip(clicks[1:], positives[1:], strict=False):
        point = seen
        if np.linalg.norm((point - positives[0])[:2]) > across:
            origin, ray = bench.scene.ray(click.frame, click.x, click.y)
            point = origin + ray * float((positives[0] - origin)[:2] @ ray[:2]) / max(float(ray[:2] @ ray[:2]), 1e-6)
        if np.linalg.norm((point - positives[0])[:2]) <= across:
            points.append(point)
    return np.array(points)


def _structure_off(bench: Workbench, point: Vector3) -> tuple[PlaneRegion, ...]:
    """Walls and runs that a thing may touch; not the one it is itself."""
    structure = tuple(plane for plane in bench.planes if plane.area_m2 > 0.4)
    own = region_at(structure, point, 0.02)
    return tuple(plane for plane in structure if plane is not own)
