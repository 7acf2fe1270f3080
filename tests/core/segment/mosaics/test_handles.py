"""Handle detection on a panel, from the network's log-odds and the relief."""

import numpy as np
import pytest

from r2c2r_core.segment.mosaics.handles import find_handle, find_handles, shared_band
from r2c2r_core.segment.mosaics.orthomosaic import STEP, Cell
from r2c2r_core.segment.mosaics.panel_net import PanelOdds
from r2c2r_core.segment.mosaics.relief import Relief

ROWS, COLUMNS, CELL_M = 120, 80, 0.005  # of the network's cells
PANEL = Cell(10 * STEP, 10 * STEP, 70 * STEP, 110 * STEP)
LIFT_M = 0.03


def found(*parts: tuple[slice, slice, float], raised: tuple[slice, slice] | None = None) -> tuple[PanelOdds, Relief]:
    """A panel on which only these rectangles are likely handles, one of them raised."""
    nothing = np.full((ROWS, COLUMNS), -4.0, np.float32)
    handle, share = nothing.copy(), np.zeros((ROWS, COLUMNS))
    for rows, columns, odds in parts:
        handle[rows, columns] = odds
    if raised is not None:
        share[raised] = 1.0
    relief = Relief(
        CELL_M, np.ones((ROWS + 1, COLUMNS + 1)), *(np.pad(v, ((0, 1), (0, 1))) for v in (share, LIFT_M * share, share))
    )
    return PanelOdds(nothing, nothing, handle, -nothing), relief


def test_a_handle_has_its_place_from_the_network_and_protrusion_from_depth() -> None:
    bar = (slice(20, 50), slice(60, 64))
    handle = find_handle(*found((*bar, 3.0), raised=bar), PANEL)
    assert handle is not None
    assert (handle.left, handle.right, handle.top, handle.bottom) == (60 * STEP, 64 * STEP, 20 * STEP, 50 * STEP)
    assert handle.protrusion_m == pytest.approx(LIFT_M)
    assert handle.confidence == pytest.approx(1 / (1 + np.exp(-3.0)))


def test_a_panel_without_likely_handle_cells_has_no_handle() -> None:
    assert find_handle(*found((slice(20, 50), slice(60, 64), -0.1)), PANEL) is None
    assert find_handle(*found((slice(20, 50), slice(2, 6), 3.0)), PANEL) is None  # the neighbour's
    assert find_handle(*found((slice(20, 50), slice(60, 64), 3.0)), Cell(0, 0, 0, 0)) is None


def test_parts_of_a_bar_are_merged_and_a_distant_speck_is_ignored() -> None:
    upper, lower, speck = (slice(20, 32), slice(60, 64)), (slice(38, 50), slice(60, 64)), (slice(90, 92), slice(20, 22))
    handle = find_handle(*found((*upper, 2.0), (*lower, 2.0), (*speck, 4.0)), PANEL)
    assert handle is not None
    assert (handle.top, handle.bottom) == (20 * STEP, 50 * STEP)
    assert handle.protrusion_m == 0.0  # depth showed no protrusion


def test_the_ends_of_a_bar_are_one_handle_where_depth_shows_the_bar_between_them() -> None:
    ends, bar = [(slice(20, 24), slice(20, 28)), (slice(20, 24), slice(48, 54))], (slice(20, 24), slice(20, 54))
    parts = [(*end, odds) for end, odds in zip(ends, (2.0, 1.5), strict=True)]
    shown, hidden = find_handle(*found(*parts, raised=bar), PANEL), find_handle(*found(*parts), PANEL)
    assert shown is not None
    assert hidden is not None
    assert (shown.left, shown.right) == (20 * STEP, 54 * STEP)
    assert (hidden.left, hidden.right) == (20 * STEP, 28 * STEP)  # 10 cm apart with nothing between: print


def test_a_handle_at_the_panel_edge_is_not_cropped() -> None:
    handle = find_handle(*found((slice(20, 50), slice(12, 16), 2.0)), PANEL)
    assert handle is not None
    assert handle.left == 12 * STEP


def test_the_depth_position_of_a_handle_wins_over_its_mosaic_position() -> None:
    seen, stands = (slice(20, 50), slice(60, 64)), (slice(22, 52), slice(57, 61))
    handle = find_handle(*found((*seen, 3.0), raised=stands), PANEL)
    assert handle is not None
    assert (handle.left, handle.right, handle.top, handle.bottom) == (57 * STEP, 61 * STEP, 22 * STEP, 52 * STEP)


