"""Where everything stands, from the scan alone (the paper places it by hand; method.md row 30).

Fronts of one run become coplanar and parallel, overlaps go by the smallest correction, things rest on what is below them.
Each correction is bounded by what measuring can be wrong by; how far each object moved is reported.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from r2c2r_core.arrays import Vector3
from r2c2r_core.geometry.boxes import Boxes, box_penetration
from r2c2r_core.synthesize.dimensions import MeasuredObject
from r2c2r_core.synthesize.edits import moved, trimmed
from r2c2r_core.synthesize.fillers import leave_fillers
from r2c2r_core.synthesize.lines import share_lines
from r2c2r_core.synthesize.runs import align_runs

GAP_M = 0.002  # left between neighbours
REST_GAP_M = 0.0005  # under a thing that stands on something: no contact at rest, no visible fall
_TRIM_M, _TRIM_SHARE = 0.012, 0.025  # how much an edge may retreat: an edge is measured to about 8 mm (backends.md 2.9)
_DROP_M = 0.015
_ROUNDS = 60


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Layout:
    """Objects where they stand, how far each was moved, and what a person should know."""

    objects: tuple[MeasuredObject, ...]
    moves_m: dict[str, float]
    warnings: tuple[str, ...]


def arrange(objects: Sequence[MeasuredObject], manhattan_yaw_rad: float, *, floor_found: bool) -> Layout:
    """Align the runs, share their lines, settle what stands, take overlaps apart, settle again."""
    placed = list(share_lines(leave_fillers(align_runs(objects, manhattan_yaw_rad))))
    placed = [settled(item, placed, floor_found=floor_found) for item in placed]
    placed, warnings = separated(placed)
    for i, item in enumerate(placed):
        lower = settled(item, placed, floor_found=floor_found)
        if not _collides(lower, [other for other in placed if other is not item]):
            placed[i] = lower
    moves = {
        before.name: float(np.linalg.norm(anchor(after) - anchor(before)))
        for before, after in zip(objects, placed, strict=True)
    }
    return Layout(objects=tuple(placed), moves_m=moves, warnings=tuple(warnings))


def anchor(item: MeasuredObject) -> Vector3:
    """The point whose move counts: the front's centre for furniture (its depth is often inferred), else the box centre."""
    rigid = item.spec.opening in ("rigid", "fixed")
    return item.world_from_object.translation if rigid else item.front_centre


def settled(item: MeasuredObject, others: Sequence[MeasuredObject], *, floor_found: bool) -> MeasuredObject:
    """The object lowered or raised onto its support: the top of an object below it, the scanned surface, or the floor."""
    if not item.spec.stands or item.fixed_by_person:
        return item
    bottom = item.world_from_object.translation[2] - item.dimensions_m[2] / 2
    tops = [_top(other) for other in others if other is not item and _carries(other, item)]
    if floor_found:
        tops.append(0.0)
    near = [top for top in tops if abs(top + REST_GAP_M - bottom) <= _DROP_M]
    if not near and item.support_z_m is not None and abs(item.support_z_m - bottom) <= _DROP_M:
        near = [item.support_z_m]
    if not near:
        return item
    return moved(item, np.array([0.0, 0.0, max(near) + REST_GAP_M - bottom]))


def separated(objects: Sequence[MeasuredObject]) -> tuple[list[MeasuredObject], list[str]]:
    """Objects with at least GAP_M between any two boxes: edges retreat where that is enough, else the lighter one moves."""
    items = list(objects)
    warnings: list[str] = []
    for _ in range(_ROUNDS):
        pairs = overlapping_pairs(items)
        if not pairs:
            return items, warnings
        first, second, _depth = max(pairs, key=lambda pair: pair[2])
        items[first], items[second] = _apart(items[first], items[second])
    for first, second, depth in overlapping_pairs(items):
        if depth > GAP_M:
            names = f"{items[first].name} and {items[second].name}"
            warnings.append(f"{names} still overlap by {1000 * (depth - GAP_M):.0f} mm: correct a size or a pose")
    return items, warnings


def overlapping_pairs(items: Sequence[MeasuredObject]) -> list[tuple[int, int, float]]:
    """Index pairs whose boxes come nearer than GAP_M (REST_GAP_M vertically, for what stands on the other), and by how much."""
    if len(items) < 2:
        return []
    first, second = np.triu_indices(len(items), 1)
    boxes = _boxes(items)
    grown = Boxes(boxes.centres, boxes.axes, boxes.halves + GAP_M / 2)
    depth = box_penetration(Boxes(*(v[first] for v in grown)), Boxes(*(v[second] for v in grown)))
    found = []
    for i, j, d in zip(first.tolist(), second.tolist(), depth.tolist(), strict=True):
        if d > 1e-6 and not _rests_on(items[i], items[j]) and not _rests_on(items[j], items[i]):
            if items[i].fixed_by_person and items[j].fixed_by_person:
                continue
            found.append((i, j, d))
    return found


