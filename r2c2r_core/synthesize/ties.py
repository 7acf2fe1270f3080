"""Equality constraints of a run's fronts: their common plane, tops and bottoms, and the seams between them.

A seam measured from both sides is known better than either edge: n + 1 seams instead of 2 n edges reduce the width error from
1.7 to 1.4 % and overlaps to zero (backends.md 2.9). Only faces within the measurement error are tied.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise

import numpy as np

from r2c2r_core.synthesize.dimensions import MeasuredObject
from r2c2r_core.synthesize.fixtures.carcass import Params as CarcassParams
from r2c2r_core.synthesize.laps import lap_of
from r2c2r_core.synthesize.runs import built_in, coplanar_fronts
from r2c2r_core.synthesize.solve import Face, Tie
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned tolerances of ties."""

    seam_m: tuple[float, float] = param(
        (-0.012, 0.015),
        "m",
        "Range of the gap (negative: overlap) within which two edges form one seam",
        source="gaps are 2-4 mm, end panels 16-19 mm",
    )
    line_m: float = param(0.02, "m", "Maximum height step to the next top of one line, of a levelled run")
    slit_m: float = param(0.02, "m", "Maximum gap between a unit and the board above or below it: more is a real step")


def ties_of(items: Sequence[MeasuredObject]) -> list[Tie]:
    """Ties for every plane, line and seam that built-in fronts share; `items` are already aligned in runs."""
    ties: list[Tie] = []
    for plane in coplanar_fronts(items):
        ties += [Tie(first=Face(a, 1, -1.0), second=Face(b, 1, -1.0)) for a, b in pairwise(plane)]
        for sign in (1.0, -1.0):
            ties += _levels(items, plane, sign)
        for axis in (0, 2):
            ties += _seams(items, plane, axis)
    return [*ties, *_tracks(items), *_closed(items)]


def _tracks(items: Sequence[MeasuredObject]) -> Iterator[Tie]:
    """Ties of leaves that pass each other in one pair of profiles: their tops and their bottoms are level."""
    for (i, a), (j, b) in combinations(enumerate(items), 2):
        if lap_of(a, b) is not None and not (a.fixed_by_person or b.fixed_by_person):
            near = (sign for sign in (1.0, -1.0) if abs(_edge(a, 2, sign) - _edge(b, 2, sign)) < tuned(Params).line_m)
            yield from (Tie(first=Face(i, 2, sign), second=Face(j, 2, sign)) for sign in near)


def _closed(items: Sequence[MeasuredObject]) -> Iterator[Tie]:
    """Ties of worktops to the highest unit below them, and of plinths to the lowest one above: no slit between."""
    params = tuned(Params)
    carcass_params = tuned(CarcassParams)
    units = [i for i, item in enumerate(items) if built_in(item) and item.spec.opens != "rigid"]
    for i, item in enumerate(items):
        if item.spec.opens != "fixed" or item.fixed_by_person:
            continue
        near = [j for j in units if _one_above_the_other(items[j], item)]
        below = [j for j in near if abs(_edge(item, 2, -1.0) - _edge(items[j], 2, 1.0)) < params.slit_m]
        above = [j for j in near if abs(_edge(items[j], 2, -1.0) - _edge(item, 2, 1.0)) < params.slit_m]
        if below:
            highest = max(below, key=lambda j: _edge(items[j], 2, 1.0))
            yield Tie(first=Face(highest, 2, 1.0), second=Face(i, 2, -1.0), gap_m=carcass_params.front_gap_m)
        elif above:
            lowest = min(above, key=lambda j: _edge(items[j], 2, -1.0))
            yield Tie(first=Face(i, 2, 1.0), second=Face(lowest, 2, -1.0), gap_m=carcass_params.front_gap_m)


def _one_above_the_other(a: MeasuredObject, b: MeasuredObject) -> bool:
    """Whether their plans overlap."""
    turn = b.world_from_object.rotation.T
    apart = np.abs(turn @ (a.world_from_object.translation - b.world_from_object.translation))
    reach = (b.dimensions_m + np.abs(turn @ a.world_from_object.rotation) @ a.dimensions_m) / 2
    return bool((apart[:2] < reach[:2] - tuned(Params).slit_m / 2).all())


def _levels(items: Sequence[MeasuredObject], plane: Sequence[int], sign: float) -> Iterator[Tie]:
    """Ties of closely spaced tops (+1) or bottoms (-1) to one line."""
    left = sorted(plane, key=lambda i: _edge(items[i], 2, sign))
    params = tuned(Params)
    while left:
        line = [left.pop(0)]
        while left and _edge(items[left[0]], 2, sign) < _edge(items[line[-1]], 2, sign) + params.line_m:
            line.append(left.pop(0))
        yield from (Tie(first=Face(a, 2, sign), second=Face(b, 2, sign)) for a, b in pairwise(line))


def _seams(items: Sequence[MeasuredObject], plane: Sequence[int], axis: int) -> Iterator[Tie]:
    """Ties with one gap of 3 mm where the edges of two neighbours nearly meet."""
    params = tuned(Params)
    carcass_params = tuned(CarcassParams)
    across = 2 if axis == 0 else 0
    for i in plane:
        for j in plane:
            gap = _edge(items[j], axis, -1.0) - _edge(items[i], axis, 1.0)
            if i != j and params.seam_m[0] < gap < params.seam_m[1] and _beside(items[i], items[j], across):
                yield Tie(first=Face(i, axis, 1.0), second=Face(j, axis, -1.0), gap_m=carcass_params.front_gap_m)


def _beside(a: MeasuredObject, b: MeasuredObject, across: int) -> bool:
    """Whether two fronts share at least half of the shorter one's side."""
    shared = min(_edge(a, across, 1.0), _edge(b, across, 1.0)) - max(_edge(a, across, -1.0), _edge(b, across, -1.0))
    return shared > 0.5 * min(float(a.dimensions_m[across]), float(b.dimensions_m[across]))


def _edge(item: MeasuredObject, axis: int, sign: float) -> float:
    """Position of a face along the object's own axis, in the world."""
    return float(
        item.world_from_object.translation @ item.world_from_object.rotation[:, axis] + sign * item.dimensions_m[axis] / 2
    )
