"""Odds of edges on what nobody saw."""

import numpy as np

from r2c2r_core.segment.runs.edge_odds import edge_odds
from r2c2r_core.segment.runs.lines import Evidence
from r2c2r_core.segment.runs.orthomosaic import STEP, Cell
from r2c2r_core.segment.runs.panel_net import PanelOdds
from r2c2r_core.segment.runs.panels import cut_panels
from r2c2r_core.segment.runs.relief import Relief

ROWS, COLUMNS, CELL_M = 160, 200, 0.0025


def test_where_a_mosaic_has_no_colour_no_front_is_likely() -> None:
    mosaic = np.full((ROWS, COLUMNS, 3), 120, np.uint8)
    mosaic[:, 120:] = 0
    empty = np.zeros((ROWS // STEP, COLUMNS // STEP))
    relief = Relief(CELL_M * STEP, empty + 10, empty, empty, empty)
    nothing = Evidence(np.zeros((8, COLUMNS)), np.zeros((8, COLUMNS), bool), 20)
    across = Evidence(np.zeros((10, ROWS)), np.zeros((10, ROWS), bool), 20)
    odds = edge_odds(mosaic, relief, nothing, across)
    assert (odds.front[:, 120 // STEP :] == -4).all()
    assert (odds.front[:, : 120 // STEP] > -4).any()


def test_what_nobody_saw_does_not_speak_against_a_line_through_it() -> None:
    """A door ends at column 120, clear over the upper half; the lower half was hidden."""
    layers = [np.full((ROWS, COLUMNS // STEP), -4.0, np.float32) for _ in range(4)]
    upright, level, handle, front = layers
    upright[: ROWS // 2, 60], front[:] = 3, 4

    def cells() -> int:
        return len(cut_panels(PanelOdds(upright, level, handle, front), Cell(0, 0, COLUMNS, ROWS * STEP), CELL_M))

    assert cells() == 1
    front[ROWS // 2 :] = -4
    assert cells() > 1
