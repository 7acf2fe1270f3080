"""Confidence of a front's edges: low for faint edges, near rivals, without contrast, or hardly on a front."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import cast

import cv2
import numpy as np
import pytest

from r2c2r_core.segment.fronts.certainty import edges_right
from r2c2r_core.segment.mosaics.orthomosaic import STEP, Cell
from r2c2r_core.segment.mosaics.panel_net import PanelOdds
from r2c2r_core.segment.runs.run import Run

CELL_M = 0.0025
PANEL = Cell(60, 60, 260, 300)
ROWS, COLUMNS = 180, 160  # size of the odds
FAINT: dict[str, Callable[[Run], None]] = {
    "a part of its edge is unlikely": lambda run: run.odds.upright[30:60, 29:32].fill(-3),
    "a likely line is 3 cm within its edge": lambda run: run.odds.level[36, 30:130].fill(4),
    "the network holds it hardly for a front": lambda run: run.odds.front.fill(0.5),
    "its colour is that of what is beside it": lambda run: run.mosaic.fill(200),
}


def run() -> Run:
    """A panel with clear edges all around."""
    upright, level = (np.full((ROWS, COLUMNS), -4, np.float32) for _ in range(2))
    upright[30:150, [30, 129]] = 4
    level[[30, 149], 30:130] = 4
    front = np.full((ROWS, COLUMNS), -4, np.float32)
    front[30:150, 30:130] = 4
    mosaic = np.full((ROWS * STEP, COLUMNS * STEP, 3), 90, np.uint8)
    cv2.rectangle(mosaic, (60, 60), (259, 299), (200, 200, 190), -1)
    odds = PanelOdds(upright, level, np.full_like(front, -4), front)
    return cast(Run, SimpleNamespace(odds=odds, mosaic=mosaic, grid=SimpleNamespace(cell_m=CELL_M)))


def test_clear_edges_give_high_confidence() -> None:
    assert edges_right(run(), PANEL) > 0.9


@pytest.mark.parametrize("why", FAINT)
def test_weak_evidence_lowers_the_confidence_of_a_front(why: str) -> None:
    faint = run()
    FAINT[why](faint)
    assert 1 - edges_right(faint, PANEL) > 2 * (1 - edges_right(run(), PANEL))


def test_a_panel_that_fills_the_mosaic_has_low_but_nonzero_confidence() -> None:
    assert 0 < edges_right(run(), Cell(0, 0, COLUMNS * STEP, ROWS * STEP)) < 0.5
