"""The plinth below a run of base units, from the floor to their undersides."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from r2c2r_core.model.scene import Source
from r2c2r_core.synthesize.dimensions import MeasuredObject
from r2c2r_core.synthesize.slabs import (
    CLEAR_M,
    Colour,
    Facets,
    Interval,
    Run,
    Slab,
    corners_of,
    cut,
    extent,
    grouped,
    is_front,
    median_colour,
    most_common,
)

_UNDERSIDES_M = (0.03, 0.25)  # lower there is no plinth; higher something is missing that nobody clicked
_THICK_M = 0.016
_SET_BACK_M = 0.05  # where the scan does not show it: kitchens leave 40-80 mm for the toes
_SET_BACKS_M = (0.005, 0.12)
_EVIDENCE = 0.25  # of its face
_FACING = 0.9
_SEAM_M = 0.03  # units this near to each other stand on one board
_DULL = 0.6  # of the fronts' colour: a plinth that no camera saw is in the shade


class _Face(NamedTuple):
    """What the scan shows of a plinth."""

    set_back_m: float
    source: Source
    colour: Colour


def plinth_runs(objects: Sequence[MeasuredObject]) -> list[Run]:
    """Units that end above the floor, grouped by their front plane and their undersides."""
    return grouped(
        [item for item in objects if is_front(item) and _UNDERSIDES_M[0] < extent(item, np.eye(3), 2)[0] < _UNDERSIDES_M[1]],
        side=0,
    )


def plinths(facets: Facets, run: Run, objects: Sequence[MeasuredObject], taken: Sequence[Slab]) -> list[Slab]:
    """A board under every row of a run."""
    front, top = run.least(1), run.least(2) - CLEAR_M
    corners = [corners_of(item, run.rotation) for item in objects]
    clicked = [c for c, item in zip(corners, objects, strict=True) if item.spec.opening == "fixed" and c[:, 2].max() < top]
    others = [*corners, *(slab.corners(run.rotation) for slab in taken)]
    found: list[Slab] = []
    for low, high in _rows(run):
        seen = _seen(facets, run, (low, high), front, top)
        start = front + seen.set_back_m
        board = Slab(
            run.rotation,
            np.array([low, start, CLEAR_M / 4]),
            np.array([high, start + _THICK_M, top]),
            ("inferred", "inferred", "inferred"),
            seen.colour,
            (f"set back by {1000 * seen.set_back_m:.0f} mm, {seen.source}",),
        )
        found += cut(board, others, clicked)
    return found


def _rows(run: Run) -> Iterator[Interval]:
    """Stretches of units side by side."""
    sides = sorted(run.interval(unit, 0) for unit in run.units)
    low, high = sides[0]
    for start, end in sides[1:]:
        if start > high + _SEAM_M:
            yield low, high
            low, high = start, end
        high = max(high, end)
    yield low, high


def _seen(facets: Facets, run: Run, along: Interval, front: float, top: float) -> _Face:
    """Where the scan shows upright surface behind the front plane, below the units; else what kitchens usually leave."""
    local, turned = facets.middles @ run.rotation, facets.normals @ run.rotation
    behind = local[:, 1] - front
    upright = (turned[:, 1] < -_FACING) & (behind > _SET_BACKS_M[0]) & (behind < _SET_BACKS_M[1])
    below = (local[:, 2] > 0.1 * top) & (local[:, 2] < 0.9 * top) & (local[:, 0] > along[0]) & (local[:, 0] < along[1])
    shown = upright & below
    set_back = most_common(behind[shown], facets.areas[shown], least=_EVIDENCE * 0.8 * top * (along[1] - along[0]))
    if set_back is not None:
        return _Face(set_back, "measured", median_colour(facets.colours[shown]))
    on_front = (turned[:, 1] < -_FACING) & (np.abs(behind) < _SET_BACKS_M[0] * 2) & (local[:, 2] > top)
    on_front &= (local[:, 2] < run.most(2)) & (local[:, 0] > along[0]) & (local[:, 0] < along[1])
    fronts = facets.colours[on_front] if on_front.any() else np.full((1, 3), 0.8)
    red, green, blue = median_colour(fronts)
    return _Face(_SET_BACK_M, "inferred", (_DULL * red, _DULL * green, _DULL * blue))