def test_a_handle_centre_is_not_biased_to_the_end_with_more_depth() -> None:
    bar, recognised = (slice(20, 24), slice(30, 62)), (slice(20, 24), slice(33, 62))
    odds, relief = found((*recognised, 3.0), raised=bar)
    relief.count[:, 30:46] = 3
    handle = find_handle(odds, relief, PANEL)
    assert handle is not None
    assert (handle.left + handle.right) / 2 == 46 * STEP


def test_a_bar_among_printed_marks_is_found_by_its_likelihood() -> None:
    """The marks of a microwave's keypad are within the gap between parts of one handle, but no handle is that thick."""
    bar, marks = (slice(30, 60), slice(40, 43)), [(slice(row, row + 2), slice(48, 60)) for row in range(20, 70, 6)]
    handle = find_handle(*found((*bar, 2.0), *((*mark, 1.5) for mark in marks), raised=bar), PANEL)
    assert handle is not None
    assert (handle.left, handle.right, handle.top, handle.bottom) == (40 * STEP, 43 * STEP, 30 * STEP, 60 * STEP)


def test_a_bar_is_grown_from_its_likely_cells_through_fainter_ones_along_it() -> None:
    core, bar, shadow = (slice(30, 36), slice(60, 62)), (slice(20, 50), slice(60, 62)), (slice(20, 50), slice(56, 60))
    handle = find_handle(*found((*shadow, -1.0), (*bar, -1.0), (*core, 0.5)), PANEL)
    assert handle is not None
    assert (handle.left, handle.right, handle.top, handle.bottom) == (60 * STEP, 62 * STEP, 20 * STEP, 50 * STEP)
    assert handle.confidence == pytest.approx(1 / (1 + np.exp(-0.5)))  # of its likely cells
    sure = find_handle(*found((*bar, -1.0), (*core, 1.5)), PANEL)
    assert sure is not None
    assert (sure.top, sure.bottom) == (30 * STEP, 36 * STEP)  # what is so much fainter is not the bar


def test_a_faint_line_to_the_end_of_the_panel_is_not_part_of_a_bar() -> None:
    core, line = (slice(30, 36), slice(60, 62)), (slice(14, 80), slice(60, 62))
    handle = find_handle(*found((*line, -1.0), (*core, 0.5)), PANEL)
    assert handle is not None
    assert (handle.top, handle.bottom) == (30 * STEP, 36 * STEP)


def test_a_bar_that_depth_shows_ends_where_it_ends_in_depth() -> None:
    core, line, bar = (slice(30, 40), slice(60, 62)), (slice(20, 70), slice(60, 62)), (slice(28, 44), slice(60, 62))
    handle = find_handle(*found((*line, -1.0), (*core, 0.5), raised=bar), PANEL)
    assert handle is not None
    assert (handle.top, handle.bottom) == (28 * STEP, 44 * STEP)


def three_doors(odds: float) -> tuple[PanelOdds, Relief, list[Cell]]:
    """Doors side by side; bars of the outer two are likely, and that of the middle one has these odds, and so has a mark."""
    bars = [(slice(20, 22), slice(left + 5, left + 15)) for left in (0, 25, 50)]
    likely = [(*bar, value) for bar, value in zip(bars, (2.0, odds, 2.0), strict=True)]
    cells = [Cell(left * STEP, 10 * STEP, (left + 25) * STEP, 110 * STEP) for left in (0, 25, 50)]
    return *found(*likely, (slice(90, 94), slice(30, 45), -0.1)), cells


def test_a_fainter_handle_counts_at_the_height_of_its_row() -> None:
    odds, relief, cells = three_doors(-0.3)
    assert find_handle(odds, relief, cells[1]) is None
    handle = find_handles(odds, relief, cells)[1]
    assert handle is not None
    assert (handle.left, handle.right, handle.top, handle.bottom) == (30 * STEP, 40 * STEP, 20 * STEP, 22 * STEP)
    assert handle.confidence == pytest.approx(1 / (1 + np.exp(0.3)))
    assert find_handles(odds, relief, cells[:2])[1] is None  # one of two is not most
    assert find_handles(*three_doors(-0.6))[1] is None


def test_only_fronts_level_with_each_other_share_a_height() -> None:
    odds, relief, cells = three_doors(-0.6)
    handles = find_handles(odds, relief, cells)
    band = shared_band(odds, relief, cells, handles, cells[1])
    assert band is not None
    assert band.top < 20 * STEP < 22 * STEP < band.bottom < 50 * STEP
    assert shared_band(odds, relief, cells, handles, Cell(25 * STEP, 10 * STEP, 50 * STEP, 90 * STEP)) is None
    walls = PanelOdds(odds.upright, odds.level, odds.handle, -odds.front)
    assert shared_band(walls, relief, cells, handles, cells[1]) is None
