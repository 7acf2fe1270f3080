"""Colour edges of a panel: near its cut, and below the shadow of a worktop."""

import cv2
import numpy as np
import pytest

from r2c2r_core.segment.mosaics.edges import Surface, as_lab, panel_edges
from r2c2r_core.segment.mosaics.orthomosaic import Cell

CELL_M = 0.0025
WALL, BLUE, STONE = (225, 225, 215), (70, 100, 130), (120, 120, 125)
PANEL = Cell(60, 60, 260, 300)
EDGE_CELLS = 2.0  # 5 mm: the blur of a mosaic


def mosaic(*areas: tuple[Cell, tuple[int, int, int]], background: tuple[int, int, int] = WALL, blur: float = 1.0) -> np.ndarray:
    image = np.full((360, 320, 3), background, np.uint8)
    for cell, colour in areas:
        image[round(cell.top) : round(cell.bottom), round(cell.left) : round(cell.right)] = colour
    return np.asarray(cv2.GaussianBlur(image, (0, 0), blur))


def area(cell: Cell) -> tuple[slice, slice]:
    return slice(round(cell.top), round(cell.bottom)), slice(round(cell.left), round(cell.right))


def edges(image: np.ndarray, cut: Cell, on_plane: Cell, *heights: tuple[Cell, float]) -> tuple[float, ...]:
    """Edges found when depth covers only the plane and parts at a height (m above the plane)."""
    height, points = np.zeros(image.shape[:2]), np.zeros(image.shape[:2])
    points[area(on_plane)] = 1
    for cell, height_m in heights:
        height[area(cell)], points[area(cell)] = height_m, 1
    found = panel_edges(cut, Surface(*as_lab(image), height, points), CELL_M)
    return found.left, found.top, found.right, found.bottom


def test_an_edge_follows_the_colour_change_where_depth_ends_3_cm_short() -> None:
    assert edges(mosaic((PANEL, BLUE)), PANEL, Cell(72, 72, 248, 288)) == pytest.approx((60, 60, 260, 300), abs=EDGE_CELLS)


def test_an_edge_stays_at_its_cut_where_nothing_shows_near_it() -> None:
    ivory, tile = (235, 234, 230), (Cell(60, 40, 260, 47), (205, 205, 200))  # 3 cm beyond
    assert edges(mosaic(tile, background=ivory), PANEL, PANEL)[1] == 60


def test_the_shadow_on_a_face_frame_does_not_move_the_front_under_it() -> None:
    """A worktop darkens the rail over an inset front, more so the nearer it is; the front begins where the shadow ends."""
    worktop = (Cell(40, 30, 280, 50), STONE)
    shade = [(Cell(60, row, 260, row + 1), in_shade(WALL, 0.3 + 0.03 * (row - 50))) for row in range(50, 60)]
    image = mosaic((Cell(60, 60, 260, 300), WALL), worktop, *shade)
    assert edges(image, PANEL, PANEL, (worktop[0], 0.02))[1] == pytest.approx(60, abs=EDGE_CELLS)


def test_a_cut_10_mm_outside_the_panel_moves_to_the_panel_edge() -> None:
    outside = Cell(56, 56, 264, 304)
    assert edges(mosaic((PANEL, BLUE)), outside, outside) == pytest.approx((60, 60, 260, 300), abs=EDGE_CELLS)


def test_a_front_that_begins_in_a_gap_at_the_mosaics_end_begins_there() -> None:
    """A front that begins where the mosaic does, as where the film shows no more of it."""
    cut = Cell(0, 60, 260, 300)
    columns = [(Cell(k, 60, k + 1, 300), shade) for k, shade in enumerate([BLUE, (55, 85, 115), (62, 92, 122), (73, 103, 133)])]
    image = mosaic((cut, BLUE), *columns, blur=0.3)
    assert edges(image, cut, cut)[0] == pytest.approx(2, abs=EDGE_CELLS)


