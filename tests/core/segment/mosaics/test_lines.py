"""In-plane roll of a mosaic's lines."""

import numpy as np
import pytest

from r2c2r_core.segment.mosaics.lines import Evidence, find_roll

BLOCK, WIDTH = 12, 240


def lines(count: int, slope_deg: float, clear: float) -> Evidence:
    """Straight lines of that slope and z-score, observed in a number of blocks along them."""
    score = np.zeros((count, WIDTH))
    for block in range(count):
        shift = (block - count / 2) * BLOCK * np.tan(np.radians(slope_deg))
        score[block, np.round(np.array([40, 95, 150, 205]) + shift).astype(int)] = clear
    return Evidence(score, np.ones(score.shape, bool), BLOCK)


def test_the_roll_of_long_clear_lines_is_found() -> None:
    assert find_roll(lines(24, 2.0, 4.0), lines(24, -2.0, 4.0)) == pytest.approx(np.radians(2.0), abs=np.radians(0.5))


def test_short_faint_lines_do_not_roll_a_level_scan() -> None:
    assert find_roll(lines(5, 4.75, 1.0), lines(5, -4.75, 1.0)) == 0.0
