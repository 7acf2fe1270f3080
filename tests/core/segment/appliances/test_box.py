from types import SimpleNamespace
from typing import Any, cast

import numpy as np

from r2c2r_core.kitchen.names import category_of
from r2c2r_core.segment.appliances.box import find_rectangle
from r2c2r_core.segment.runs.lines import Evidence

CELL_M, BLOCK = 0.005, 10
LEFT, RIGHT, TOP, BOTTOM = 20, 140, 30, 370  # 0.6 x 1.7 m
ABOVE = TOP - 4  # 20 mm


def lines(count: int, length: int, scores: dict[int, float]) -> Evidence:
    score = np.zeros((length // BLOCK, count))
    for position, value in scores.items():
        score[:, position] = value
    return Evidence(score, np.ones_like(score, bool), BLOCK)


def test_depth_that_goes_on_above_a_refrigerator_does_not_outvote_the_clearer_of_two_lines() -> None:
    """The worktop or shadow gap over it lies in its plane, and ends in a line that is nearly as clear."""
    seen = np.zeros((400, 160), bool)
    seen[ABOVE:BOTTOM, LEFT:RIGHT] = True
    run = SimpleNamespace(
        grid=SimpleNamespace(cell_m=CELL_M),
        seen=seen,
        vertical=lines(160, 400, {LEFT: 4.0, RIGHT: 4.0}),
        horizontal=lines(400, 160, {ABOVE: 3.9, TOP: 4.0, BOTTOM: 4.0}),
    )
    cell = find_rectangle(cast(Any, run), np.array([[80.0, 200.0]]), category_of("refrigerator"), np.zeros((0, 2)))
    assert cell is not None
    np.testing.assert_allclose([cell.left, cell.top, cell.right, cell.bottom], [LEFT, TOP, RIGHT, BOTTOM], atol=1.0)