def test_wood_grain_on_a_rail_is_not_taken_for_a_gap() -> None:
    oak, dark = (205, 170, 120), (197, 162, 112)
    grain = [(Cell(60, row, 260, row + 2), dark) for row in range(64, 84, 5)]
    assert edges(mosaic((PANEL, oak), *grain), PANEL, PANEL) == pytest.approx((60, 60, 260, 300), abs=EDGE_CELLS)


def in_shade(colour: tuple[int, int, int], share: float) -> tuple[int, int, int]:
    red, green, blue = (round(value * share ** (1 / 2.2)) for value in colour)
    return red, green, blue


@pytest.mark.parametrize("colour", [BLUE, WALL])
def test_a_worktop_shadow_belongs_to_the_panel(colour: tuple[int, int, int]) -> None:
    worktop, shadow = Cell(40, 46, 280, 60), Cell(60, 60, 260, 67)
    image = mosaic((PANEL, colour), (worktop, STONE), (shadow, in_shade(colour, 0.4)))
    assert edges(image, PANEL, PANEL)[1] == pytest.approx(60, abs=EDGE_CELLS)


def test_a_gap_between_two_panels_is_not_taken_for_a_shadow() -> None:
    upper, gap = Cell(60, 20, 260, 57), Cell(60, 57, 260, 60)
    image = mosaic((PANEL, BLUE), (upper, BLUE), (gap, in_shade(BLUE, 0.3)))
    assert edges(image, PANEL, PANEL)[1] == pytest.approx(59, abs=EDGE_CELLS)


@pytest.mark.parametrize("stone", [(190, 190, 185), (110, 112, 115)])
def test_a_blurred_shadow_ends_at_half_the_brightness_of_the_worktop(stone: tuple[int, int, int]) -> None:
    worktop, shadow = Cell(40, 30, 280, 60), Cell(60, 60, 260, 67)
    image = mosaic((PANEL, BLUE), (worktop, stone), (shadow, in_shade(BLUE, 0.35)), blur=1.8)
    assert edges(image, PANEL, PANEL)[1] == pytest.approx(60, abs=1.2)


def test_a_shadow_under_a_white_worktop_is_not_taken_for_a_gap() -> None:
    """The shadow fades from 5 to 30 mm below the worktop, as under room light."""
    white, shade = (178, 178, 172), np.interp(np.arange(20), [2, 12], [0.66, 1.0])
    image = np.full((360, 320, 3), white, np.float64)
    image[60:80, 60:260] *= shade[:, None, None] ** (1 / 2.2)
    found = edges(cv2.GaussianBlur(image, (0, 0), 0.7).astype(np.uint8), PANEL, PANEL, (Cell(40, 46, 280, 60), 0.02))
    assert found[1] == pytest.approx(60, abs=EDGE_CELLS)


def test_a_front_ends_above_a_channel_whose_top_is_hidden_from_depth() -> None:
    recess, lower = Cell(60, 300, 260, 313), Cell(60, 313, 260, 360)
    image = mosaic((PANEL, BLUE), (recess, (150, 150, 150)), (lower, BLUE), (Cell(60, 306, 260, 308), (60, 60, 60)))
    depth = ((Cell(60, 307, 260, 313), -0.022), (lower, 0.0))
    assert edges(image, Cell(60, 60, 260, 301), PANEL, *depth)[3] == pytest.approx(300, abs=1.5)


def test_mixed_depth_at_a_free_edge_does_not_move_the_edge() -> None:
    image = mosaic((PANEL, BLUE))
    flying = (Cell(60, 60, 260, 66), -0.015)  # depth at an edge is mixed with the surface behind it
    assert edges(image, PANEL, PANEL, flying)[1] == pytest.approx(60, abs=EDGE_CELLS)


def test_a_wall_darker_than_the_front_is_not_taken_for_a_shadow() -> None:
    wall = Cell(0, 0, 320, 60)
    image = mosaic((PANEL, (200, 203, 190)), (wall, (165, 171, 168)), (Cell(60, 50, 260, 60), in_shade((200, 203, 190), 0.7)))
    assert edges(image, PANEL, PANEL, (wall, -0.03))[1] == pytest.approx(60, abs=EDGE_CELLS)
