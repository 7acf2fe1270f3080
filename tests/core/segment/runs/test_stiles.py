"""Strips beside panels: stiles of their frames, or of the frame of the cupboard."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from r2c2r_core.segment.runs.lines import Evidence
from r2c2r_core.segment.runs.orthomosaic import Cell
from r2c2r_core.segment.runs.panel_net import PanelOdds
from r2c2r_core.segment.runs.stiles import whole_frames
from r2c2r_core.segment.stage import open_session
from tests.core.segment.scenes import kitchen

CELL_M, BLOCK = 0.0025, 20
DOOR, PANEL = Cell(80, 20, 280, 320), Cell(110, 50, 250, 290)
CUT, BESIDE = Cell(110, 20, 280, 320), Cell(0, 20, 110, 320)  # at the panel's left line


def odds(front_from: int) -> PanelOdds:
    """Of a door whose left edge is as likely as not, and of fronts from a column on."""
    upright, level, handle, front = (np.full((160, 160), -4.0, np.float32) for _ in range(4))
    front[10:160, front_from // 2 :] = 4
    upright[10:160, 40] = 0.5
    return PanelOdds(upright, level, handle, front)


def lines(upright: list[float], level: list[float]) -> tuple[Evidence, Evidence]:
    found = []
    for positions in (upright, level):
        score = np.zeros((320 // BLOCK, 320), np.float32)
        for position in positions:
            score[:, round(position)] = 4
        found.append(Evidence(score, np.ones(score.shape, bool), BLOCK))
    return found[0], found[1]


def door_of(cells: list[Cell]) -> Cell:
    return next(cell for cell in cells if cell.contains(200, 170))


PANEL_LINES = ([PANEL.left, PANEL.right], [PANEL.top, PANEL.bottom])


def test_a_strip_as_wide_as_the_opposite_stile_belongs_to_the_door() -> None:
    cells = whole_frames(odds(110), [CUT, BESIDE], CELL_M, lines(*PANEL_LINES))
    door = door_of(cells)
    assert (door.left, door.top, door.right, door.bottom) == pytest.approx((80, 20, 280, 320), abs=2)
    assert sum(cell.width * cell.height for cell in cells) == pytest.approx(280 * 300)  # they tile what they did


@pytest.mark.parametrize(
    ("upright", "level"),
    [
        ([110, 140, 250], [50, 290]),  # its own panel begins within: the strip is the cupboard's face frame
        ([110], [50, 290]),  # nothing opposite
        ([110, 250], [290]),  # no upper rail
        ([], []),  # slab
    ],
)
def test_a_strip_beside_a_whole_door_is_none_of_it(upright: list[float], level: list[float]) -> None:
    assert door_of(whole_frames(odds(110), [CUT, BESIDE], CELL_M, lines(upright, level))) == CUT


def test_a_door_beside_a_door_is_no_stile() -> None:
    assert door_of(whole_frames(odds(0), [CUT, BESIDE], CELL_M, lines(*PANEL_LINES))) == CUT


def test_the_panels_of_a_run_are_whole_frames(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[list[Cell]] = []

    def noted(odds: PanelOdds, cells: Sequence[Cell], cell_m: float, lines: tuple[Evidence, Evidence]) -> list[Cell]:
        made.append(whole_frames(odds, cells, cell_m, lines)[::-1])
        return made[-1]

    monkeypatch.setattr("r2c2r_core.segment.runs.run.whole_frames", noted)
    capture, _ = kitchen()
    session = open_session(capture, tmp_path)
    run = session.run_of(session.planes[0])
    assert run is not None
    assert list(run.cells) in made
