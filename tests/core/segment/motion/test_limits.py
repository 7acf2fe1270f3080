import numpy as np
import pytest

from r2c2r_core.segment.motion.limits import stop_seen

WIDEST = 1.5


def opened(turn_frames: float, rest_frames: int) -> np.ndarray:
    """Angles of a door that opens and closes at constant acceleration, with a rest at its widest."""
    half = WIDEST * (1 - np.minimum(np.arange(np.ceil(turn_frames)) / turn_frames, 1.0) ** 2)
    return np.concatenate([half[::-1], np.full(rest_frames, WIDEST), half[1:]])


def is_stop(values: np.ndarray, *, every: int = 1, sigma_deg: float = 0.3) -> bool:
    noise = np.random.default_rng(3).normal(0, np.deg2rad(0.3), len(values))
    sigmas = np.full(len(values), np.deg2rad(sigma_deg))
    return stop_seen(values + noise, sigmas, range(0, every * len(values), every), WIDEST, turns=True)


@pytest.mark.parametrize("turn_frames", [8.0, 20.0, 60.0, 200.0])
def test_a_leaf_that_turns_back_at_once_has_met_no_stop_at_any_speed(turn_frames: float) -> None:
    assert not is_stop(opened(turn_frames, 0))


@pytest.mark.parametrize(("turn_frames", "rest_frames"), [(8.0, 5), (20.0, 10), (60.0, 30)])
@pytest.mark.parametrize("every", [1, 4])
def test_a_leaf_that_rests_longer_than_it_takes_to_turn_has_met_its_stop(
    turn_frames: float, rest_frames: int, every: int
) -> None:
    assert is_stop(opened(turn_frames, rest_frames), every=every)


def test_a_rest_that_lasts_to_the_end_of_the_recording_is_a_stop() -> None:
    values = opened(20.0, 10)
    assert is_stop(values[: np.flatnonzero(values == WIDEST)[-1] + 1])


def test_a_rest_shorter_than_the_errors_of_its_angles_allow_is_no_stop() -> None:
    """An angle that a leaf seen edge-on seems to keep may be an error."""
    assert not is_stop(opened(20.0, 10), sigma_deg=2.0)
