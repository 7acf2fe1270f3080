"""Ends of a front in depth: at its edges and where it is in front of another one, not at its handles or frames."""

import numpy as np

from r2c2r_core.segment.mosaics.orthomosaic import STEP
from r2c2r_core.segment.mosaics.relief import Relief

CELL_M, COLUMNS, ROWS, BLOCK = 0.005, 120, 24, 12
SURE = 4.0  # of 6


def relief(level_m: np.ndarray, lift_m: np.ndarray, seen: np.ndarray) -> Relief:
    """Relief from profiles over the columns: the panel's level, the height above it, and the number of points."""

    def tall(values: np.ndarray) -> np.ndarray:
        return np.tile(values, (ROWS, 1))

    return Relief(CELL_M, tall(seen), tall((lift_m > 0).astype(float)), tall(lift_m), tall(level_m))


def ends(known: Relief) -> list[float]:
    """Columns at which every block shows an end, each stretch by its middle."""
    return _stretches(known.edge_evidence(0, BLOCK, COLUMNS * STEP, ROWS * STEP).ends)


def steps(known: Relief) -> list[float]:
    """Columns at which every block shows a step back, or the border of a pane."""
    return _stretches(known.edge_evidence(0, BLOCK, COLUMNS * STEP, ROWS * STEP).within)


def _stretches(scores: np.ndarray) -> list[float]:
    shown = scores.min(axis=0) > SURE
    at = np.flatnonzero(shown)
    return [float(part.mean() + 0.5) / STEP for part in np.split(at, np.flatnonzero(np.diff(at) > 1) + 1) if len(part)]


def flat() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return np.zeros(COLUMNS), np.zeros(COLUMNS), np.full(COLUMNS, 20.0)


def test_the_end_of_a_front_is_located_to_one_cell() -> None:
    level, lift, seen = flat()
    seen[70:] = 0
    (found,) = ends(relief(level, lift, seen))
    assert abs(found - 70) <= 1.0


def test_a_front_continues_behind_a_bar_handle_and_its_shadow() -> None:
    level, lift, seen = flat()
    lift[50:56], seen[56:58] = 0.04, 1.0
    assert ends(relief(level, lift, seen)) == []


def test_a_front_ends_at_a_worktop_edge_as_thick_as_a_bar() -> None:
    level, lift, seen = flat()
    lift[50:56], seen[56:] = 0.04, 0.0
    assert any(abs(found - 50) <= 2.0 for found in ends(relief(level, lift, seen)))


def test_a_depth_step_is_found_between_doors_but_not_at_a_recessed_panel() -> None:
    level, lift, seen = flat()
    level[60:] = -0.03
    (found,) = steps(relief(level, lift, seen))
    assert abs(found - 60) <= 1.0
    assert ends(relief(level, lift, seen)) == []
    level[60:] = -0.01
    assert steps(relief(level, lift, seen)) == []


def test_a_plane_ends_at_a_channel_but_not_at_a_glass_pane() -> None:
    def framed(top: int, bottom: int) -> list[float]:
        """Level lines of an isolated plane with a hole between these rows."""
        seen = np.zeros((120, 120))
        seen[10:110, 10:110] = 20
        seen[top:bottom, 22:98] = 0
        none = np.zeros(seen.shape)
        edges = Relief(CELL_M, seen, none, none, none).edge_evidence(1, BLOCK, 120 * STEP, 120 * STEP)
        middle = edges.ends[len(edges.ends) // 3 : -len(edges.ends) // 3]
        return _stretches(middle)

    assert [round(at) for at in framed(30, 90)] == [10, 110]
    assert [round(at) for at in framed(50, 56)] == [10, 50, 56, 110]
