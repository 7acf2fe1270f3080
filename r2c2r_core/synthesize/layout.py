"""Layout of all objects from the scan alone (the paper arranges them by hand; method.md row 30).

Fronts of one run become parallel and coplanar, objects rest on what is below them, and one small optimisation (solve.py) gives
runs their shared lines and seams and resolves overlaps with the least change of the measurements. Each change is bounded by the
measurement uncertainty; the displacement of each object is reported.
"""

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from r2c2r_core.arrays import Vector3
from r2c2r_core.failing import OBJECT_FAILS, spared
from r2c2r_core.geometry.boxes import Boxes, box_penetration
from r2c2r_core.synthesize.dimensions import MeasuredObject
from r2c2r_core.synthesize.edits import moved
from r2c2r_core.synthesize.fillers import leave_fillers
from r2c2r_core.synthesize.laps import lap_of
from r2c2r_core.synthesize.runs import align_runs, level_runs
from r2c2r_core.synthesize.solve import solved, strain
from r2c2r_core.synthesize.ties import ties_of
from r2c2r_core.synthesize.unit_runs import with_one_back
from r2c2r_core.tuning import param, tuned

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned gaps and limits of the layout."""

    gap_m: float = param(0.002, "m", "Gap between neighbours")
    rest_gap_m: float = param(0.0005, "m", "Gap under a standing object: no contact at rest, no visible fall")
    drop_m: float = param(0.015, "m", "Maximum distance between an object's underside and its support")
    far_m: float = param(
        0.035, "m", "Displacement above which an object is reported: more than fillers and measurement errors explain"
    )
    rounds: int = param(6, "count", "Maximum number of rounds that add overlapping pairs", ge=1)
    outlier: float = param(
        12.0, "σ", "Overlap in standard deviations of measurement above which one of the two objects is an outlier", gt=0
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Layout:
    """Objects at their final poses, how far each was moved, and warnings for a person."""

    objects: tuple[MeasuredObject, ...]
    moves_m: dict[str, float]
    warnings: tuple[str, ...]
    outliers: dict[str, str]  # by object, the reason in one line: objects incompatible with the others, which they did not move


def arrange(objects: Sequence[MeasuredObject], manhattan_yaw_rad: float, *, floor_found: bool) -> Layout:
    """Layout with aligned runs, supported objects, and shared lines without overlaps.

    Outliers are not among the layout's objects: they remain as measured and have no effect.
    """
    params, outliers, unseen = tuned(Params), dict[str, str](), list[str]()
    with spared("the search for impossible objects failed", unseen):
        outliers = outliers_of(objects)
    objects = [item for item in objects if item.name not in outliers]
    levelled = aligned = list(align_runs(objects, manhattan_yaw_rad))
    with spared("the lines of runs were not levelled", unseen):
        levelled, said = level_runs(aligned)
        unseen += said
    placed = with_one_back(leave_fillers(levelled))
    placed = [settled(item, placed, floor_found=floor_found) for item in placed]
    placed, warnings = solved_apart(placed)
    warnings = [*unseen, *warnings]
    moves = {
        before.name: float(np.linalg.norm(anchor(after) - anchor(level) + anchor(line) - anchor(before)))  # but for the level
        for before, line, level, after in zip(objects, aligned, levelled, placed, strict=True)
    }
    warnings += [
        f"{name} was moved by {1000 * by:.0f} mm: check its size and pose" for name, by in moves.items() if by > params.far_m
    ]
    return Layout(objects=tuple(placed), moves_m=moves, warnings=tuple(warnings), outliers=outliers)


def with_outliers(layout: Layout, measured: Sequence[MeasuredObject]) -> Layout:
    """The layout with its outliers included as measured, each with its warning."""
    kept = [item for item in measured if item.name in layout.outliers]
    return Layout(
        objects=(*layout.objects, *kept),
        moves_m=layout.moves_m | {item.name: 0.0 for item in kept},
        warnings=(*layout.warnings, *(f"{name}: {why}" for name, why in layout.outliers.items())),
        outliers={},
    )


def outliers_of(objects: Sequence[MeasuredObject]) -> dict[str, str]:
    """Objects to remove so that the rest are compatible, with reasons, among those that overlap beyond measurement errors.

    The one in most such overlaps is removed first; among equals one that was not filmed while it opened, which confirms its
    edges, and of those the one whose size and front are less likely. Objects that a person placed are kept.
    """
    params, found = tuned(Params), dict[str, str]()
    clashes = {
        (objects[i].name, objects[j].name): depth
        for i, j, depth in overlapping_pairs(objects)
        if strain(objects, (i, j), params.gap_m) > params.outlier
    }
    likely, filmed = {item.name: _likely(item) for item in objects}, {item.name for item in objects if item.motions}
    while clashes:
        names = [name for pair in clashes for name in pair]
        worst = max(
            dict.fromkeys(names),
            key=lambda name: (likely[name] < np.inf, names.count(name), name not in filmed, -likely[name]),
        )
        if likely[worst] == np.inf:
            break
        others = {other: depth for pair, depth in clashes.items() if worst in pair for other in pair if other != worst}
        said = ", ".join(f"{other} by {1000 * depth:.0f} mm" for other, depth in others.items())
        mend = "delete it if it is one of them, else click it again"
        found[worst] = f"as measured it overlaps {said}, which agree without it; {mend}"
        clashes = {pair: depth for pair, depth in clashes.items() if worst not in pair}
    return found


def _likely(item: MeasuredObject) -> float:
    """Likelihood score of a measurement; infinite if a person gave it."""
    width, _, height = item.dimensions_m
    fit = item.spec.width.fit(float(width)) * item.spec.height.fit(float(height))
    return float("inf") if item.fixed_by_person else float(item.confidence * fit)


def anchor(item: MeasuredObject) -> Vector3:
    """Reference point of a displacement: the front's centre for furniture (its depth is often inferred), else the box's."""
    rigid = item.spec.opens in ("rigid", "fixed")
    return item.world_from_object.translation if rigid else item.front_centre


def settled(item: MeasuredObject, others: Sequence[MeasuredObject], *, floor_found: bool) -> MeasuredObject:
    """The object moved vertically onto its support: the top of an object below it, the scanned surface, or the floor."""
    if not item.spec.stands or item.fixed_by_person:
        return item
    said: list[str] = []
    with spared("it was not put on its support", said):
        return _on_support(item, others, floor_found=floor_found)
    return replace(item, warnings=(*item.warnings, *said))


def _on_support(item: MeasuredObject, others: Sequence[MeasuredObject], *, floor_found: bool) -> MeasuredObject:
    params = tuned(Params)
    bottom = item.world_from_object.translation[2] - item.dimensions_m[2] / 2
    tops = [_top(other) for other in others if other is not item and _carries(other, item)]
    if floor_found:
        tops.append(0.0)
    near = [top for top in tops if abs(top + params.rest_gap_m - bottom) <= params.drop_m]
    if floor_found and bottom < 0.0:  # at any distance: nothing stands below the floor
        near.append(0.0)
    if not near and item.support_z_m is not None and abs(item.support_z_m - bottom) <= params.drop_m:
        near = [item.support_z_m]
    if not near:
        return item
    return moved(item, np.array([0.0, 0.0, max(near) + params.rest_gap_m - bottom]))


def solved_apart(objects: Sequence[MeasuredObject]) -> tuple[list[MeasuredObject], list[str]]:
    """Objects that satisfy their ties with at least `gap_m` between any two boxes; pairs are added until none overlaps."""
    params = tuned(Params)
    items, warnings = list(objects), []
    try:
        items = _solved_in_rounds(objects)
    except OBJECT_FAILS as error:  # one bad box must not fail the kitchen
        _log.warning("the layout was not solved", exc_info=error)
        warnings.append(f"the layout was not solved ({error}): all objects stay as measured; check sizes and poses")
    with spared("the search for overlaps failed", warnings):
        for first, second, depth in overlapping_pairs(items):
            if depth > params.gap_m:
                names = f"{items[first].name} and {items[second].name}"
                warnings.append(f"{names} still overlap by {1000 * (depth - params.gap_m):.0f} mm: correct a size or a pose")
    return items, warnings


def _solved_in_rounds(objects: Sequence[MeasuredObject]) -> list[MeasuredObject]:
    params = tuned(Params)
    ties, apart = ties_of(objects), list[tuple[int, int]]()
    items = solved(objects, ties, apart, params.gap_m)
    for _ in range(params.rounds):
        pairs = [(i, j) for i, j, _ in overlapping_pairs(items) if (i, j) not in apart]
        if not pairs:
            break
        apart += pairs
        items = solved(objects, ties, apart, params.gap_m)
    return items


def overlapping_pairs(items: Sequence[MeasuredObject]) -> list[tuple[int, int, float]]:
    """Index pairs whose boxes are closer than `gap_m` (`rest_gap_m` vertically on a support), and by how much.

    Leaves that pass each other share one body but have their own tracks: they are not separated, nor is a thing that stands in
    a unit, behind its front, nor two free things: their colliders decide (parting.py).
    """
    if len(items) < 2:
        return []
    first, second = np.triu_indices(len(items), 1)
    boxes = _boxes(items)
    grown = Boxes(boxes.centres, boxes.axes, boxes.halves + tuned(Params).gap_m / 2)
    depth = box_penetration(Boxes(*(v[first] for v in grown)), Boxes(*(v[second] for v in grown)))
    found = []
    for i, j, d in zip(first.tolist(), second.tolist(), depth.tolist(), strict=True):
        if d > 1e-6 and not _rests_on(items[i], items[j]) and not _rests_on(items[j], items[i]):
            if (items[i].fixed_by_person and items[j].fixed_by_person) or lap_of(items[i], items[j]) is not None:
                continue
            free = items[i].spec.opens == items[j].spec.opens == "rigid"
            if free or _stands_in(items[i], items[j]) or _stands_in(items[j], items[i]):
                continue
            found.append((i, j, d))
    return found


def _rests_on(top: MeasuredObject, below: MeasuredObject) -> bool:
    """Whether `top` stands on `below` with the specified clearance."""
    gap = top.world_from_object.translation[2] - top.dimensions_m[2] / 2 - _top(below)
    return top.spec.stands and _carries(below, top) and abs(gap - tuned(Params).rest_gap_m) < 1e-4


def _stands_in(thing: MeasuredObject, unit: MeasuredObject) -> bool:
    """Whether a thing's centre lies in a unit that opens."""
    local = unit.world_from_object.inverse.apply(thing.world_from_object.translation)
    opens = unit.spec.opens not in ("rigid", "fixed")
    return thing.spec.kind == "thing" and opens and bool((np.abs(local) < unit.dimensions_m / 2).all())


def _carries(below: MeasuredObject, item: MeasuredObject) -> bool:
    """Whether `below` is lower than the item and supports at least a third of its plan."""
    corners = np.array([[x, y] for x in np.linspace(-0.5, 0.5, 5) for y in np.linspace(-0.5, 0.5, 5)])
    plan = np.column_stack([corners * item.dimensions_m[:2], np.zeros(len(corners))])
    inside = (
        np.abs(below.world_from_object.inverse.apply(item.world_from_object.apply(plan))[:, :2]) <= below.dimensions_m[:2] / 2
    )
    lower = below.world_from_object.translation[2] < item.world_from_object.translation[2]
    return bool(lower and inside.all(axis=1).mean() > 0.3)


def _top(item: MeasuredObject) -> float:
    return float(item.world_from_object.translation[2] + item.dimensions_m[2] / 2)


def _boxes(items: Sequence[MeasuredObject]) -> Boxes:
    return Boxes(
        np.array([item.world_from_object.translation for item in items]),
        np.array([item.world_from_object.rotation for item in items]),
        np.array([item.dimensions_m / 2 for item in items]),
    )
