import numpy as np
import pytest

from r2c2r_core.geometry.masks import mask_iou
from r2c2r_core.segment.things.pixel_cut import cut_pixels, learn_colours, unmixed


def disk(size: int, centre: tuple[float, float], radius: float) -> np.ndarray:
    y, x = np.mgrid[:size, :size] + 0.5
    return np.asarray(np.hypot(x - centre[0], y - centre[1]) < radius)


@pytest.mark.parametrize("size", [80, 240])  # the larger one is cut at a lower resolution
def test_weak_odds_are_refined_to_the_colour_edge(size: int) -> None:
    truth = disk(size, (0.5 * size, 0.5 * size), 0.3 * size)
    guess = disk(size, (0.54 * size, 0.47 * size), 0.3 * size)
    rng = np.random.default_rng(0)
    rgb = (np.where(truth[..., None], [200, 60, 50], [120, 110, 90]) + rng.normal(0, 4, (size, size, 3))).clip(0, 255)
    found = cut_pixels(rgb.astype(np.uint8), np.where(guess, 0.4, -0.4))
    assert mask_iou(guess, truth) < 0.9
    assert mask_iou(found, truth) > 0.97


def test_a_colour_model_separates_object_and_background_colours() -> None:
    lab = np.zeros((40, 40, 3), np.uint8)
    lab[:, :20], lab[:, 20:] = (140, 180, 160), (120, 128, 130)
    left = np.zeros((40, 40), bool)
    left[:, :20] = True
    model = learn_colours([(lab, left, ~left)])
    odds = model.odds(lab)
    assert (odds[:, :20] > 1).all()
    assert (odds[:, 20:] < -1).all()
    unseen = model.odds(np.full((1, 1, 3), 20, np.uint8))
    assert abs(float(unseen[0, 0])) < 0.1  # a colour seen in neither is uninformative


def test_mixed_border_pixels_get_zero_odds_and_interiors_keep_theirs() -> None:
    odds = np.full((9, 12), -2.0, np.float32)
    odds[:, 6:] = 2.5
    odds[:, 6] = 1.0  # a mixture closer to the object
    said = unmixed(odds)
    assert (said[:, 5:7] == 0).all()
    assert (said[:, :5] == -2.0).all()
    assert (said[:, 8:] == 2.5).all()


def test_a_single_pixel_of_another_colour_is_ignored() -> None:
    odds = np.full((9, 9), -2.0, np.float32)
    odds[4, 4] = 2.5
    assert unmixed(odds).max() == 0
