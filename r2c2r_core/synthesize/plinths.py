"""The plinth below a run of base units, from the floor to their undersides."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from r2c2r_core.model.motion import Source
from r2c2r_core.synthesize.dimensions import MeasuredObject
from r2c2r_core.synthesize.facets import Colour, Facets, most_common
from r2c2r_core.synthesize.slabs import Params as SlabsParams
from r2c2r_core.synthesize.slabs import Slab
from r2c2r_core.synthesize.unit_runs import Interval, UnitRun, grouped, heights, is_front
from r2c2r_core.synthesize.unit_runs import Params as UnitRunsParams
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of plinths."""

    undersides_m: tuple[float, float] = param(
        (0.03, 0.25),
        "m",
        "Minimum and maximum height of the undersides above a plinth",
        source="lower there is no plinth; higher an object is missing that was not clicked",
    )
    thick_m: float = param(0.016, "m", "Thickness of its board")
    set_back_m: float = param(
        0.05, "m", "Distance behind the fronts, where the scan does not show it", source="kitchens leave 40-80 mm for the toes"
    )
    set_backs_m: tuple[float, float] = param(
        (0.005, 0.12), "m", "Minimum and maximum distance behind the fronts at which it is searched"
    )
    evidence: float = param(0.25, "share", "Minimum fraction of its face that the scan must show")
    facing: float = param(0.9, "cosine", "Minimum cosine between a surface normal and the fronts' direction")
    dull: float = param(0.6, "ratio", "Brightness of an unobserved plinth relative to the fronts, as it is in the shade")
    unseen: tuple[float, float, float] = param((0.8, 0.8, 0.8), "colour", "Colour of fronts that the scan does not show either")


class _Face(NamedTuple):
    """Position and colour of a plinth's face."""

    set_back_m: float
    source: Source
    colour: Colour


def plinth_runs(objects: Sequence[MeasuredObject]) -> list[UnitRun]:
    """Units that end above the floor, grouped by their front plane and their undersides."""
    low, high = tuned(Params).undersides_m
    return grouped([item for item in objects if is_front(item) and low < heights(item)[0] < high], side=0)


def plinths(facets: Facets, run: UnitRun, objects: Sequence[MeasuredObject], taken: Sequence[Slab]) -> list[Slab]:
    """A board under every row of a run; `facets` are in the world."""
    slabs_params = tuned(SlabsParams)
    params = tuned(Params)
    local, front, top = facets.turned(run.rotation), run.least(1), run.least(2) - slabs_params.clear_m
    corners = [run.corners(item) for item in objects]
    clicked = [c for c, item in zip(corners, objects, strict=True) if item.spec.opens == "fixed" and c[:, 2].max() < top]
    others = [*corners, *(slab.corners(run.rotation) for slab in taken)]
    found: list[Slab] = []
    for low, high in _rows(run):
        face = _face(local.where(local.within(0, low, high)), run, top, high - low)
        start = front + face.set_back_m
        board = Slab(
            run.rotation,
            np.array([low, start, slabs_params.clear_m / 4]),
            np.array([high, start + params.thick_m, top]),
            ("inferred", "inferred", "inferred"),
            face.colour,
            (f"set back by {1000 * face.set_back_m:.0f} mm, {face.source}",),
        )
        found += board.cut(others, clicked)
    return found


def _rows(run: UnitRun) -> Iterator[Interval]:
    """Stretches of units side by side."""
    params = tuned(UnitRunsParams)
    (low, high), *rest = run.stretches
    for start, end in rest:
        if start > high + params.seam_m:
            yield low, high
            low, high = start, end
        high = max(high, end)
    yield low, high


def _face(facets: Facets, run: UnitRun, top: float, length: float) -> _Face:
    """Face of a plinth from upright surface behind the front plane, below the units; else at the usual distance.

    `facets` are those along the row, in the run's frame.
    """
    params = tuned(Params)
    upright = facets.where(facets.normals[:, 1] < -params.facing)
    nearest, farthest = params.set_backs_m
    front = run.least(1)
    below = upright.where(upright.within(1, front + nearest, front + farthest) & upright.within(2, 0.1 * top, 0.9 * top))
    set_back = most_common(below.middles[:, 1] - front, below.areas, least=params.evidence * 0.8 * top * length)
    if set_back is not None:
        return _Face(set_back, "measured", below.colour)
    on_front = upright.where(upright.within(1, front - 2 * nearest, front + 2 * nearest) & upright.within(2, top, run.most(2)))
    red, green, blue = on_front.colour if len(on_front.areas) else params.unseen
    return _Face(params.set_back_m, "inferred", (params.dull * red, params.dull * green, params.dull * blue))
