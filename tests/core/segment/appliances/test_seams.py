"""Candidate seams of a drawer below an appliance's doors or a panel beside them: the likeliest line first, each once."""

from itertools import pairwise
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from r2c2r_core.segment.appliances.seams import drawer_seams, panel_seams
from r2c2r_core.segment.fronts.front import Front
from r2c2r_core.segment.mosaics.orthomosaic import STEP, Cell
from r2c2r_core.segment.mosaics.panel_net import PanelOdds
from r2c2r_core.segment.runs.run import Run

CELL_M = 0.005
FRONT = Cell(0, 0, 120, 360)  # 0.6 by 1.8 m
LIKELIER, FAINTER = 240, 200  # rows, within the lower 60 % and above the lowest 15 %


def front(*rows: int) -> Front:
    """A refrigerator whose run was cut at those rows."""
    faint = np.full((360 // STEP, 120 // STEP), -4, np.float32)
    level = faint.copy()
    level[FAINTER // STEP], level[LIKELIER // STEP] = 1, 4
    ends = [FRONT.top, *rows, FRONT.bottom]
    cells = tuple(Cell(FRONT.left, top, FRONT.right, bottom) for top, bottom in pairwise(ends))
    run = SimpleNamespace(odds=PanelOdds(faint, level, faint, faint), cells=cells, grid=SimpleNamespace(cell_m=CELL_M))
    return Front(cast(Run, run), FRONT, None, 0.0)


def test_candidate_seams_are_sorted_by_likelihood() -> None:
    assert drawer_seams(front(FAINTER, LIKELIER)) == pytest.approx([(180 - LIKELIER) * CELL_M, (180 - FAINTER) * CELL_M])


def test_adjacent_lines_are_merged_into_one_seam() -> None:
    assert drawer_seams(front(LIKELIER - 2, LIKELIER)) == pytest.approx([(180 - LIKELIER) * CELL_M], abs=2 * CELL_M)


def test_lines_too_low_or_too_high_for_a_drawer_are_ignored() -> None:
    assert drawer_seams(front(30, 340)) == ()


@pytest.mark.parametrize(("column", "found"), [(96, [(96 - 60) * CELL_M]), (114, []), (60, [])])
def test_a_panel_beside_a_door_takes_a_tenth_to_nearly_half_of_the_front(column: int, found: list[float]) -> None:
    faint = np.full((360 // STEP, 120 // STEP), -4, np.float32)
    cells = (Cell(0, 0, column, 360), Cell(column, 0, 120, 360))
    run = SimpleNamespace(odds=PanelOdds(faint, faint, faint, faint), cells=cells, grid=SimpleNamespace(cell_m=CELL_M))
    assert panel_seams(Front(cast(Run, run), FRONT, None, 0.0)) == pytest.approx(found)
