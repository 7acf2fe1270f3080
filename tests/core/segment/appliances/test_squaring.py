import numpy as np
import pytest

from r2c2r_core.segment.appliances.squaring import _Faces, _turn


def wall(origin: np.ndarray, along: np.ndarray, length_m: float, rng: np.random.Generator) -> _Faces:
    """Faces of an upright strip 0.3 m high, 3 mm rough."""
    across = np.array([-along[1], along[0], 0.0])
    steps, heights = rng.uniform(0, length_m, 400), rng.uniform(-0.15, 0.15, 400)
    points = origin + steps[:, None] * along + heights[:, None] * [0, 0, 1] + rng.normal(0, 0.003, (400, 1)) * across
    return _Faces(points, np.tile(across, (400, 1)), np.full(400, length_m * 0.3 / 400))


@pytest.mark.parametrize("turn_deg", [-4.0, 0.0, 3.0])
def test_a_side_tells_how_a_body_is_turned_whose_front_is_mostly_glass(turn_deg: float) -> None:
    rng = np.random.default_rng(1)
    turn = np.radians(turn_deg)
    right, back = np.array([np.cos(turn), np.sin(turn), 0.0]), np.array([-np.sin(turn), np.cos(turn), 0.0])
    keypad = wall(0.15 * right, right, 0.1, rng)
    side = wall(0.25 * right + 0.03 * back, back, 0.32, rng)
    found, at = _turn(keypad, {1: side})
    assert np.degrees(found) == pytest.approx(turn_deg, abs=0.4)
    assert at[1] == pytest.approx(0.25, abs=0.003)


def test_too_little_of_a_body_leaves_it_as_it_was() -> None:
    sliver = wall(np.array([0.2, 0.0, 0.0]), np.array([np.cos(0.1), np.sin(0.1), 0.0]), 0.02, np.random.default_rng(2))
    assert _turn(sliver, {})[0] == 0.0
