"""How a microwave stands by its edges, in drawn photographs: what its glass door keeps from the depth camera."""

import numpy as np
import pytest

from r2c2r_core.geometry.transforms import Rigid3, rotation_about_z
from r2c2r_core.segment.appliances.stance import Stance, stance
from tests.core.segment.appliances.test_outline import TRUE, photo

EYES = [
    (-1.2, -1.3, 0.5),
    (-0.8, -1.4, 0.45),
    (-0.5, -1.5, 0.5),
    (-0.1, -1.4, 0.6),
    (0.2, -1.5, 0.55),
    (0.6, -1.4, 0.4),
    (0.9, -1.3, 0.5),
    (1.2, -1.2, 0.45),
]


@pytest.mark.parametrize("turn_deg", [1.4, -1.1])
def test_edges_tell_a_turn_that_depth_missed(turn_deg: float) -> None:
    """And where its front and sides are, from a guess a centimetre off."""
    turn, shift = np.radians(turn_deg), np.array([0.006, 0.004, 0.0])
    thought = TRUE._replace(world_from_front=Rigid3(rotation_about_z(turn), shift), half_width_m=TRUE.half_width_m - 0.004)
    found = stance(thought, [photo(eye, 60) for eye in EYES])
    assert found.turn_rad == pytest.approx(-turn, abs=np.radians(0.2))
    assert found.forward_m == pytest.approx(0.004, abs=0.0035)  # a pixel at 1.5 m is 2 mm
    assert found.left_m == pytest.approx(0.010, abs=0.0035)
    assert found.right_m == pytest.approx(-0.002, abs=0.0035)


def test_a_body_that_stands_where_it_was_thought_stays() -> None:
    found = stance(TRUE, [photo(eye, 60) for eye in EYES])
    assert abs(found.turn_rad) < np.radians(0.15)
    assert max(abs(value) for value in found[1:5]) < 0.0035


def test_what_no_photograph_shows_whole_stays() -> None:
    """Edges behind something nearer are not in view; of too few photographs nothing is believed."""
    assert stance(TRUE, [photo(eye, 60) for eye in EYES[:4]]) == Stance()
    hidden = stance(TRUE, [photo(eye, 60, hidden=True) for eye in EYES])
    np.testing.assert_allclose(hidden, np.zeros(6), atol=1e-3)
