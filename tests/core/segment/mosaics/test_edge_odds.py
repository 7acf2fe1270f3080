"""Edge log-odds at unobserved cells, and on dark fronts with bright gaps."""

import cv2
import numpy as np
import pytest

from r2c2r_core.segment.mosaics.edge_odds import edge_odds, seam_odds
from r2c2r_core.segment.mosaics.lines import Evidence, scored
from r2c2r_core.segment.mosaics.orthomosaic import STEP, Cell, Tile
from r2c2r_core.segment.mosaics.panel_net import PanelOdds
from r2c2r_core.segment.mosaics.relief import Relief
from r2c2r_core.segment.runs.partition import Partitioner

ROWS, COLUMNS, CELL_M = 160, 200, 0.0025


def test_unobserved_mosaic_cells_are_as_likely_front_as_not() -> None:
    mosaic = np.full((ROWS, COLUMNS, 3), 120, np.uint8)
    mosaic[:, 120:] = 0
    empty = np.zeros((ROWS // STEP, COLUMNS // STEP))
    relief = Relief(CELL_M * STEP, empty + 10, empty, empty, empty)
    nothing = Evidence(np.zeros((8, COLUMNS)), np.zeros((8, COLUMNS), bool), 20)
    across = Evidence(np.zeros((10, ROWS)), np.zeros((10, ROWS), bool), 20)
    odds = edge_odds(seam_odds(mosaic, relief), mosaic, relief, nothing, across)
    assert (odds.front[:, 120 // STEP :] == 0).all()
    assert (odds.front[:, : 120 // STEP] != 0).all()


def test_unobserved_cells_are_no_evidence_against_a_line() -> None:
    """A door ends at column 120, clear over the upper half; the lower half was hidden."""
    layers = [np.full((ROWS, COLUMNS // STEP), -4.0, np.float32) for _ in range(4)]
    upright, level, handle, front = layers
    upright[: ROWS // 2, 60], front[:] = 3, 4

    def cells() -> int:
        return len(Partitioner(PanelOdds(upright, level, handle, front), CELL_M).divide(Cell(0, 0, COLUMNS, ROWS * STEP)))

    assert cells() == 1
    front[ROWS // 2 :] = 0
    assert cells() > 1


def test_a_door_is_not_cut_at_the_chair_before_it() -> None:
    """Two doors end at one level; a chair hid the lower part of the second, where the network sees no front."""
    upright, level, handle, front = (np.full((ROWS, COLUMNS), -4.0, np.float32) for _ in range(4))
    front[20:140, 20:180] = 4
    front[110:, 100:] = -4
    upright[20:140, [20, 100, 180]], level[[20, 140], 20:180], level[110, 100:180] = 1, 4, -2
    mosaic = np.full((ROWS * STEP, COLUMNS * STEP, 3), 120, np.uint8)
    mosaic[110 * STEP :, 100 * STEP :] = 0
    nothing = Evidence(np.zeros((40, COLUMNS * STEP)), np.zeros((40, COLUMNS * STEP), bool), 20)
    relief = Relief(CELL_M * STEP, *(np.zeros((ROWS, COLUMNS)) for _ in range(4)))
    odds = edge_odds(PanelOdds(upright, level, handle, front), mosaic, relief, nothing, nothing)
    cells = Partitioner(odds, CELL_M).divide(Cell(0, 0, COLUMNS * STEP, ROWS * STEP))
    (door,) = [cell for cell in cells if cell.contains(140 * STEP, 60 * STEP)]
    assert door.bottom == pytest.approx(140 * STEP, abs=2 * STEP)


def _two_dark_doors(gap: int) -> np.ndarray:
    """Two dark doors of 90 by 60 cm on a bright wall, with a gap of that lightness in column 200."""
    rgb = np.full((280, 400, 3), 200.0)
    rgb[20:260, 20:380] = 70
    rgb[20:260, 199:201] = gap
    return (rgb + np.random.default_rng(0).normal(0, 1, rgb.shape)).astype(np.uint8)


def test_a_bright_gap_between_dark_doors_is_an_edge() -> None:
    mosaic = _two_dark_doors(gap=84)
    empty = np.zeros((140, 200))
    relief = Relief(CELL_M * STEP, empty + 10, empty, empty, empty)
    nothing = (
        Evidence(np.zeros((14, 400)), np.zeros((14, 400), bool), 20),
        Evidence(np.zeros((20, 280)), np.zeros((20, 280), bool), 20),
    )
    odds = edge_odds(seam_odds(mosaic, relief), mosaic, relief, *nothing)
    assert np.median(odds.along(0, 200, 30, 250)) > 0
    assert np.median(odds.along(0, 110, 30, 250)) < 0


def test_a_bright_gap_scores_as_high_as_a_dark_gap() -> None:
    def clearest(gap: int) -> float:
        lab = cv2.cvtColor(_two_dark_doors(gap), cv2.COLOR_RGB2LAB)
        vertical, _ = scored(Tile(0, lab, np.ones(lab.shape[:2], np.float32)), CELL_M).scores
        return float(np.median(vertical.score[3:-3, 195:205].max(axis=1)))

    assert clearest(gap=74) > 0.8 * clearest(gap=66)


def test_a_depth_step_is_an_edge_only_where_the_network_allows_one() -> None:
    level = np.zeros((140, 200))
    level[:, 100:] = -0.03
    empty = np.zeros(level.shape)
    relief = Relief(CELL_M * STEP, empty + 10, empty, empty, level)

    def at_the_step(thought: float) -> float:
        none = np.full(level.shape, thought, np.float32)
        nothing = (
            Evidence(np.zeros((14, 400)), np.zeros((14, 400), bool), 20),
            Evidence(np.zeros((20, 280)), np.zeros((20, 280), bool), 20),
        )
        odds = edge_odds(PanelOdds(none, none, none, -none), np.full((280, 400, 3), 200, np.uint8), relief, *nothing)
        return float(np.median(odds.upright[10:-10, 97:104].max(axis=1)))

    assert at_the_step(-3.0) > 0
    assert at_the_step(-4.0) < 0


@pytest.mark.parametrize(("before_it", "found"), [(False, 105), (True, 100)])
def test_a_depth_end_moves_the_edge_only_if_depth_continues_beyond(before_it: bool, found: int) -> None:
    """Depth ends at 100; the network finds an edge likelier at 105 than at 100, and possible at both."""
    count, raised = np.zeros((140, 200)), np.zeros((140, 200))
    count[:, :100] = 10
    if before_it:  # a worktop's edge protrudes beyond
        count[:, 100:], raised[:, 100:] = 10, 1
    empty = np.zeros(count.shape)
    relief = Relief(CELL_M * STEP, count, raised, 0.02 * raised, empty)
    upright = np.full(count.shape, -4.0, np.float32)
    upright[:, 104:107], upright[:, 99:102] = -0.2, -1.5
    none = np.full(count.shape, -4.0, np.float32)
    nothing = (
        Evidence(np.zeros((14, 400)), np.zeros((14, 400), bool), 20),
        Evidence(np.zeros((20, 280)), np.zeros((20, 280), bool), 20),
    )
    odds = edge_odds(PanelOdds(upright, none, none, -none), np.full((280, 400, 3), 200, np.uint8), relief, *nothing)
    likely = np.flatnonzero(np.median(odds.upright[10:-10], axis=0) > 0)
    assert len(likely)
    assert np.abs(likely - found).max() <= 2
