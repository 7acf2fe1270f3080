"""Where depth says that a front ends: at its edges and where it stands before another, not at its handles or frames."""

import numpy as np

from r2c2r_core.segment.runs.orthomosaic import STEP
from r2c2r_core.segment.runs.relief import Relief

CELL_M, COLUMNS, ROWS, BLOCK = 0.005, 120, 24, 12
SURE = 4.0  # of 6


def relief(level_m: np.ndarray, lift_m: np.ndarray, seen: np.ndarray) -> Relief:
    """Of profiles over the columns: the panel's level, what stands out, and how many points were seen."""

    def tall(values: np.ndarray) -> np.ndarray:
        return np.tile(values, (ROWS, 1))

    return Relief(CELL_M, tall(seen), tall((lift_m > 0).astype(float)), tall(lift_m), tall(level_m))


def ends(known: Relief) -> list[float]:
    """Columns at which every block shows an end, each stretch by its middle."""
    shown = known.edge_evidence(0, BLOCK, COLUMNS * STEP, ROWS * STEP).min(axis=0) > SURE
    at = np.flatnonzero(shown)
    return [float(part.mean() + 0.5) / STEP for part in np.split(at, np.flatnonzero(np.diff(at) > 1) + 1) if len(part)]


def flat() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return np.zeros(COLUMNS), np.zeros(COLUMNS), np.full(COLUMNS, 20.0)


def test_where_a_front_ends_is_told_to_a_cell() -> None:
    level, lift, seen = flat()
    seen[70:] = 0
    (found,) = ends(relief(level, lift, seen))
    assert abs(found - 70) <= 1.0


def test_a_front_goes_on_behind_its_bar_and_the_bars_shadow() -> None:
    level, lift, seen = flat()
    lift[50:56], seen[56:58] = 0.04, 1.0
    assert ends(relief(level, lift, seen)) == []


def test_a_front_ends_at_the_edge_of_a_worktop_as_thick_as_a_bar() -> None:
    level, lift, seen = flat()
    lift[50:56], seen[56:] = 0.04, 0.0
    assert any(abs(found - 50) <= 2.0 for found in ends(relief(level, lift, seen)))


def test_a_door_ends_where_it_stands_before_another_and_not_where_its_panel_is_sunk() -> None:
    level, lift, seen = flat()
    level[60:] = -0.03
    (found,) = ends(relief(level, lift, seen))
    assert abs(found - 60) <= 1.0
    level[60:] = -0.01
    assert ends(relief(level, lift, seen)) == []
