"""Contrast of a panel's edges on a mosaic: from a gap, or from the surroundings."""

import cv2
import numpy as np
import pytest

from r2c2r_core.segment.mosaics.orthomosaic import Cell
from r2c2r_core.segment.runs.contrast import edge_changes

PANEL = Cell(60, 60, 260, 300)
WALL, PAINT = (225, 225, 215), (215, 225, 225)
SIDES = ("left", "right", "upper", "lower")


def mosaic(fill: tuple[int, int, int], gap: str | None = None) -> np.ndarray:
    """A panel before a wall, with a gap at one of its edges, blurred like a mosaic."""
    image = np.full((360, 320, 3), WALL, np.uint8)
    corners = [(60, 60), (260, 60), (260, 300), (60, 300)]
    cv2.rectangle(image, corners[0], corners[2], fill, -1)
    if gap is not None:
        first = {"upper": 0, "right": 1, "lower": 2, "left": 3}[gap]
        cv2.line(image, corners[first], corners[(first + 1) % 4], (120, 120, 120), 1)
    return np.asarray(cv2.GaussianBlur(image, (0, 0), 0.8))


def test_a_panel_in_the_wall_colour_has_no_edge_contrast() -> None:
    assert max(edge_changes(mosaic(WALL), PANEL)) == pytest.approx(0, abs=0.1)


def test_a_hue_change_at_equal_lightness_gives_contrast_on_every_edge() -> None:
    assert min(edge_changes(mosaic(PAINT), PANEL)) > 3


@pytest.mark.parametrize("side", SIDES)
def test_a_gap_gives_contrast_only_at_its_own_edge(side: str) -> None:
    shown = dict(zip(SIDES, edge_changes(mosaic(WALL, gap=side), PANEL), strict=True))
    assert shown.pop(side) > 10
    assert max(shown.values()) < 3


def test_a_panel_that_fills_the_mosaic_has_four_edge_values() -> None:
    assert len(edge_changes(mosaic(PAINT)[58:302, 58:262], Cell(0, 0, 204, 244))) == 4


def test_an_edge_in_no_frame_has_no_contrast() -> None:
    hidden = mosaic(PAINT)
    hidden[290:] = 0  # a chair stood there
    shown = dict(zip(SIDES, edge_changes(hidden, PANEL), strict=True))
    assert shown.pop("lower") == 0
    assert min(shown.values()) > 3
    hidden[290:302] = PAINT  # the black ends at the edge
    assert edge_changes(hidden, PANEL)[3] == 0
