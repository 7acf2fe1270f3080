from types import SimpleNamespace
from typing import Any, cast

import numpy as np

from r2c2r_core.kitchen.names import category_of
from r2c2r_core.segment.appliances.box import find_rectangle
from r2c2r_core.segment.mosaics.lines import Evidence

CELL_M, BLOCK = 0.005, 10
LEFT, RIGHT, TOP, BOTTOM = 20, 140, 30, 370  # 0.6 x 1.7 m
ABOVE = TOP - 4  # 20 mm


def lines(count: int, length: int, scores: dict[int, float]) -> Evidence:
    score = np.zeros((length // BLOCK, count))
    for position, value in scores.items():
        score[:, position] = value
    return Evidence(score, np.ones_like(score, bool), BLOCK)


def test_depth_above_a_refrigerator_does_not_outvote_its_clearer_top_edge() -> None:
    """The worktop or shadow gap above lies in the same plane and ends in a line that is nearly as clear."""
    seen = np.zeros((400, 160), bool)
    seen[ABOVE:BOTTOM, LEFT:RIGHT] = True
    run = SimpleNamespace(
        grid=SimpleNamespace(cell_m=CELL_M),
        seen=seen,
        vertical=lines(160, 400, {LEFT: 4.0, RIGHT: 4.0}),
        horizontal=lines(400, 160, {ABOVE: 3.9, TOP: 4.0, BOTTOM: 4.0}),
    )
    cell = find_rectangle(
        cast(Any, run), np.array([[80.0, 200.0]]), category_of("refrigerator"), np.zeros((0, 2)), np.zeros_like(seen)
    )
    assert cell is not None
    np.testing.assert_allclose([cell.left, cell.top, cell.right, cell.bottom], [LEFT, TOP, RIGHT, BOTTOM], atol=1.0)


def on_a_wall(vertical: dict[int, float], horizontal: dict[int, float], part: tuple[slice, slice]) -> Any:
    seen = np.zeros((200, 240), bool)
    seen[part] = True
    grid = SimpleNamespace(cell_m=CELL_M)
    return SimpleNamespace(grid=grid, seen=seen, vertical=lines(240, 200, vertical), horizontal=lines(200, 240, horizontal))


def corners(cell: Any) -> list[float]:
    assert cell is not None
    return [cell.left, cell.top, cell.right, cell.bottom]


def test_wall_lines_behind_the_front_plane_are_not_edges_of_a_microwave() -> None:
    """The microwave's left and upper edges are fainter than the ends of the wall's tiles, and the larger size is more usual."""
    run = on_a_wall({40: 4.0, 70: 3.0, 150: 4.0}, {30: 4.0, 60: 3.0, 104: 4.0}, (slice(62, 104), slice(72, 150)))
    past = np.zeros_like(run.seen)
    past[:60] = past[:, :70] = True
    clicks, none = np.array([[100.0, 85.0]]), np.zeros((0, 2))
    found = find_rectangle(run, clicks, category_of("microwave"), none, past)
    np.testing.assert_allclose(corners(found), [70, 60, 150, 104], atol=1.0)


def test_an_edge_that_shows_on_only_one_side_of_the_click_is_used() -> None:
    """The click lies at the left end; many fainter lines of the wall go on to either side of it."""
    run = on_a_wall({70: 4.0, 150: 4.0}, {104: 4.0}, (slice(62, 104), slice(72, 150)))
    for row in [*range(1, 56, 3), *range(108, 198, 3)]:
        run.horizontal.score[:, row] = 2.5
    run.horizontal.score[70 // BLOCK : 150 // BLOCK, 60] = 4.0
    past = np.zeros_like(run.seen)
    past[:58] = past[106:] = True
    found = find_rectangle(run, np.array([[72.0, 85.0]]), category_of("microwave"), np.zeros((0, 2)), past)
    np.testing.assert_allclose(corners(found), [70, 60, 150, 104], atol=1.0)


def test_a_front_slightly_below_the_minimum_size_is_accepted() -> None:
    least = round(category_of("microwave").height.low / CELL_M)
    top = 104 - least + 2  # 10 mm less
    run = on_a_wall({70: 4.0, 150: 4.0}, {20: 3.0, top: 4.0, 104: 4.0}, (slice(top, 104), slice(70, 150)))
    past = np.zeros_like(run.seen)
    past[:top] = True
    found = find_rectangle(run, np.array([[100.0, 85.0]]), category_of("microwave"), np.zeros((0, 2)), past)
    np.testing.assert_allclose(corners(found), [70, top, 150, 104], atol=1.0)


def test_the_support_height_wins_over_a_clearer_door_edge() -> None:
    support = 110.0
    run = on_a_wall({70: 4.0, 150: 4.0}, {60: 4.0, 104: 4.0}, (slice(62, 104), slice(72, 150)))
    clicks, none = np.array([[100.0, 85.0]]), np.zeros((0, 2))
    found = find_rectangle(run, clicks, category_of("microwave"), none, np.zeros_like(run.seen), support)
    np.testing.assert_allclose(corners(found), [70, 60, 150, support], atol=1.0)
