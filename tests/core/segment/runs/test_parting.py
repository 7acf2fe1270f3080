"""Cut of one panel under several clicks so that each has a part, by the jointly likeliest seams."""

import numpy as np

from r2c2r_core.segment.mosaics.orthomosaic import STEP, Cell
from r2c2r_core.segment.mosaics.panel_net import PanelOdds
from r2c2r_core.segment.runs.parting import parted
from r2c2r_core.segment.runs.xy_cut import LineField

CELL_M = 0.0025
WIDE, HIGH = 200, 140  # cells of the odds: 1.0 x 0.7 m


def field_of(level: np.ndarray, upright: np.ndarray) -> LineField:
    on = np.full((HIGH, WIDE), 6.0, np.float32)
    return LineField(PanelOdds(upright=upright, level=level, front=on, handle=np.full_like(on, -6.0)), CELL_M)


def unseen() -> tuple[np.ndarray, np.ndarray]:
    level, upright = (np.full((HIGH, WIDE), -5.0, np.float32) for _ in range(2))
    return level, upright


def at(column: int, row: int) -> np.ndarray:
    return np.array([[column * STEP, row * STEP]], float)


PANEL = Cell(0.0, 0.0, WIDE * STEP, HIGH * STEP)
STACK = [at(50, 20), at(50, 70), at(50, 120), at(150, 30)]  # three drawers, and a door beside them


def test_a_faint_seam_between_stacks_is_cut_before_clear_seams_ending_at_it() -> None:
    level, upright = unseen()
    upright[:, 100] = -1.0  # faint
    level[45:47, :100] = level[93:95, :100] = 5.0
    parts = parted(field_of(level, upright), PANEL, STACK).parts
    assert len(parts) == 4
    (door,) = [part for part in parts if part.contains(150 * STEP, 30 * STEP)]
    assert abs(door.left - 100 * STEP) <= 2 * STEP
    assert (door.top, door.bottom) == (PANEL.top, PANEL.bottom)
    for column, row in ((50, 20), (50, 70), (50, 120)):
        assert sum(part.contains(column * STEP, row * STEP) for part in parts) == 1


def test_the_partition_does_not_depend_on_object_order() -> None:
    level, upright = unseen()
    upright[:, 100] = -1.0
    level[45:47, :100] = level[93:95, :100] = 5.0
    field = field_of(level, upright)
    assert {frozenset(parted(field, PANEL, STACK[k:] + STACK[:k]).parts) for k in range(4)} == {
        frozenset(parted(field, PANEL, STACK).parts)
    }


def test_objects_share_a_part_where_no_seam_is_likely() -> None:
    level, upright = (np.full((HIGH, WIDE), -9.0, np.float32) for _ in range(2))
    assert parted(field_of(level, upright), PANEL, [at(50, 70), at(60, 75)]).parts == (PANEL,)


def test_clicks_of_one_object_are_never_separated() -> None:
    level, upright = unseen()
    upright[:, 100] = 5.0  # between the two clicks of the first
    level[69:71] = 1.0
    first = np.concatenate([at(50, 30), at(150, 30)])
    parts = parted(field_of(level, upright), PANEL, [first, at(120, 110)]).parts
    assert len(parts) == 2
    assert all(any(part.contains(*on.tolist()) for on in first) for part in parts if part.contains(*first[0].tolist()))
    assert sum(part.contains(*first[1].tolist()) and part.contains(*first[0].tolist()) for part in parts) == 1
