"""Cutting a run from line evidence alone: what is a seam, and what lies on a front."""

from types import SimpleNamespace
from typing import Any

import numpy as np

from r2c2r_core.kitchen.names import category_of
from r2c2r_core.segment.fronts.units import drawer_cell, unit_cell
from r2c2r_core.segment.runs.lines import Evidence
from r2c2r_core.segment.runs.orthomosaic import Cell
from r2c2r_core.segment.runs.xy_cut import cut_panels

CELL_M, BLOCK = 0.0025, 12
Line = tuple[int, int, int]  # position, and from where to where it runs, in cells


def evidence(length: int, across: int, lines: list[Line], score: float = 6.0) -> Evidence:
    """Lines at positions along `length`, each over a part of `across`."""
    found = np.zeros((across // BLOCK, length), np.float32)
    for position, start, stop in lines:
        found[start // BLOCK : stop // BLOCK, position] = score
    return Evidence(found, np.ones_like(found, bool), BLOCK)


def cut(width: int, height: int, upright: list[Line], level: list[Line]) -> list[Cell]:
    grey = np.full((height, width, 3), 128, np.uint8)
    return cut_panels(evidence(width, height, upright), evidence(height, width, level), grey, CELL_M)


def test_a_line_from_edge_to_edge_is_a_seam_and_one_that_ends_short_of_both_is_not() -> None:
    assert len(cut(240, 288, [], [(144, 0, 240)])) == 2
    assert len(cut(240, 288, [], [(144, 36, 204)])) == 1  # the lower edge of a window
    assert len(cut(240, 60, [(96, 12, 48)], [])) == 1  # the end of a drawer's handle


def test_a_seam_stands_out_from_strong_grain_around_it() -> None:
    rng = np.random.default_rng(0)
    grain = evidence(480, 288, [])
    grain.score[:] = np.clip(rng.normal(0.2, 0.6, (1, 480)), -0.5, 2.0)  # upright lines from end to end, faint
    grain.score[:, 230:250] = 0.3
    grain.score[:, 240] = 3.6  # the seam
    cells = cut_panels(grain, evidence(288, 480, []), np.full((288, 480, 3), 128, np.uint8), CELL_M)
    assert sorted((round(cell.left), round(cell.right)) for cell in cells) == [(0, 240), (240, 480)]


def test_handles_that_are_level_do_not_cut_two_units_at_once() -> None:
    handles = [(90, 36, 204), (90, 276, 444)]
    cells = cut(480, 288, [(240, 0, 288)], handles)
    assert sorted((round(cell.left), round(cell.right), round(cell.height)) for cell in cells) == [
        (0, 240, 288),
        (240, 480, 288),
    ]


def test_a_click_on_an_ovens_window_means_the_oven() -> None:
    window, frame = Cell(36, 96, 204, 240), Cell(0, 0, 240, 288)
    cells = (window, Cell(0, 0, 240, 96), Cell(0, 240, 240, 288), Cell(0, 96, 36, 240), Cell(204, 96, 240, 240))
    upright = evidence(252, 300, [(0, 0, 288), (36, 96, 240), (204, 96, 240), (240, 0, 288)])
    level = evidence(300, 252, [(0, 0, 240), (96, 36, 204), (240, 36, 204), (288, 0, 240)])
    run: Any = SimpleNamespace(cells=cells, grid=SimpleNamespace(cell_m=CELL_M), vertical=upright, horizontal=level)
    assert unit_cell(run, 120.0, 150.0, category_of("oven")) == frame


def test_a_drawer_is_parted_from_its_stack_by_a_seam_that_shows_only_beside_the_handles() -> None:
    seams = [(90, 0, 72), (90, 168, 240), (180, 0, 72), (180, 168, 240)]
    handles = [(45, 84, 156), (135, 84, 156), (225, 84, 156)]
    level = evidence(270, 240, seams, score=1.0)
    level.score[:] = np.maximum(level.score, evidence(270, 240, handles).score)
    run: Any = SimpleNamespace(cells=(), grid=SimpleNamespace(cell_m=CELL_M), horizontal=level)
    found = drawer_cell(run, Cell(0, 0, 240, 270), 120.0)
    assert (round(found.top), round(found.bottom)) == (90, 180)
    plain: Any = SimpleNamespace(cells=(), grid=run.grid, horizontal=evidence(270, 240, handles))
    assert drawer_cell(plain, Cell(0, 0, 240, 270), 120.0) == Cell(0, 0, 240, 270)
