"""Seam network: its input, and its output on elevations outside its training set."""

from dataclasses import replace

import numpy as np
import pytest

from r2c2r_core.segment.mosaics.panel_net import NETWORKS, PanelOdds, features, panel_odds
from training.crops import crops
from training.elevations import draw
from training.sight import Sight, seen
from training.styles import FaceFrame, any_style

UNSEEN = range(10_000_000, 10_000_008)  # outside the seeds of any training


def judged(sight: Sight) -> PanelOdds:
    return panel_odds(sight.mosaic, sight.count, sight.raised, sight.level_m)


@pytest.fixture(scope="module")
def judgements() -> list[tuple[np.ndarray, PanelOdds]]:
    sights = [seen(draw(seed)) for seed in UNSEEN]
    return [(sight.truth, judged(sight)) for sight in sights]


def on_cells(layer: np.ndarray) -> np.ndarray:
    rows, columns = layer.shape[0] // 2, layer.shape[1] // 2
    return layer[: rows * 2, : columns * 2].reshape(rows, 2, columns, 2).max(axis=(1, 3)) > 0


def test_the_networks_are_smaller_than_5_mb() -> None:
    assert 0 < sum(path.stat().st_size for path in NETWORKS) < 5_000_000


def test_unseen_edges_and_handles_are_detected_with_few_false_positives(
    judgements: list[tuple[np.ndarray, PanelOdds]],
) -> None:
    for k, layer in enumerate(("upright", "level", "handle")):
        true = np.concatenate([on_cells(truth[k]).ravel() for truth, _ in judgements])
        likely = np.concatenate([getattr(odds, layer).ravel() for _, odds in judgements]) > 0
        assert likely[true].mean() > 0.5, layer
        assert likely[~true].mean() < 0.02, layer


def test_front_odds_are_calibrated(judgements: list[tuple[np.ndarray, PanelOdds]]) -> None:
    true = np.concatenate([on_cells(truth[3]).ravel() for truth, _ in judgements])
    sure = 1 / (1 + np.exp(-np.concatenate([odds.front.ravel() for _, odds in judgements])))
    for low, high in ((0.0, 0.2), (0.8, 1.01)):
        within = (sure >= low) & (sure < high)
        assert true[within].mean() == pytest.approx(sure[within].mean(), abs=0.1)


def test_input_features_do_not_depend_on_the_depth_point_count() -> None:
    sight = seen(draw(10_000_000))
    once = features(sight.mosaic, sight.count, sight.raised, sight.level_m)
    twice = features(sight.mosaic, 2 * sight.count, sight.raised, sight.level_m)
    assert once.shape == (19, sight.mosaic.shape[0] // 2, sight.mosaic.shape[1] // 2)
    np.testing.assert_allclose(once, twice, atol=1e-5)


def touching(seed: int) -> float:
    """Fraction of a drawing's labelled upright edges with a front on both sides."""
    drawn = draw(seed)
    rows, columns = np.nonzero(drawn.upright[:, 6:-6])
    return float((drawn.front[rows, columns] * drawn.front[rows, columns + 12] > 0).mean())  # 15 mm to each side


@pytest.mark.parametrize("seed", [10_000_003, 10_000_005])
def test_fronts_drawn_in_a_face_frame_do_not_touch(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    frame = FaceFrame(
        top_m=0.04, bottom_m=0.04, between_m=0.03, stile_m=0.04, mullion_m=0.04, light=np.ones(3), behind_m=0, joint_light=1
    )

    def styled(frame: FaceFrame | None) -> None:
        monkeypatch.setattr("training.elevations.any_style", lambda rng: replace(any_style(rng), frame=frame))

    styled(None)
    assert touching(seed) > 0.3
    styled(frame)
    assert touching(seed) < 0.1


def test_training_crops_have_a_fixed_size_and_labels() -> None:
    for inputs, truth in crops(10_000_001, count=2):
        assert inputs.shape == (19, 256, 256)
        assert truth.shape == (4, 256, 256)
        assert set(np.unique(truth[:2])) <= {0, 1, 2}  # 2: too near a line for a label
