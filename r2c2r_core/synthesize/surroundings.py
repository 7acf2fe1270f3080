"""Worktops and plinths from the scan, collision-free: they are part of a kitchen, whether somebody clicked them or not."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import count

import numpy as np

from r2c2r_core.arrays import Vector3
from r2c2r_core.failing import apart, spared
from r2c2r_core.geometry.boxes import Boxes, box_penetration
from r2c2r_core.geometry.camera import pixel_rays
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.kitchen.names import category_of
from r2c2r_core.model.capture import Capture, Wall
from r2c2r_core.model.inputs import ObjectOverride, ObjectPrompt, Overrides
from r2c2r_core.model.motion import Source
from r2c2r_core.model.scene import SceneObject
from r2c2r_core.synthesize.clearance import gathered, link_boxes, open_freely
from r2c2r_core.synthesize.dimensions import MeasuredObject
from r2c2r_core.synthesize.facets import facets_of
from r2c2r_core.synthesize.plinths import plinth_runs, plinths
from r2c2r_core.synthesize.slabs import Slab
from r2c2r_core.synthesize.unit_runs import UnitRun
from r2c2r_core.synthesize.worktops import clicked_worktop, runs_of, worktop
from r2c2r_core.tuning import param, tuned

MADE = "made from the scan, without clicks"


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned clearance of worktops and plinths."""

    apart_m: float = param(0.0004, "m", "Minimum distance from static geometry and from every closed front")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Surrounding:
    """A worktop or a plinth to be built."""

    name: str
    category: str
    slab: Slab
    clicked: MeasuredObject | None = None  # None: nobody clicked it

    def measured(self, slab: Slab) -> MeasuredObject:
        """The surrounding as a measured object, with its slab or a smaller one."""
        pose = Rigid3(slab.rotation, slab.rotation @ ((slab.low + slab.high) / 2))
        if self.clicked is not None:
            said, size_m = (*self.clicked.warnings, *slab.notes), slab.high - slab.low
            return replace(
                self.clicked, world_from_object=pose, dimensions_m=size_m, sources=slab.sources, placed_pose=pose, warnings=said
            )
        return MeasuredObject(
            name=self.name,
            category=self.category,
            spec=category_of(self.category),
            world_from_object=pose,
            dimensions_m=slab.high - slab.low,
            sources=slab.sources,
            handle=None,
            support_z_m=None,
            front_measured=False,
            confidence=1.0,
            fixed_by_person=False,
            placed_pose=pose,
            warnings=(MADE, *slab.notes),
        )


def surroundings_of(
    capture: Capture,
    objects: Sequence[MeasuredObject],
    clicked: Sequence[MeasuredObject | ObjectPrompt],
    said: list[str],
    *,
    unasked: bool,
) -> list[Surrounding]:
    """Worktops over the runs of base units and plinths below them, `unasked` or only those clicked; none where one was placed.

    A clicked worktop, or the prompt of one of which depth shows nothing, is the one over the run at its place; else the level
    surface as clicked, unless that is taken. Runs need a floor, since base units are identified by their height above it.
    `said` gets a line for every run where none could be made.
    """
    counters, boards = list[Slab](), list[Slab]()
    with spared("the search for worktops and plinths failed", said):
        facets = facets_of(capture.surface)
        runs = runs_of(objects) if capture.room.floor_found and (unasked or clicked) else []
        for run in runs:
            with spared(f"no worktop was made over {_names(run)}", said):
                counters += worktop(capture, facets, run, objects, counters, [other for other in runs if other is not run])
        for run in plinth_runs(objects) if capture.room.floor_found and unasked else ():
            with spared(f"no plinth was made below {_names(run)}", said):
                boards += plinths(facets, run, objects, boards)
    made = list[Surrounding]()
    for item in clicked:
        with spared(f"{item.name} is left out", said):
            own, seen = [slab for slab in counters if any(map(slab.is_at, _tops(capture, item, slab)))], None
            if isinstance(item, MeasuredObject):
                seen = item
                own = own or clicked_worktop(facets, item, objects, [*counters, *(other.slab for other in made)])
            if own:
                largest = max(own, key=lambda slab: slab.along[1] - slab.along[0])
                counters = [slab for slab in [*counters, *(one for one in own if one not in counters)] if slab is not largest]
                slab = largest if seen is not None else replace(largest, notes=(*largest.notes, "its clicks show no surface"))
                made.append(Surrounding(name=item.name, category=item.category, slab=slab, clicked=seen))
    names = {item.name for item in (*objects, *clicked)}
    return [*made, *(_named("counter", counters, names) if unasked else ()), *_named("plinth", boards, names)]


