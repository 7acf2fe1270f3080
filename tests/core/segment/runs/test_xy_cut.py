"""XY-cut of a run from log-odds of edges alone: cuts, and the position of a line when one is known to exist."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from r2c2r_core.calibration import probability
from r2c2r_core.kitchen.names import category_of
from r2c2r_core.segment.fronts.units import unit_cell
from r2c2r_core.segment.mosaics.orthomosaic import Cell
from r2c2r_core.segment.mosaics.panel_net import PanelOdds
from r2c2r_core.segment.runs.xy_cut import LineField, cut_panels

CELL_M = 0.0025
SEEN = (400, 400)  # rows and columns of a grid that all of these fit in
Line = tuple[int, int, int]  # position, start and end, in cells


def odds(
    width: int,
    height: int,
    upright: list[Line],
    level: list[Line],
    sure: float = 3.0,
    handles: list[tuple[int, int]] | None = None,
) -> PanelOdds:
    """Log-odds of fronts only, with lines at positions, each over a part of the grid, and handles at columns and rows."""
    across = [np.full((height // 2, width // 2), -4.0, np.float32) for _ in range(2)]
    for layer, lines in ((across[0], upright), (across[1].T, level)):
        for position, start, stop in lines:
            layer[start // 2 : stop // 2, position // 2] = sure
    handle = np.full_like(across[0], -4)
    for column, row in handles or []:
        handle[row // 2 : row // 2 + 4, column // 2 - 10 : column // 2 + 10] = 4
    return PanelOdds(*across, handle=handle, front=np.full_like(across[0], 4))


def cut(width: int, height: int, upright: list[Line], level: list[Line]) -> list[Cell]:
    return cut_panels(odds(width, height, upright, level), Cell(0, 0, width, height), CELL_M)


def test_a_line_is_cut_where_most_but_not_half_of_its_span_shows() -> None:
    assert len(cut(240, 288, [], [(144, 0, 240)])) == 2
    assert len(cut(240, 288, [], [(144, 0, 100), (144, 160, 240)])) == 2  # a handle is across the line
    assert len(cut(240, 288, [], [(144, 60, 180)])) == 1


def test_level_handles_do_not_cut_two_units_at_once() -> None:
    cells = cut(480, 288, [(240, 0, 288)], [(90, 36, 180), (90, 300, 444)])
    assert sorted((round(cell.left), round(cell.right), round(cell.height)) for cell in cells) == [
        (0, 241, 288),
        (241, 480, 288),
    ]


def test_a_drawer_stack_is_cut_beside_a_full_height_door() -> None:
    cells = cut(480, 288, [(240, 0, 288)], [(96, 0, 240), (192, 0, 240)])
    assert sorted((round(cell.left), round(cell.top)) for cell in cells) == [(0, 0), (0, 97), (0, 193), (241, 0)]


def test_aligned_seams_of_two_stacks_do_not_cut_the_door_between_them() -> None:
    stacks = [(row, *span) for row in (96, 192) for span in ((0, 600), (760, 1400))]
    cells = cut(1400, 288, [(600, 0, 288), (760, 0, 288)], stacks)
    assert [(round(cell.left), round(cell.right)) for cell in cells if cell.height > 280] == [(601, 761)]
    assert len(cells) == 7


def test_a_seam_bent_by_pose_errors_is_one_cut_at_its_mean() -> None:
    bent = odds(240, 288, [(112 + 2 * (row // 48), row, row + 48) for row in range(0, 288, 48)], [])
    left, right = sorted(cut_panels(bent, Cell(0, 0, 240, 288), CELL_M), key=lambda cell: cell.left)
    assert left.right == right.left == pytest.approx(118, abs=1.5)
    jagged = odds(240, 288, [(112 + 30 * (row // 48 % 2), row, row + 48) for row in range(0, 288, 48)], [])
    assert len(cut_panels(jagged, Cell(0, 0, 240, 288), CELL_M)) == 1


def test_a_faint_seam_is_cut_only_between_two_handles() -> None:
    whole = Cell(0, 0, 240, 144)
    assert len(cut_panels(odds(240, 144, [], [(72, 0, 240)], sure=-0.3), whole, CELL_M)) == 1
    assert len(cut_panels(odds(240, 144, [], [(72, 0, 240)], sure=-0.3, handles=[(120, 30), (120, 104)]), whole, CELL_M)) == 2


def test_a_narrow_stile_with_the_handle_is_not_cut_off() -> None:
    """A faint line 6 cm from the edge of a door: so narrow a strip is rarely a front, nor is the rest without its handle."""
    whole, line = Cell(0, 0, 200, 288), [(176, 0, 288)]
    assert len(cut_panels(odds(200, 288, line, [], sure=1.0, handles=[(188, 60)]), whole, CELL_M)) == 1
    pull_out = [(140, 0, 288)]  # 15 cm wide
    assert len(cut_panels(odds(200, 288, pull_out, [], sure=3.5, handles=[(170, 60)]), whole, CELL_M)) == 2


def uncut(seen: PanelOdds) -> float:
    """Probability of a seam left inside a front of 60 x 72 cm."""
    return probability(LineField(seen, CELL_M).best_uncut(Cell(0, 0, 240, 288), 0.035, 0.1))


def test_the_inner_edge_of_a_panels_frame_is_hardly_a_seam() -> None:
    """It ends at the rails; in the sample kitchens doors with a frame were said to hold a seam with 45 %."""
    frame = odds(240, 288, [(212, 32, 256)], [], sure=2.9)
    frame.upright[:16, 106] = frame.upright[128:, 106] = -1.5
    assert uncut(frame) < 0.2


def test_two_handles_alone_are_no_seam() -> None:
    """Handles and sizes decide where a faint line is cut, but are no evidence of a seam in what was not."""
    assert uncut(odds(240, 288, [], [], handles=[(120, 30), (120, 240)])) == 0.0
    alone, with_handles = (
        uncut(odds(240, 288, [], [(144, 0, 240)], sure=-0.5, handles=each)) for each in ([], [(120, 30), (120, 240)])
    )
    assert 0.3 < alone == with_handles < 0.5


def test_a_strip_too_narrow_for_a_unit_is_no_front_of_its_own_with_its_knob() -> None:
    """A clear line 6 cm from the edge of a door with the knob beyond it, and what looks like a second handle below."""
    door, line = Cell(0, 0, 176, 300), [(150, 0, 300)]
    for wide, count in ((0, 1), (40, 2)):
        seen = odds(176, 300, [(150 - wide, 0, 300)] if wide else line, [], sure=3.4, handles=[(164, 30), (60, 270)])
        assert len(cut_panels(seen, door, CELL_M)) == count


@pytest.mark.parametrize("grid", [Cell(0, 0, 8, 400), Cell(0, 0, 400, 8), Cell(0, 0, 2, 2), Cell(0, 0, 1, 1)])
def test_cells_too_small_to_cut_stay_whole(grid: Cell) -> None:
    assert cut_panels(odds(400, 400, [(4, 0, 400)], [(4, 0, 400)]), grid, CELL_M) == [grid]


def test_edges_outside_fronts_are_not_cut() -> None:
    tiles = odds(240, 288, [(120, 0, 288)], [])
    tiles.front[:] = -4
    assert len(cut_panels(tiles, Cell(0, 0, 240, 288), CELL_M)) == 1


def test_an_unlikely_line_is_found_only_when_requested() -> None:
    faint = odds(240, 288, [(100, 0, 288)], [], sure=-1.0)
    whole = Cell(0, 0, 240, 288)
    assert cut_panels(faint, whole, CELL_M) == [whole]
    line = LineField(faint, CELL_M).best_between(whole, 0, 60, 200)
    assert line is not None
    assert line.position == pytest.approx(101, abs=1)
    assert line.odds == pytest.approx(-1.0)


@pytest.mark.parametrize(("front_odds", "cells"), [(-0.5, 1), (-3.5, 2)])
def test_an_unlikely_line_is_cut_only_beside_a_clear_non_front_area(front_odds: float, cells: int) -> None:
    seen = odds(240, 288, [], [(180, 0, 240)], sure=-2.0)
    seen.front[90:] = front_odds
    assert len(cut_panels(seen, Cell(0, 0, 240, 288), CELL_M)) == cells


def test_a_click_on_an_oven_window_selects_the_whole_oven() -> None:
    window, frame = Cell(36, 96, 204, 240), Cell(0, 0, 240, 288)
    cells = (window, Cell(0, 0, 240, 96), Cell(0, 240, 240, 288), Cell(0, 96, 36, 240), Cell(204, 96, 240, 240))
    lines = odds(
        252,
        300,
        [(0, 0, 288), (36, 96, 240), (204, 96, 240), (240, 0, 288)],
        [(0, 0, 240), (96, 36, 204), (240, 36, 204), (288, 0, 240)],
    )
    run: Any = SimpleNamespace(cells=cells, grid=SimpleNamespace(cell_m=CELL_M), odds=lines, seen=np.ones(SEEN, bool))
    assert unit_cell(run, 120.0, 150.0, category_of("oven")) == frame


def test_a_range_extends_to_its_own_top_edge_beside_a_lower_door() -> None:
    """Three clear edges, a usual size and an aligned row do not compensate for a missing fourth edge."""
    cells = (whole := Cell(0, 0, 240, 372), Cell(240, 0, 372, 108), Cell(240, 108, 372, 372))
    lines = odds(380, 380, [(0, 0, 372), (240, 0, 372), (372, 0, 372)], [(0, 0, 372), (108, 240, 372), (372, 0, 372)])
    run: Any = SimpleNamespace(cells=cells, grid=SimpleNamespace(cell_m=CELL_M), odds=lines, seen=np.ones(SEEN, bool))
    assert unit_cell(run, 120.0, 300.0, category_of("range")) == whole


def test_an_oven_is_separated_from_the_drawers_beside_it() -> None:
    cells = (oven := Cell(0, 0, 160, 288), *(Cell(160, top, 320, top + 96) for top in (0, 96, 192)))
    lines = odds(332, 300, [(0, 0, 288), (160, 0, 288), (320, 0, 288)], [(0, 0, 320), (288, 0, 320)])
    run: Any = SimpleNamespace(cells=cells, grid=SimpleNamespace(cell_m=0.0028), odds=lines, seen=np.ones(SEEN, bool))
    assert unit_cell(run, 80.0, 150.0, category_of("oven")) == oven


def test_a_black_glass_oven_is_separated_from_the_drawer_below_it() -> None:
    """All edges are clear and oven and drawer together have a usual oven size, but only the drawer front has depth returns."""
    cells = (oven := Cell(0, 0, 240, 200), Cell(0, 200, 240, 372), Cell(240, 0, 372, 372))
    lines = odds(380, 380, [(0, 0, 372), (240, 0, 372), (372, 0, 372)], [(0, 0, 372), (200, 0, 240), (372, 0, 372)])
    seen = np.ones(SEEN, bool)
    seen[5:200, 5:235] = False
    run: Any = SimpleNamespace(cells=cells, grid=SimpleNamespace(cell_m=CELL_M), odds=lines, seen=seen)
    assert unit_cell(run, 120.0, 100.0, category_of("oven")) == oven


def door_under_a_rail(uprights_from: int) -> PanelOdds:
    """A door from column 80 to 280, cut at its sides from a row on; at row 44 is an undecided line."""
    field = odds(360, 320, [(80, uprights_from, 320), (280, uprights_from, 320)], [(20, 0, 360)])
    field.level[22, 40:140] = 0.5
    return field


def test_a_front_ends_where_both_of_its_side_lines_end() -> None:
    def tops(uprights_from: int) -> set[int]:
        cells = cut_panels(door_under_a_rail(uprights_from), Cell(0, 0, 360, 320), CELL_M)
        return {round(cell.top / 2) for cell in cells if cell.contains(180, 200)}

    assert tops(uprights_from=44) == {22}
    assert tops(uprights_from=20) == {10}


def test_a_narrow_strip_with_a_handle_is_not_cut_off_as_filler() -> None:
    """A line 6 cm before the end of a door with the knob beyond it is the inner line of its stile, not the end of the door."""
    door, line = Cell(0, 0, 176, 300), [(152, 0, 300)]
    assert len(cut_panels(odds(176, 300, line, [], sure=3.5, handles=[(164, 30)]), door, CELL_M)) == 1
    assert len(cut_panels(odds(176, 300, line, [], sure=3.5, handles=[]), door, CELL_M)) == 2


@pytest.mark.parametrize("apart", [24, 36])
def test_seams_at_different_heights_do_not_cut_the_door_between_stacks(apart: int) -> None:
    """A line through both seams bends by 60 to 90 mm over the door and is visible over three quarters of its span."""
    run = odds(1000, 300, [(260, 0, 300), (480, 0, 300)], [(150 + apart, 0, 260), (150, 480, 1000)], sure=4.0)
    found = {(round(cell.left), round(cell.top)) for cell in cut_panels(run, Cell(0, 0, 1000, 300), CELL_M)}
    assert found == {(0, 0), (0, 151 + apart), (261, 0), (481, 0), (481, 151)}
