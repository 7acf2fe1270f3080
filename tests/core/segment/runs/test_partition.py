"""Partition of a run from log-odds of edges, fronts and handles, and of one panel under clicks on several objects."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from r2c2r_core.calibration import probability
from r2c2r_core.kitchen.names import category_of
from r2c2r_core.segment.fronts.units import unit_cell
from r2c2r_core.segment.mosaics.orthomosaic import STEP, Cell
from r2c2r_core.segment.mosaics.panel_net import PanelOdds
from r2c2r_core.segment.runs.partition import Clicks, Partitioner

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


def divided(seen: PanelOdds, region: Cell) -> list[Cell]:
    return Partitioner(seen, CELL_M).divide(region)


def cut(width: int, height: int, upright: list[Line], level: list[Line]) -> list[Cell]:
    return divided(odds(width, height, upright, level), Cell(0, 0, width, height))


def test_a_line_is_cut_where_most_but_not_half_of_its_span_shows() -> None:
    assert len(cut(240, 288, [], [(144, 0, 240)])) == 2
    assert len(cut(240, 288, [], [(144, 0, 108), (144, 132, 240)])) == 2  # a handle is across the line
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


def test_the_edge_of_a_handle_beside_a_seam_does_not_bend_it() -> None:
    """A line 2 cm beside a seam over 30 cm: both are candidates, and neither takes evidence of the other."""
    cells = cut(480, 288, [(240, 0, 288), (232, 20, 140)], [])
    assert sorted((round(cell.left), round(cell.right)) for cell in cells) == [(0, 241), (241, 480)]


def test_a_seam_bent_by_pose_errors_is_one_cut_at_its_mean() -> None:
    bent = odds(240, 288, [(112 + 2 * (row // 48), row, row + 48) for row in range(0, 288, 48)], [])
    left, right = sorted(divided(bent, Cell(0, 0, 240, 288)), key=lambda cell: cell.left)
    assert left.right == right.left == pytest.approx(118, abs=1.5)
    jagged = odds(240, 288, [(112 + 30 * (row // 48 % 2), row, row + 48) for row in range(0, 288, 48)], [])
    assert len(divided(jagged, Cell(0, 0, 240, 288))) == 1


def test_a_narrow_stile_with_the_handle_is_not_cut_off() -> None:
    """A faint line 6 cm from the edge of a door: so narrow a strip is rarely a front, nor is the rest without its handle."""
    whole, line = Cell(0, 0, 200, 288), [(176, 0, 288)]
    assert len(divided(odds(200, 288, line, [], sure=1.0, handles=[(188, 60)]), whole)) == 1
    pull_out = [(140, 0, 288)]  # 15 cm wide
    assert len(divided(odds(200, 288, pull_out, [], sure=3.5, handles=[(170, 60)]), whole)) == 2


def seam(seen: PanelOdds) -> float:
    """Probability of a seam left inside a front of 60 x 72 cm."""
    return probability(Partitioner(seen, CELL_M).seam_gain(Cell(0, 0, 240, 288), 0.035))


def test_the_inner_edge_of_a_panels_frame_is_hardly_a_seam() -> None:
    """It ends at the rails; in the sample kitchens doors with a frame were said to hold a seam with 45 %."""
    frame = odds(240, 288, [(212, 32, 256)], [], sure=2.9)
    frame.upright[:16, 106] = frame.upright[128:, 106] = -1.5
    assert seam(frame) < 0.2


def test_handles_make_a_faint_seam_likelier_and_are_none_alone() -> None:
    two = [(120, 30), (120, 240)]
    assert seam(odds(240, 288, [], [], handles=two)) == 0.0
    alone, with_handles = (seam(odds(240, 288, [], [(144, 0, 240)], sure=0.0, handles=each)) for each in ([], two))
    assert alone < with_handles


def test_a_strip_too_narrow_for_a_unit_is_no_front_of_its_own_with_its_knob() -> None:
    """A clear line 6 cm from the edge of a door with the knob beyond it, and what looks like a second handle below."""
    door, line = Cell(0, 0, 176, 300), [(150, 0, 300)]
    for wide, count in ((0, 1), (40, 2)):
        seen = odds(176, 300, [(150 - wide, 0, 300)] if wide else line, [], sure=3.4, handles=[(164, 30), (60, 270)])
        assert len(divided(seen, door)) == count


@pytest.mark.parametrize("grid", [Cell(0, 0, 8, 400), Cell(0, 0, 400, 8), Cell(0, 0, 2, 2), Cell(0, 0, 1, 1)])
def test_cells_too_small_to_cut_stay_whole(grid: Cell) -> None:
    assert divided(odds(400, 400, [(2, 0, 400)], [(2, 0, 400)]), grid) == [grid]


def test_edges_outside_fronts_are_not_cut() -> None:
    tiles = odds(240, 288, [(120, 0, 288)], [])
    tiles.front[:] = -4
    assert len(divided(tiles, Cell(0, 0, 240, 288))) == 1


@pytest.mark.parametrize("end", [176, 184])
def test_of_equally_likely_lines_the_one_where_fronts_end_is_cut(end: int) -> None:
    seen = odds(240, 288, [], [(row, 0, 240) for row in range(172, 190, 2)], sure=0.5)
    seen.front[end // 2 :] = -4
    (front,) = [cell for cell in divided(seen, Cell(0, 0, 240, 288)) if cell.top == 0]
    assert front.bottom == pytest.approx(end, abs=STEP)


def test_an_unlikely_line_is_found_only_when_requested() -> None:
    faint, whole = odds(240, 288, [(100, 0, 288)], [], sure=-1.0), Cell(0, 0, 240, 288)
    assert divided(faint, whole) == [whole]
    clicks = Clicks([np.array([[60.0, 100.0]]), np.array([[200.0, 100.0]])], shared_cost=20.0)
    assert sorted(round(part.left) for part in Partitioner(faint, CELL_M).divide(whole, clicks)) == [0, 101]


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


def test_a_narrow_strip_with_a_handle_is_not_cut_off_as_filler() -> None:
    """A line 6 cm before the end of a door with the knob beyond it is the inner line of its stile, not the end of the door."""
    door, line = Cell(0, 0, 176, 300), [(152, 0, 300)]
    assert len(divided(odds(176, 300, line, [], sure=3.5, handles=[(164, 30)]), door)) == 1
    assert len(divided(odds(176, 300, line, [], sure=3.5, handles=[]), door)) == 2


@pytest.mark.parametrize("apart", [24, 36])
def test_seams_at_different_heights_do_not_cut_the_door_between_stacks(apart: int) -> None:
    """A line through both seams bends by 60 to 90 mm over the door and is visible over three quarters of its span."""
    run = odds(1000, 300, [(260, 0, 300), (480, 0, 300)], [(150 + apart, 0, 260), (150, 480, 1000)], sure=4.0)
    found = {(round(cell.left), round(cell.top)) for cell in divided(run, Cell(0, 0, 1000, 300))}
    assert found == {(0, 0), (0, 151 + apart), (261, 0), (481, 0), (481, 151)}


WIDE, HIGH = 200, 140  # cells of the odds: 1.0 x 0.7 m


def parted(level: np.ndarray, upright: np.ndarray, clicked: list[np.ndarray]) -> list[Cell]:
    on = np.full((HIGH, WIDE), 6.0, np.float32)
    seen = PanelOdds(upright=upright, level=level, front=on, handle=np.full_like(on, -6.0))
    return Partitioner(seen, CELL_M).divide(PANEL, Clicks(clicked, shared_cost=3.0))


def unseen() -> tuple[np.ndarray, np.ndarray]:
    level, upright = (np.full((HIGH, WIDE), -5.0, np.float32) for _ in range(2))
    return level, upright


def at(column: int, row: int) -> np.ndarray:
    return np.array([[column * STEP, row * STEP]], float)


PANEL = Cell(0.0, 0.0, WIDE * STEP, HIGH * STEP)
STACK = [at(50, 20), at(50, 70), at(50, 120), at(150, 30)]  # three drawers, and a door beside them


def test_a_faint_seam_between_stacks_is_cut_before_clear_seams_ending_at_it() -> None:
    level, upright = unseen()
    upright[:, 100] = -1.0  # faint
    level[45:47, :100] = level[93:95, :100] = 5.0
    parts = parted(level, upright, STACK)
    assert len(parts) == 4
    (door,) = [part for part in parts if part.contains(150 * STEP, 30 * STEP)]
    assert abs(door.left - 100 * STEP) <= 2 * STEP
    assert (door.top, door.bottom) == (PANEL.top, PANEL.bottom)
    for column, row in ((50, 20), (50, 70), (50, 120)):
        assert sum(part.contains(column * STEP, row * STEP) for part in parts) == 1


def test_the_partition_does_not_depend_on_object_order() -> None:
    level, upright = unseen()
    upright[:, 100] = -1.0
    level[45:47, :100] = level[93:95, :100] = 5.0
    assert {frozenset(parted(level, upright, STACK[k:] + STACK[:k])) for k in range(4)} == {
        frozenset(parted(level, upright, STACK))
    }


def test_objects_share_a_part_where_no_seam_is_likely() -> None:
    level, upright = (np.full((HIGH, WIDE), -9.0, np.float32) for _ in range(2))
    assert parted(level, upright, [at(50, 70), at(60, 75)]) == [PANEL]


def test_clicks_of_one_object_are_never_separated() -> None:
    level, upright = unseen()
    upright[:, 100] = 5.0  # between the two clicks of the first
    level[69:71] = 1.0
    first = np.concatenate([at(50, 30), at(150, 30)])
    parts = parted(level, upright, [first, at(120, 110)])
    assert len(parts) == 2
    assert all(any(part.contains(*on.tolist()) for on in first) for part in parts if part.contains(*first[0].tolist()))
    assert sum(part.contains(*first[1].tolist()) and part.contains(*first[0].tolist()) for part in parts) == 1
