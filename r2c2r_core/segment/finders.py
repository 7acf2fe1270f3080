"""From clicks to an object: tries what the category suggests first, then what the scan suggests."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Protocol

import numpy as np

from r2c2r_core.arrays import Mask, Points, Vector3
from r2c2r_core.errors import ObjectNotSeen
from r2c2r_core.model.capture import Frame
from r2c2r_core.model.inputs import ObjectPrompt, PromptPoint
from r2c2r_core.model.track import FrontPanel, ThingBox
from r2c2r_core.segment.appliances import ApplianceSize, appliance_box, appliance_mask, find_rectangle, measure_depth
from r2c2r_core.segment.categories import APPLIANCE_SIZES, CategoryHint, Kind
from r2c2r_core.segment.cut import Cell
from r2c2r_core.segment.edges import as_lab, panel_edges
from r2c2r_core.segment.fronts import Front, find_front, front_mask, front_panel, near_plane, nudged, seen_sides, wall_behind
from r2c2r_core.segment.handles import find_handles
from r2c2r_core.segment.planes import PlaneRegion, region_along, region_at
from r2c2r_core.segment.runs import Run
from r2c2r_core.segment.scene import Scene
from r2c2r_core.segment.silhouettes import small_mask
from r2c2r_core.segment.small import find_small, glimpse_small
from r2c2r_core.segment.squaring import squared
from r2c2r_core.segment.thing_boxes import box_of
from r2c2r_core.segment.things import Thing, find_thing, thing_mask

if TYPE_CHECKING:
    from r2c2r_core.segment.geometric import Found

_OFF_FRONT_M = 0.04  # behind its plane: a side or the top
_SMALL_M = 0.25  # things below this radius are carved by silhouettes
_PREPARED_MARGIN_M = 0.45  # planes that miss more of an appliance are many and small: cut when clicked


class Workbench(Protocol):
    """What finding needs from a session."""

    scene: Scene
    planes: tuple[PlaneRegion, ...]

    def run_of(self, region: PlaneRegion, margin_m: float = 0.0) -> Run | None:
        """The furniture run on a plane, and this far around it."""


@dataclass(frozen=True, slots=True, eq=False)
class FoundFront:
    """A furniture front."""

    front: Front
    scene: Scene
    kind: Kind = "front"
    warnings: tuple[str, ...] = ()

    def mask(self, frame: Frame) -> tuple[Mask, float]:
        """Visible pixels and the share of the front in view."""
        mask, share = front_mask(self.front, self.scene, frame)
        return mask, float(np.clip(0.3 + 0.7 * share, 0, 1))

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
        """Visible pixels and the share of the box in view."""
        mask, share = appliance_mask(self.front, self.scene, frame)
        return mask, float(np.clip(0.3 + 0.7 * share, 0, 1))

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
        """Visible pixels and the share of the thing in view."""
        mask, share = (small_mask if self.small else thing_mask)(self.thing, self.scene, frame)
        return mask, float(np.clip(0.3 + 0.7 * share, 0, 1))

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
    thing = _thing(bench, hint, positives, negatives) if len(positives) else None
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
    front = find_front(run, positives, negatives, pair=hint.pair)
    if front is None:
        return None
    front = replace(front, depth_m=wall_behind(run, front.cell, bench.scene.capture.room, hint.depth_m) or hint.depth_m)
    return FoundFront(replace(front, sides=seen_sides(front, bench.scene)), bench.scene)


def _appliance(bench: Workbench, prompt: ObjectPrompt, hint: CategoryHint, negatives: Points) -> FoundAppliance | None:
    """The box of an appliance; its glass may have no depth, so clicks are rays that meet a plane it shows elsewhere."""
    assert hint.appliance is not None
    clicks = [click for click in prompt.points if click.label == 1]
    found = _plane_of(bench, clicks[0], hint)
    if found is None:
        return None
    region, point = found
    room = bench.scene.capture.room
    run = bench.run_of(region, margin_m=_margin(region, hint.appliance))
    if run is None:
        return None
    on = run.grid.cells_of(np.array([point, *_on_plane(bench, region, clicks[1:])]))
    off = run.grid.cells_of(near_plane(run, negatives))
    cell = _rectangle(run, on, off, hint.appliance)
    if cell is None:
        return None
    lab, seen_colour = as_lab(run.mosaic)
    cell = panel_edges(cell, lab, seen_colour, np.ones_like(run.seen), run.grid.cell_m)
    handle = find_handles(run.mosaic, run.relief, (cell,), run.grid.cell_m)[0]
    front = Front(run, cell, handle, hint.depth_m)
    wall = wall_behind(run, cell, room, hint.depth_m)
    depth, seen = measure_depth(front, bench.scene, hint.depth_m, wall)
    front = squared(replace(front, depth_m=depth), bench.scene)
    front = replace(front, cell=_nudged(front.cell, on[1:], off, run.grid.cell_m))
    warnings = () if seen else (f"its depth was not seen: {depth:.2f} m is usual for a {prompt.category}",)
    return FoundAppliance(front, bench.scene, warnings=warnings)


def _rectangle(run: Run, on: np.ndarray, off: np.ndarray, size: ApplianceSize) -> Cell | None:
    """The rectangle around the first click; the others change the choice only where they are not just beside its border."""
    cell = find_rectangle(run, on[:1], size, off[:0])
    if cell is None:
        return find_rectangle(run, on, size, off)
    missed = [click for click in on[1:] if nudged(cell, click[0], click[1], 1, run.grid.cell_m) is None]
    wrong = [click for click in off if nudged(cell, click[0], click[1], 0, run.grid.cell_m) is None]
    if not missed and not wrong:
        return cell
    return find_rectangle(run, np.array([on[0], *missed]), size, np.array(wrong).reshape(-1, 2)) or cell


def _nudged(cell: Cell, on: np.ndarray, off: np.ndarray, cell_m: float) -> Cell:
    """The rectangle with its borders moved to the clicks beside them."""
    for label, clicks in ((1, on), (0, off)):
        for column, row in clicks:
            cell = nudged(cell, column, row, label, cell_m) or cell
    return cell


def _on_plane(bench: Workbench, region: PlaneRegion, clicks: list[PromptPoint]) -> list[Vector3]:
    """Where clicks meet the front's plane; those whose depth shows a side or the top say nothing about the front."""
    points = []
    for click in clicks:
        seen = bench.scene.pick(click.frame, click.x, click.y)
        has_depth = bench.scene.has_depth(click.frame, click.x, click.y)
        if has_depth and seen is not None and _behind(region, seen) > _OFF_FRONT_M:
            continue
        origin, ray = bench.scene.ray(click.frame, click.x, click.y)
        met = region_along((region,), origin, ray, 10.0, 1.0)
        points += [met[1]] if met else []
    return points


