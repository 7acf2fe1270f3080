import numpy as np

from r2c2r_core.segment.runs.orthomosaic import PlaneGrid, open_parts
from tests.core.segment.motion.boards import LEAF, filmed

GRID = PlaneGrid(LEAF.world_from_front, -LEAF.half_m[0], LEAF.half_m[1], 0.005, 100, 120)
PARTS = np.stack([grid.ravel() for grid in np.meshgrid(np.arange(10.0, 100, 20), np.arange(10.0, 120, 20))], axis=1)
OPEN = np.concatenate([np.zeros(16), np.full(8, 1.4)])


def test_views_into_an_open_unit_are_no_views_of_its_front() -> None:
    found = open_parts(GRID, PARTS, filmed("left", OPEN))
    assert not found[OPEN == 0].any()
    assert found[OPEN > 0].mean() > 0.5  # the leaf itself hides the rest


def test_what_most_views_look_past_is_glass() -> None:
    film = filmed("left", OPEN[::-1][:12])
    assert not open_parts(GRID, PARTS, film)[:, PARTS[:, 0] > 50].any()  # beside the hinge, the leaf hides it from many
