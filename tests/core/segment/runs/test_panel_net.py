"""The network that finds edges of fronts: what it is fed, and what it makes of elevations it was not trained on."""

import numpy as np
import pytest

from r2c2r_core.segment.runs.panel_net import NETWORKS, PanelOdds, features, panel_odds
from training.crops import crops
from training.elevations import draw
from training.sight import Sight, seen

UNSEEN = range(10_000_000, 10_000_012)  # far from what any training draws


def judged(sight: Sight) -> PanelOdds:
    return panel_odds(sight.mosaic, sight.count, sight.raised, sight.level_m)


@pytest.fixture(scope="module")
def judgements() -> list[tuple[np.ndarray, PanelOdds]]:
    sights = [seen(draw(seed)) for seed in UNSEEN]
    return [(sight.truth, judged(sight)) for sight in sights]


def on_cells(layer: np.ndarray) -> np.ndarray:
    rows, columns = layer.shape[0] // 2, layer.shape[1] // 2
    return layer[: rows * 2, : columns * 2].reshape(rows, 2, columns, 2).max(axis=(1, 3)) > 0


def test_the_networks_are_small_enough_to_come_with_the_code() -> None:
    assert 0 < sum(path.stat().st_size for path in NETWORKS) < 5_000_000


def test_edges_and_handles_it_never_saw_are_likely_and_the_rest_is_not(
    judgements: list[tuple[np.ndarray, PanelOdds]],
) -> None:
    for k, layer in enumerate(("upright", "level", "handle")):
        true = np.concatenate([on_cells(truth[k]).ravel() for truth, _ in judgements])
        likely = np.concatenate([getattr(odds, layer).ravel() for _, odds in judgements]) > 0
        assert likely[true].mean() > 0.5, layer
        assert likely[~true].mean() < 0.02, layer


def test_its_odds_are_calibrated(judgements: list[tuple[np.ndarray, PanelOdds]]) -> None:
    true = np.concatenate([on_cells(truth[3]).ravel() for truth, _ in judgements])
    sure = 1 / (1 + np.exp(-np.concatenate([odds.front.ravel() for _, odds in judgements])))
    for low, high in ((0.0, 0.2), (0.8, 1.01)):
        within = (sure >= low) & (sure < high)
        assert true[within].mean() == pytest.approx(sure[within].mean(), abs=0.1)


def test_what_it_is_fed_does_not_depend_on_the_number_of_depth_points() -> None:
    sight = seen(draw(10_000_000))
    once = features(sight.mosaic, sight.count, sight.raised, sight.level_m)
    twice = features(sight.mosaic, 2 * sight.count, sight.raised, sight.level_m)
    assert once.shape == (19, sight.mosaic.shape[0] // 2, sight.mosaic.shape[1] // 2)
    np.testing.assert_allclose(once, twice, atol=1e-5)


def test_training_draws_crops_of_one_size_with_their_truth() -> None:
    for inputs, truth in crops(10_000_001, count=2):
        assert inputs.shape == (19, 256, 256)
        assert truth.shape == (4, 256, 256)
        assert set(np.unique(truth[:2])) <= {0, 1, 2}  # 2: too near a line to say
