"""Inset fronts in a face frame versus recessed panels in a front: the gaps around the front end before its rails and stiles."""

from collections.abc import Sequence

import cv2
import numpy as np
import pytest

from r2c2r_core.segment.mosaics.orthomosaic import STEP, Cell
from r2c2r_core.segment.mosaics.panel_net import PanelOdds
from r2c2r_core.segment.mosaics.relief import Relief
from r2c2r_core.segment.runs.contrast import Contrast
from r2c2r_core.segment.runs.face_frames import inset_fronts, is_rail

CELL_M = 0.0025
FRONT = Cell(60, 60, 260, 300)
RAIL = 15  # cells: 37.5 mm
CLOSE = 1.5  # cells: 4 mm


def mosaic(*gaps: Cell, dark: int = 90, worktop: int = 0, grain: Sequence[Cell] = ()) -> Contrast:
    """Lightness of uniform paint with outlines of gaps, one cell wide, blurred like a mosaic, with a little noise.

    A worktop above casts a shadow that ends at a row. Outlines of grain are fainter than gaps.
    """
    light = np.full((360, 320), 170, np.uint8)
    light[:worktop], light[max(worktop - 3, 0) : worktop] = 110, 80
    for outline, shade in [*((each, 130) for each in grain), *((each, dark) for each in gaps)]:
        corners = (round(outline.left), round(outline.top)), (round(outline.right), round(outline.bottom))
        cv2.rectangle(light, *corners, shade, 1)
    noise = np.random.default_rng(0).normal(0, 1.0, light.shape)
    return Contrast(cv2.GaussianBlur(light.astype(np.float32), (0, 0), 0.8) + noise)


def odds(edge: float = -2.0) -> PanelOdds:
    """Log-odds of the network: all of it a front, no edge likely anywhere, and none ruled out."""
    none = np.full((180, 160), edge, np.float32)
    return PanelOdds(upright=none, level=none, handle=np.full_like(none, -4.0), front=np.full_like(none, 4.0))


def relief(behind_m: float = 0.0, within: Cell = FRONT) -> Relief:
    """Relief of a single plane except for a region that far behind it, to a millimetre per point."""
    level = np.random.default_rng(1).normal(0, 0.001, (180, 160))
    left, top, right, bottom = (round(edge / STEP) for edge in edges(within))
    level[top:bottom, left:right] -= behind_m
    none = np.zeros(level.shape)
    return Relief(CELL_M * STEP, none + 10, none, none, level)


def grown(left: float = 0, top: float = 0, right: float = 0, bottom: float = 0) -> Cell:
    return Cell(FRONT.left - left, FRONT.top - top, FRONT.right + right, FRONT.bottom + bottom)


def edges(cell: Cell) -> tuple[float, ...]:
    return cell.left, cell.top, cell.right, cell.bottom


@pytest.mark.parametrize(
    "cut", [grown(top=RAIL), grown(left=2 * RAIL), grown(top=RAIL, bottom=RAIL), grown(left=2 * RAIL, top=RAIL, right=2 * RAIL)]
)
def test_a_front_is_bounded_by_its_gaps_without_the_face_frame(cut: Cell) -> None:
    cells = inset_fronts(mosaic(FRONT), relief(), odds(), [cut], CELL_M)
    assert edges(cells[0]) == pytest.approx(edges(FRONT), abs=CLOSE)
    assert sum(cell.width * cell.height for cell in cells) == pytest.approx(cut.width * cut.height)  # they tile it


def test_wood_grain_is_no_gap_where_the_network_excludes_edges() -> None:
    cut, lowest = grown(left=2 * RAIL, top=RAIL, right=2 * RAIL), Cell(FRONT.left, FRONT.bottom, FRONT.right, FRONT.bottom)
    grain = mosaic(lowest, grain=[FRONT])
    assert inset_fronts(grain, relief(), odds(-4.0), [cut], CELL_M) == [cut]
    assert inset_fronts(grain, relief(), odds(), [cut], CELL_M) != [cut]  # where edges are possible it counts as a gap