def _tops(capture: Capture, item: MeasuredObject | ObjectPrompt, slab: Slab) -> list[Vector3]:
    """Points on top of a clicked worktop: its middle, or where its clicks meet the height of a slab."""
    if isinstance(item, MeasuredObject):
        return [item.world_from_object.apply(np.array([0.0, 0.0, item.dimensions_m[2] / 2]))]
    points = []
    for click in (click for click in item.points if click.label == 1):
        frame = capture.frame(click.frame)
        eye, ray = frame.world_from_camera.translation, pixel_rays(np.array([click.x, click.y]), frame.rgb_camera)
        ray = frame.world_from_camera.rotation @ ray
        points += [eye + ray * ((slab.high[2] - eye[2]) / ray[2])] if ray[2] < 0 else []
    return points


def as_said(made: Sequence[Surrounding], overrides: Overrides) -> tuple[list[Surrounding], list[Surrounding]]:
    """Surroundings as found, and those that a person sized or moved; those a person removed are in neither."""
    kept = [_corrected(item, overrides.of(item.name)) for item in made if not overrides.of(item.name).left_out]
    moved = {item.name for item in kept if _is_placed(overrides.of(item.name))}
    return [item for item in kept if item.name not in moved], [item for item in kept if item.name in moved]


def _is_placed(said: ObjectOverride) -> bool:
    return said.pose is not None or said.dimensions_m is not None


def _corrected(item: Surrounding, said: ObjectOverride) -> Surrounding:
    slab = item.slab if said.colour is None else replace(item.slab, colour=said.colour)
    if not _is_placed(said):
        return replace(item, slab=slab)
    found = item.measured(slab)
    pose = found.world_from_object if said.pose is None else Rigid3.from_matrix(said.pose)
    size_m = found.dimensions_m if said.dimensions_m is None else said.dimensions_m
    centre = pose.rotation.T @ pose.translation
    sources: tuple[Source, Source, Source] = slab.sources if said.dimensions_m is None else ("person", "person", "person")
    low, high = centre - size_m / 2, centre + size_m / 2
    return replace(item, slab=replace(slab, rotation=pose.rotation, low=low, high=high, sources=sources, flush_m=None))


def standing_clear(
    opened: Sequence[SceneObject],
    made: Sequence[Surrounding],
    build: Callable[[MeasuredObject, Slab], SceneObject],
    walls: Sequence[Wall],
    kept: frozenset[str],
    said: list[str],
) -> list[SceneObject]:
    """The surroundings, built, that touch nothing and shorten no joint; otherwise a worktop is tried without overhang.

    `said` gets a line for every one that could not be built.
    """
    with apart("synthesize", "worktops and plinths", {}):  # else piece by piece
        standing = [build(item.measured(item.slab), item.slab) for item in made]
        if _clear(opened, standing, walls, kept):  # the usual case: one test of every joint instead of one per piece
            return standing
    clear: list[SceneObject] = []
    for item in made:
        with spared(f"{item.name} is left out", said):
            slabs = (item.slab,) if item.slab.flush_m is None else (item.slab, item.slab.flush)
            pieces = (build(item.measured(slab), slab) for slab in slabs)
            clear += [piece for piece in pieces if _clear(opened, [piece], walls, kept)][:1]
    return clear


def _names(run: UnitRun) -> str:
    return ", ".join(unit.name for unit in run.units)


def _clear(opened: Sequence[SceneObject], pieces: Sequence[SceneObject], walls: Sequence[Wall], kept: frozenset[str]) -> bool:
    """Whether the pieces touch nothing in the scene, and every joint opens as far as without them."""
    params = tuned(Params)
    boxes = gathered(opened).boxes
    for own in (link_boxes(piece, link) for piece in pieces for link in piece.links):
        repeated = Boxes(*(np.repeat(part, len(boxes.centres), axis=0) for part in own))
        if (box_penetration(repeated, boxes) > -params.apart_m).any():
            return False
    beside = open_freely([*opened, *pieces], walls, kept)[: len(opened)]
    uppers, before = ([joint.upper for item in items for joint in item.joints] for items in (beside, opened))
    return all(upper >= free - 1e-9 for upper, free in zip(uppers, before, strict=True))


def _named(category: str, slabs: Sequence[Slab], taken: set[str]) -> list[Surrounding]:
    """The slabs with the first free numbers as names."""
    free = (name for number in count(1) if (name := f"{category}_{number}") not in taken)
    return [Surrounding(name=name, category=category, slab=slab) for name, slab in zip(free, slabs, strict=False)]