def _plane_of(bench: Workbench, click: PromptPoint, hint: CategoryHint) -> tuple[PlaneRegion, Vector3] | None:
    """The plane of an appliance's front and a point of it: under the click, else beside the face that was clicked."""
    scene = bench.scene
    origin, ray = scene.ray(click.frame, click.x, click.y)
    point = scene.pick(click.frame, click.x, click.y)
    if scene.has_depth(click.frame, click.x, click.y) and point is not None:
        region = region_at(bench.planes, point)
        front = _front_before(bench, point, hint)
        if front is not None and (region is None or _faced(scene, front, point) > _faced(scene, region, point) + 0.2):
            return front, _support_near(front, point)
        if region is not None:
            return region, point
    farthest = float(np.linalg.norm(point - origin)) + 0.1 if point is not None else 6.0
    assert hint.appliance is not None
    small = tuple(plane for plane in bench.planes if plane.width_m < 2.5 * hint.appliance.width[2])
    return region_along(small, origin, ray, farthest, hint.appliance.width[2])


def _front_before(bench: Workbench, point: Vector3, hint: CategoryHint) -> PlaneRegion | None:
    """The plane that a point on a side or the top of a box of this kind lies close behind; the one most looked at."""
    assert hint.appliance is not None
    planes = [
        plane
        for plane in bench.planes
        if plane.width_m < 1.3 * hint.appliance.width[2]
        and _OFF_FRONT_M < _behind(plane, point) < hint.appliance.depth + 0.1
        and plane.supports(point[None], 0.12)[0]
    ]
    return max(planes, key=lambda plane: _faced(bench.scene, plane, point), default=None)


def _behind(plane: PlaneRegion, point: Vector3) -> float:
    return -float((point - plane.world_from_plane.translation) @ plane.outward)


def _faced(scene: Scene, plane: PlaneRegion, point: Vector3) -> float:
    """How squarely the recording looks at a plane: the mean cosine over the cameras."""
    towards = np.stack([frame.world_from_camera.translation for frame in scene.frames]) - point
    return float((towards @ plane.outward / np.linalg.norm(towards, axis=1)).mean())


def _support_near(plane: PlaneRegion, point: Vector3) -> Vector3:
    """A point of what was seen of a plane, near to another point."""
    seen = plane.points
    order = np.argsort(np.linalg.norm(seen - point, axis=1))
    return np.asarray(seen[order[: max(1, round(0.06**2 / plane.cell_m**2))]].mean(axis=0))


def _margin(region: PlaneRegion, size: ApplianceSize) -> float:
    """How far the front may reach beyond what depth saw of it."""
    missing = max(size.width[1] - region.width_m, size.height[1] - region.height_m, 0.0)
    return round(missing + 0.05, 2) if missing > 0.08 else 0.0


def appliance_margins(region: PlaneRegion) -> tuple[float, ...]:
    """The margins with which a click may ask for the run around a plane: it may be a part of an appliance of known size."""
    sizes = [size for size in APPLIANCE_SIZES if region.width_m < size.width[2] and region.height_m < size.height[2]]
    margins = {_margin(region, size) for size in sizes}
    return tuple(sorted(margin for margin in margins if 0 < margin <= _PREPARED_MARGIN_M))


def _thing(bench: Workbench, hint: CategoryHint, positives: Points, negatives: Points) -> FoundThing | None:
    config = hint.thing
    if config.radius_m < _SMALL_M:
        small = find_small(bench.scene, positives, negatives, config, _structure_off(bench, positives[0]))
        if small is not None:
            return FoundThing(small, bench.scene, small=True, round=config.round)
    thing = find_thing(bench.scene, positives, negatives, config)
    return FoundThing(thing, bench.scene) if thing is not None else None


def _structure_off(bench: Workbench, point: Vector3) -> tuple[PlaneRegion, ...]:
    """Walls and runs that a thing may touch; not the one it is itself."""
    structure = tuple(plane for plane in bench.planes if plane.area_m2 > 0.4)
    own = region_at(structure, point, 0.02)
    return tuple(plane for plane in structure if plane is not own)