def _apart(a: MeasuredObject, b: MeasuredObject) -> tuple[MeasuredObject, MeasuredObject]:
    """Two overlapping objects, taken apart by the cheapest of: drawing in edges, shortening inferred depths, moving."""
    options: list[tuple[float, MeasuredObject, MeasuredObject]] = []
    for axis, sign, overlap in _faces_between(a, b):
        need = overlap + 1e-5
        cost = _trim_cost(a, b, axis, need)
        if cost is not None:
            other_axis, other_sign = _facing_axis(b, -sign * a.world_from_object.rotation[:, axis])
            share_a, share_b = _shares(a, b)
            options.append((cost, trimmed(a, axis, sign, need * share_a), trimmed(b, other_axis, other_sign, need * share_b)))
        share_a, share_b = _move_shares(a, b)
        away = -sign * a.world_from_object.rotation[:, axis] * need
        vertical = 3.0 if axis == 2 and not (a.spec.stands or b.spec.stands) else 1.0
        options.append((need * vertical * 2, moved(a, away * share_a), moved(b, -away * share_b)))
    for shallow, other, order in ((a, b, False), (b, a, True)):
        amount = _depth_to_clear(shallow, other)
        if amount is not None:
            kept = trimmed(shallow, 1, 1.0, amount)
            options.append((0.3 * amount, *((other, kept) if order else (kept, other))))
    best = min(options, key=lambda option: option[0])
    return best[1], best[2]


def _faces_between(a: MeasuredObject, b: MeasuredObject) -> list[tuple[int, float, float]]:
    """Faces of `a` (axis, sign) towards `b`, and by how much b passes beyond each, gap included."""
    relative = a.world_from_object.rotation.T @ (b.world_from_object.translation - a.world_from_object.translation)
    turned = np.abs(a.world_from_object.rotation.T @ b.world_from_object.rotation)
    reach = (a.dimensions_m + turned @ b.dimensions_m) / 2
    overlap = reach + GAP_M - np.abs(relative)
    return [(axis, 1.0 if relative[axis] >= 0 else -1.0, float(overlap[axis])) for axis in range(3)]


def _trim_cost(a: MeasuredObject, b: MeasuredObject, axis: int, need: float) -> float | None:
    """What drawing in both facing edges costs; None when it is more than an edge can be wrong by, or the axes differ."""
    direction = a.world_from_object.rotation[:, axis]
    other_axis, _ = _facing_axis(b, direction)
    if abs(float(b.world_from_object.rotation[:, other_axis] @ direction)) < np.cos(np.deg2rad(1.0)):
        return None
    if axis == 1 or other_axis == 1:
        return None
    if "rigid" in (a.spec.opening, b.spec.opening):
        return None  # a thing keeps the size of its mesh
    for item, own, share in ((a, axis, _shares(a, b)[0]), (b, other_axis, _shares(a, b)[1])):
        if need * share > max(min(_TRIM_M, _TRIM_SHARE * float(item.dimensions_m[own])), GAP_M):
            return None
    return need * 0.5


def _shares(a: MeasuredObject, b: MeasuredObject) -> tuple[float, float]:
    if a.fixed_by_person != b.fixed_by_person:
        return (0.0, 1.0) if a.fixed_by_person else (1.0, 0.0)
    return 0.5, 0.5


def _move_shares(a: MeasuredObject, b: MeasuredObject) -> tuple[float, float]:
    """Who moves: what a person fixed stays; things give way to appliances, these to built-in furniture; equals share."""
    ranks = [3 if o.fixed_by_person else 0 if o.spec.opening == "rigid" else 1 if o.spec.stands else 2 for o in (a, b)]
    if ranks[0] != ranks[1]:
        return (1.0, 0.0) if ranks[0] < ranks[1] else (0.0, 1.0)
    return 0.5, 0.5


def _depth_to_clear(item: MeasuredObject, other: MeasuredObject) -> float | None:
    """How much of an unobserved depth to give up so that `item` clears `other`; None when that is too much or does not help."""
    if item.sources[1] not in ("inferred", "default") or item.spec.opening == "rigid":
        return None
    depth = float(item.dimensions_m[1])
    most = depth - max(0.6 * depth, min(item.spec.depth_range_m[0], depth))
    low, high = 0.0, most
    if most <= 0 or _gap_depth(trimmed(item, 1, 1.0, most), other) > 0:
        return None
    while high - low > 5e-4:
        middle = (low + high) / 2
        low, high = (middle, high) if _gap_depth(trimmed(item, 1, 1.0, middle), other) > 0 else (low, middle)
    return high


def _collides(item: MeasuredObject, others: Sequence[MeasuredObject]) -> bool:
    """Whether the object comes nearer to another than it may, other than by standing on it."""
    return any(0 in pair[:2] for pair in overlapping_pairs([item, *others]))


def _gap_depth(a: MeasuredObject, b: MeasuredObject) -> float:
    boxes = _boxes([a, b])
    grown = Boxes(boxes.centres, boxes.axes, boxes.halves + GAP_M / 2)
    return float(box_penetration(Boxes(*(v[:1] for v in grown)), Boxes(*(v[1:] for v in grown)))[0])


def _facing_axis(item: MeasuredObject, direction: Vector3) -> tuple[int, float]:
    """The face of `item` that looks along a world direction: axis and sign in its own frame."""
    along = item.world_from_object.rotation.T @ direction
    axis = int(np.argmax(np.abs(along)))
    return axis, float(np.sign(along[axis]))


def _rests_on(top: MeasuredObject, below: MeasuredObject) -> bool:
    """Whether `top` stands on `below` with the clearance it should have."""
    gap = top.world_from_object.translation[2] - top.dimensions_m[2] / 2 - _top(below)
    return top.spec.stands and _carries(below, top) and abs(gap - REST_GAP_M) < 1e-4


def _carries(below: MeasuredObject, item: MeasuredObject) -> bool:
    """Whether the item's middle stands over `below`, or a third of its plan does."""
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
