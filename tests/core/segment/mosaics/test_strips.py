"""Strips of another material along the fronts, distinguished from parts of the front."""

import numpy as np
import pytest

from r2c2r_core.segment.mosaics.edges import Surface, as_lab
from r2c2r_core.segment.mosaics.orthomosaic import Cell
from r2c2r_core.segment.mosaics.strips import clear_of_strips

CELL_M = 0.0025
RED, BLACK, GREY, WHITE = (150, 30, 35), (25, 25, 28), (150, 160, 165), (235, 235, 232)
PANEL = Cell(80, 60, 260, 340)  # as cut: 45 x 70 cm
Colour = tuple[int, int, int]


def mosaic(front: Colour, *, around: Colour = WHITE) -> np.ndarray:
    """A row of three fronts of that colour."""
    rng = np.random.default_rng(0)
    image = np.zeros((400, 340, 3), np.float32)
    image[:], image[60:340] = around, front
    return image + rng.normal(0, 2, image.shape)


def cleared(image: np.ndarray, cut: Cell = PANEL) -> tuple[float, float]:
    """Number of cells by which the upper and lower edge of a panel move inwards."""
    nothing = np.zeros(image.shape[:2])
    surface = Surface(*as_lab(image.clip(1, 255).astype(np.uint8)), nothing, nothing)
    panel = clear_of_strips(cut, surface, CELL_M)
    assert (panel.left, panel.right) == (cut.left, cut.right)
    return panel.top - cut.top, cut.bottom - panel.bottom


@pytest.mark.parametrize(("front", "strip"), [(RED, BLACK), (WHITE, BLACK), (BLACK, WHITE), (RED, GREY)])
def test_a_worktop_edge_and_a_plinth_are_excluded_from_a_front(front: Colour, strip: Colour) -> None:
    image = mosaic(front)
    image[60:76], image[320:340] = strip, strip
    assert cleared(image) == pytest.approx((16, 20), abs=1.5)


def test_a_worktop_edge_is_excluded_from_a_14_cm_high_drawer() -> None:
    image = mosaic(RED)
    image[60:76] = BLACK
    assert cleared(image, Cell(80, 60, 260, 132)) == pytest.approx((16, 0), abs=1.5)


def test_a_handle_below_the_worktop_stays_on_the_front() -> None:
    image = mosaic(RED)
    image[60:76] = BLACK
    image[82:88, 140:200] = GREY
    assert cleared(image) == pytest.approx((16, 0), abs=1.5)


def test_a_shadow_stays_part_of_the_front() -> None:
    image = mosaic(RED)
    image[60:72] *= 0.5
    assert cleared(image) == (0, 0)


def test_rails_shared_by_neighbouring_fronts_stay_part_of_a_front() -> None:
    image = mosaic(WHITE)
    for left in (-100, 80, 260):
        image[84:316, max(left, 0) + 24 : left + 156] = BLACK  # glass
    assert cleared(image) == (0, 0)


def test_a_control_panel_as_wide_as_its_front_stays_part_of_it() -> None:
    image = mosaic(WHITE)
    image[60:84, 80:260] = BLACK
    assert cleared(image) == (0, 0)


def test_an_unobserved_panel_stays_as_cut() -> None:
    nothing = np.zeros((400, 340))
    surface = Surface(*as_lab(np.zeros((400, 340, 3), np.uint8)), nothing, nothing)
    assert clear_of_strips(PANEL, surface, CELL_M) == PANEL
