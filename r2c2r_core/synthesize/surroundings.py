"""Worktops and plinths added from the scan, collision-free: they are part of a kitchen but are not clicked."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import count

import numpy as np

from r2c2r_core.failing import apart, spared
from r2c2r_core.geometry.boxes import Boxes, box_penetration
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.kitchen.names import category_of
from r2c2r_core.model.capture import Capture, Wall
from r2c2r_core.model.inputs import ObjectOverride, Overrides
from r2c2r_core.model.motion import Source
from r2c2r_core.model.scene import SceneObject
from r2c2r_core.synthesize.clearance import gathered, link_boxes, open_freely
from r2c2r_core.synthesize.dimensions import MeasuredObject
from r2c2r_core.synthesize.facets import facets_of
from r2c2r_core.synthesize.plinths import plinth_runs, plinths
from r2c2r_core.synthesize.slabs import Slab
from r2c2r_core.synthesize.unit_runs import UnitRun
from r2c2r_core.synthesize.worktops import runs_of, worktop
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

    def measured(self, slab: Slab) -> MeasuredObject:
        """The surrounding as a measured object, with its slab or a smaller one."""
        pose = Rigid3(slab.rotation, slab.rotation @ ((slab.low + slab.high) / 2))
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


def surroundings_of(capture: Capture, objects: Sequence[MeasuredObject], said: list[str]) -> list[Surrounding]:
    """Worktops over the runs of base units and plinths below them; none where a person clicked one.

    None without a floor either, since base units are identified by their height above it. `said` gets a line for every run
    where one could not be made.
    """
    if not capture.room.floor_found:
        return []
    counters, boards = list[Slab](), list[Slab]()
    with spared("the search for worktops and plinths failed", said):
        facets = facets_of(capture.surface)
        for run in runs_of(objects):
            with spared(f"no worktop was made over {_names(run)}", said):
                counters += worktop(capture, facets, run, objects, counters)
        for run in plinth_runs(objects):
            with spared(f"no plinth was made below {_names(run)}", said):
                boards += plinths(facets, run, objects, boards)
    names = {item.name for item in objects}
    return [*_named("counter", counters, names), *_named("plinth", boards, names)]


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
