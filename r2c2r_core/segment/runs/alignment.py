"""Invisible edges of fronts, taken from visible ones in the same row or column: fronts of a run end together."""

from collections.abc import Sequence
from dataclasses import replace

from r2c2r_core.segment.mosaics.edges import Params as EdgeParams
from r2c2r_core.segment.mosaics.edges import Refined, Surface, panel_edges
from r2c2r_core.segment.mosaics.orthomosaic import Cell
from r2c2r_core.segment.runs.contrast import SIDES, edges_of
from r2c2r_core.segment.runs.xy_cut import across
from r2c2r_core.tuning import tuned

_NAMES = ("left", "right", "top", "bottom")  # of SIDES


def aligned(refined: Refined, cut: Cell, cells: Sequence[Cell], surface: Surface, cell_m: float) -> Refined:
    """Panel whose invisible edges are moved to the same, visible edge of the nearest aligned front.

    Depth ends before an edge: a cut that followed it lies too far inside, by as much as depth may end short.
    """
    panel, reach = refined.panel, tuned(EdgeParams).depth_short_m / cell_m
    for name, (axis, end), at, shown in zip(_NAMES, SIDES, edges_of(cut), refined.shown, strict=True):
        if shown:
            continue
        in_line = [other for other in cells if other != cut and abs(across(other, axis)[end] - at) < reach]
        for other in sorted(in_line, key=lambda other: _between(other, cut, 1 - axis)):
            beside = panel_edges(other, surface, cell_m)
            found = edges_of(beside.panel)[_NAMES.index(name)]
            if beside.shown[_NAMES.index(name)] and 0 < (found - at) * (1 if end else -1) < reach:
                panel = replace(panel, **{name: found})
                break
    return refined._replace(panel=panel, lit_top=refined.lit_top if refined.shown[2] else panel.top)


def _between(one: Cell, other: Cell, axis: int) -> float:
    """Gap between two cells along an axis; 0 where they overlap."""
    (low, high), (first, last) = across(one, axis), across(other, axis)
    return max(first - high, low - last, 0.0)
