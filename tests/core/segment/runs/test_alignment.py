"""Invisible edges taken from fronts in line."""

import numpy as np
import pytest

from r2c2r_core.segment.mosaics.edges import Surface, as_lab, panel_edges
from r2c2r_core.segment.mosaics.orthomosaic import Cell
from r2c2r_core.segment.runs.alignment import aligned

CELL_M = 0.0025
WHITE, SHADE = (235, 235, 232), (150, 150, 150)
CUTS = (Cell(20, 52, 100, 300), Cell(100, 52, 200, 300), Cell(200, 52, 280, 300))  # depth ended 30 mm below the tops at 40
LOW = Cell(280, 90, 360, 300)


def topped(cuts: tuple[Cell, ...], shown: int, cut: Cell) -> float:
    """The upper edge of a white front before a white wall, where only one front's, `shown`, is visible."""
    image = np.full((340, 380, 3), WHITE, np.uint8)
    for cell in cuts:
        image[round(cell.top) : 300, round(cell.left) : round(cell.left) + 1] = SHADE
    over = cuts[shown]
    image[30:40, round(over.left) : round(over.right)] = SHADE
    nothing = np.zeros(image.shape[:2])
    surface = Surface(*as_lab(image), nothing, nothing)
    return aligned(panel_edges(cut, surface, CELL_M), cut, cuts, surface, CELL_M).panel.top


@pytest.mark.parametrize("shown", [0, 2])
def test_an_invisible_top_edge_aligns_with_the_nearest_visible_one(shown: int) -> None:
    assert topped(CUTS, shown, CUTS[1]) == pytest.approx(40, abs=1.5)
    assert topped(CUTS, shown, CUTS[2 - shown]) == pytest.approx(40, abs=1.5)  # across another invisible one


def test_a_front_cut_much_lower_keeps_its_own_top_edge() -> None:
    assert topped((*CUTS, LOW), 2, LOW) == pytest.approx(LOW.top, abs=1.5)