@pytest.mark.parametrize("cut", [grown(top=RAIL), grown(top=RAIL, right=RAIL)])
def test_a_line_as_clear_as_the_other_gaps_overrides_the_network(cut: Cell) -> None:
    cells = inset_fronts(mosaic(FRONT), relief(), odds(-4.0), [cut], CELL_M)
    assert edges(cells[0]) == pytest.approx(edges(FRONT), abs=CLOSE)


def test_a_worktop_edge_over_a_stile_does_not_extend_the_front() -> None:
    under = mosaic(FRONT, dark=150, worktop=round(FRONT.top))
    cells = inset_fronts(under, relief(), odds(), [grown(right=RAIL)], CELL_M)
    assert edges(cells[0]) == pytest.approx(edges(FRONT), abs=CLOSE)


@pytest.mark.parametrize("frame", [RAIL, 2 * RAIL])
def test_a_recessed_panel_stays_part_of_its_front(frame: int) -> None:
    sunk = Cell(FRONT.left + frame, FRONT.top + frame, FRONT.right - frame, FRONT.bottom - frame)
    assert inset_fronts(mosaic(FRONT, sunk), relief(), odds(), [FRONT], CELL_M) == [FRONT]


def test_a_recessed_panel_is_not_an_inset_front_but_a_shaker_door_is() -> None:
    inset = grown(left=2 * RAIL, top=RAIL, right=2 * RAIL)
    assert inset_fronts(mosaic(FRONT), relief(0.012), odds(), [inset], CELL_M) == [inset]
    sunk = Cell(FRONT.left + 20, FRONT.top + 20, FRONT.right - 20, FRONT.bottom - 20)  # a shaker door inset in a face frame
    assert len(inset_fronts(mosaic(FRONT), relief(0.012, sunk), odds(), [inset], CELL_M)) > 1


def test_a_recessed_plinth_outside_a_cell_does_not_affect_its_front() -> None:
    plinth = Cell(FRONT.left, FRONT.bottom, FRONT.right, FRONT.bottom + 20)
    cells = inset_fronts(mosaic(FRONT), relief(0.05, plinth), odds(), [grown(top=RAIL)], CELL_M)
    assert edges(cells[0]) == pytest.approx(edges(FRONT), abs=CLOSE)


def test_lines_between_the_stiles_of_a_frame_separate_fronts() -> None:
    seen, row = odds(-6.0), 180
    seen.level[row // STEP, round(FRONT.left) // STEP : round(FRONT.right) // STEP] = 4.0
    gaps = mosaic(FRONT, Cell(FRONT.left, row, FRONT.right, row))
    cells = inset_fronts(gaps, relief(), seen, [grown(left=2 * RAIL, right=2 * RAIL)], CELL_M)
    fronts = sorted(edges(cell) for cell in cells if cell.width > 4 * RAIL)
    assert [front[1::2] for front in fronts] == [pytest.approx((60, row), abs=CLOSE), pytest.approx((row, 300), abs=CLOSE)]


def test_a_shadow_across_a_front_is_not_a_face_frame() -> None:
    shadow = Cell(-5, -5, 325, FRONT.top + RAIL)  # from wall to wall
    assert inset_fronts(mosaic(FRONT, shadow), relief(), odds(), [FRONT], CELL_M) == [FRONT]


def strips(cut: Cell) -> Sequence[Cell]:
    return [cut, Cell(cut.left, cut.top - 8, cut.right, cut.top), Cell(cut.left, 0, cut.right, cut.top - 8)]


def test_gaps_stop_at_a_face_frame_rail_but_continue_beside_an_own_rail() -> None:
    _, strip, _ = strips(FRONT)
    assert is_rail(mosaic(FRONT), FRONT, strip, axis=1)
    assert not is_rail(mosaic(FRONT, grown(top=8)), FRONT, strip, axis=1)
    assert not is_rail(mosaic(), FRONT, strip, axis=1)  # nothing is visible
