"""Strips beside panels: stiles of the panel's own frame, or of the cupboard's face frame."""

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np
import pytest

from r2c2r_core.segment.geometric.session import GeometricSession
from r2c2r_core.segment.mosaics.lines import Evidence
from r2c2r_core.segment.mosaics.orthomosaic import Cell
from r2c2r_core.segment.mosaics.panel_net import PanelOdds
from r2c2r_core.segment.mosaics.relief import Relief
from r2c2r_core.segment.runs.contrast import Contrast
from r2c2r_core.segment.runs.run import Run, make_run
from r2c2r_core.segment.runs.stiles import whole_frames

CELL_M, BLOCK = 0.0025, 20
DOOR, PANEL = Cell(80, 20, 280, 320), Cell(110, 50, 250, 290)
CUT, BESIDE = Cell(110, 20, 280, 320), Cell(0, 20, 110, 320)  # at the panel's left line


def odds(front_from: int) -> PanelOdds:
    """Log-odds of a door whose left edge is undecided, with fronts from a column on."""
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


def cut_anew(session: GeometricSession) -> Run | None:
    """The first run of the boxes, cut from as few frames as show all of it, ignoring any cache."""
    return make_run(session.planes[0], session.scene, session.config.cell_m, frame_count=4)


def door_of(cells: list[Cell]) -> Cell:
    return next(cell for cell in cells if cell.contains(200, 170))


BLANK = Contrast(np.full((340, 320), 170, np.float32))
FLAT = Relief(2 * CELL_M, np.full((170, 160), 10.0), *(np.zeros((170, 160)) for _ in range(3)))
PANEL_LINES = ([PANEL.left, PANEL.right], [PANEL.top, PANEL.bottom])


def test_a_strip_as_wide_as_the_opposite_stile_joins_the_door() -> None:
    cells = whole_frames(odds(110), [CUT, BESIDE], CELL_M, lines(*PANEL_LINES), BLANK, FLAT)
    door = door_of(cells)
    assert (door.left, door.top, door.right, door.bottom) == pytest.approx((80, 20, 280, 320), abs=2)
    assert sum(cell.width * cell.height for cell in cells) == pytest.approx(280 * 300)  # they tile the same area


@pytest.mark.parametrize(
    ("upright", "level"),
    [
        ([110, 140, 250], [50, 290]),  # another panel begins within: the strip is the cupboard's face frame
        ([110], [50, 290]),  # no line on the opposite side
        ([110, 250], [290]),  # no upper rail
        ([], []),  # slab
    ],
)
def test_a_strip_beside_a_complete_door_is_not_joined(upright: list[float], level: list[float]) -> None:
    assert door_of(whole_frames(odds(110), [CUT, BESIDE], CELL_M, lines(upright, level), BLANK, FLAT)) == CUT


def test_a_face_frame_strip_outside_the_door_gap_is_not_joined() -> None:
    gaps = np.full((340, 320), 170, np.float32)
    cv2.rectangle(gaps, (round(CUT.left), round(CUT.top)), (round(CUT.right), round(CUT.bottom)), 90, 1)
    assert door_of(whole_frames(odds(110), [CUT, BESIDE], CELL_M, lines(*PANEL_LINES), Contrast(gaps), FLAT)) == CUT


def test_a_strip_beyond_a_full_height_line_is_not_joined() -> None:
    """A line over the full height is a gap beside the front; the outline of a recessed panel ends at the rails."""
    light = np.full((340, 320), 170, np.float32)
    light[round(CUT.top) : round(CUT.bottom), round(CUT.left)] = 150
    assert door_of(whole_frames(odds(110), [CUT, BESIDE], CELL_M, lines(*PANEL_LINES), Contrast(light), FLAT)) == CUT
    light[:], light[round(PANEL.top) : round(PANEL.bottom), round(CUT.left)] = 170, 150
    assert door_of(whole_frames(odds(110), [CUT, BESIDE], CELL_M, lines(*PANEL_LINES), Contrast(light), FLAT)) != CUT


@pytest.mark.parametrize(("sunk_m", "marked", "whole"), [(0.007, True, True), (0.007, False, False), (0.001, True, False)])
def test_a_strip_is_joined_by_depth_only_with_a_line_and_a_recessed_panel(sunk_m: float, marked: bool, whole: bool) -> None:
    """The opposite stile is not visible: a depth step and a line beside the strip identify it as a stile."""
    light = np.full((340, 320), 170, np.float32)
    light[round(PANEL.top) : round(PANEL.bottom), round(CUT.left)] = 150 if marked else 170
    level = np.zeros((170, 160))
    level[25:145, 55:125] = -sunk_m
    relief = replace(FLAT, level_m=level)
    cells = whole_frames(odds(110), [CUT, BESIDE], CELL_M, lines([110], [50, 290]), Contrast(light), relief)
    assert (door_of(cells) != CUT) == whole


def test_wood_grain_on_a_recessed_panel_does_not_separate_its_stile() -> None:
    """Grain lines lie where a separate panel would begin; the line of the recessed panel ends at both rails."""
    light, level = np.full((340, 320), 170, np.float32), np.zeros((170, 160))
    light[round(PANEL.top) : round(PANEL.bottom), round(CUT.left)] = 150
    level[25:145, 55:125] = -0.007
    grain, relief = lines([110, 140], [50, 290]), replace(FLAT, level_m=level)
    assert door_of(whole_frames(odds(110), [CUT, BESIDE], CELL_M, grain, Contrast(light), relief)).left == pytest.approx(
        80, abs=2
    )
    assert door_of(whole_frames(odds(110), [CUT, BESIDE], CELL_M, grain, Contrast(light), FLAT)) == CUT


def test_an_adjacent_door_is_not_joined_as_a_stile() -> None:
    assert door_of(whole_frames(odds(0), [CUT, BESIDE], CELL_M, lines(*PANEL_LINES), BLANK, FLAT)) == CUT


def test_panels_of_a_run_pass_through_whole_frames(session: GeometricSession, monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[list[Cell]] = []

    def noted(
        odds: PanelOdds,
        cells: Sequence[Cell],
        cell_m: float,
        lines: tuple[Evidence, Evidence],
        contrast: Contrast,
        relief: Relief,
    ) -> list[Cell]:
        made.append(whole_frames(odds, cells, cell_m, lines, contrast, relief)[::-1])
        return made[-1]

    monkeypatch.setattr("r2c2r_core.segment.runs.run.whole_frames", noted)
    run = cut_anew(session)
    assert run is not None
    assert list(run.cells) in made


def test_panels_of_a_run_pass_through_inset_fronts(session: GeometricSession, monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[Cell] = []

    def halved(contrast: Contrast, relief: Relief, odds: PanelOdds, cells: Sequence[Cell], cell_m: float) -> list[Cell]:
        made.extend(part for cell in cells for part in (replace(cell, bottom=cell.top + 1), replace(cell, top=cell.top + 1)))
        return list(made)

    monkeypatch.setattr("r2c2r_core.segment.runs.run.inset_fronts", halved)
    run = cut_anew(session)
    assert run is not None
    assert set(run.cells) & set(made)
