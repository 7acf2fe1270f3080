"""Overlap of sliding leaves: which pass each other, where they overlap, and how much of the rear one is hidden."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from r2c2r_core.synthesize.dimensions import MeasuredObject
from r2c2r_core.synthesize.edits import edge_moved
from r2c2r_core.synthesize.fixtures.spec import Lap
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of leaves on parallel tracks."""

    overlap_m: tuple[float, float] = param(
        (0.015, 0.05),
        "m",
        "Minimum and maximum overlap of leaves, regardless of their measured widths",
        source="makers of sliding doors: 20 mm at each joint of two, three or four doors, more where stiles meet",
    )
    step_m: tuple[float, float] = param(
        (0.008, 0.07),
        "m",
        "Minimum and maximum offset between the faces of two leaves: less is a single track",
        source="panes of glass of 5 mm in one profile; double tracks of wardrobes are 80 mm deep in all",
    )
    apart_m: float = param(
        0.09,
        "m",
        "Maximum gap between the segmented parts of two leaves that overlap",
        source="a mask that ends at the recessed panel of a framed leaf misses its stile of 50-90 mm",
    )
    level_m: float = param(
        0.02,
        "m",
        "Height difference of tops, or bottoms, above which the front leaf's replaces the rear one's, which it shades",
    )


def lapped(objects: Sequence[MeasuredObject]) -> tuple[MeasuredObject, ...]:
    """The objects, every sliding leaf with the leaves that it passes at their final poses."""
    return tuple(replace(item, laps=_laps(item, objects)) for item in objects)


def lap_of(item: MeasuredObject, other: MeasuredObject) -> Lap | None:
    """Overlap of two leaves of one unit as seen from the first; None if they do not pass each other."""
    params = tuned(Params)
    sideways = item.spec.opens == other.spec.opens == "sideways"
    if item is other or not sideways or float(item.outward @ other.outward) < 0.99:
        return None
    x, behind, z = item.world_from_object.rotation.T @ (other.front_centre - item.front_centre)
    (width, _, height), (other_width, _, other_height) = item.dimensions_m, other.dimensions_m
    overlap = float((width + other_width) / 2 - abs(x))
    level = (height + other_height) / 2 - abs(z) > 0.5 * min(height, other_height)
    tracks = params.step_m[0] <= abs(behind) <= params.step_m[1]
    if not (level and tracks and -params.apart_m < overlap < params.overlap_m[1] + params.apart_m):
        return None
    return Lap(
        other=other.name,
        side="right" if x > 0 else "left",
        overlap_m=overlap,
        behind_m=float(behind),
        reach_m=float(other_width - overlap),
    )


def with_hidden_edges(objects: Sequence[MeasuredObject]) -> list[MeasuredObject]:
    """The objects, with rear leaves as wide as those in front of them and level with them.

    Leaves of one unit are; an edge behind another leaf is hidden, and a top that ends elsewhere was segmented wrongly. A leaf
    that already reaches behind the other is unchanged.
    """
    return [_with_hidden_edges(item, objects) for item in objects]


def _laps(item: MeasuredObject, objects: Sequence[MeasuredObject]) -> tuple[Lap, ...]:
    return tuple(lap for other in objects if (lap := lap_of(item, other)) is not None)


def _with_hidden_edges(item: MeasuredObject, objects: Sequence[MeasuredObject]) -> MeasuredObject:
    params = tuned(Params)
    hidden = [lap for lap in _laps(item, objects) if lap.behind_m < 0]
    cut_short = any(lap.overlap_m < params.overlap_m[0] for lap in hidden)  # as seen by a camera; a person draws the whole leaf
    if not cut_short or item.fixed_by_person:
        return item
    names = {lap.other for lap in hidden}
    before = [other for other in objects if other.name in names]
    wanted = float(np.mean([other.dimensions_m[0] for other in before]))
    seen_m = float(item.dimensions_m[0]) - sum(lap.overlap_m for lap in hidden)
    overlap_m = float(np.clip((wanted - seen_m) / len(hidden), *params.overlap_m))
    pose = item.world_from_object
    for lap in hidden:
        item = edge_moved(item, 0, 1.0 if lap.side == "right" else -1.0, lap.overlap_m - overlap_m)
    _, depth_source, height_source = item.sources
    for sign in (-1.0, 1.0):
        off = sign * (_end_z(item, sign) - float(np.mean([_end_z(other, sign) for other in before])))
        if abs(off) > params.level_m:
            item, height_source = edge_moved(item, 2, sign, off), "inferred"
    shift = item.world_from_object @ pose.inverse
    # the mesh stays where it was placed: only the box grew
    return replace(item, placed_pose=shift @ item.placed_pose, sources=("inferred", depth_source, height_source))


def _end_z(item: MeasuredObject, sign: float) -> float:
    """Height of its top (+1) or bottom (-1) in the world."""
    return float(item.world_from_object.translation[2] + sign * item.dimensions_m[2] / 2)
