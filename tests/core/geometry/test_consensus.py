"""Robust similarity estimation: a known similarity is recovered among outliers, forward and inverse."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from r2c2r_core.geometry.consensus import similarity_consensus
from r2c2r_core.geometry.registration import SimilarityFit
from r2c2r_core.geometry.transforms import Similarity3

NOISE_M = 0.005


def random_similarity(rng: np.random.Generator) -> Similarity3:
    return Similarity3(float(np.exp(rng.uniform(-1.2, 1.2))), Rotation.random(rng=rng).as_matrix(), rng.uniform(-2, 2, 3))


def box_surface(count: int, rng: np.random.Generator) -> np.ndarray:
    points = rng.uniform(-0.5, 0.5, (count, 3))
    axis = rng.integers(0, 3, count)
    points[np.arange(count), axis] = np.sign(points[np.arange(count), axis]) * 0.5
    return points * [0.6, 0.54, 0.84]


def correspondences(
    seed: int, count: int, wrong_share: float, *, flat: bool = False
) -> tuple[np.ndarray, np.ndarray, Similarity3]:
    """Points of a box, their noisy images with most replaced by random points of the same space, and the truth."""
    rng = np.random.default_rng(seed)
    truth = random_similarity(rng)
    world = box_surface(count, rng) * ([1, 1, 1e-9] if flat else [1, 1, 1])
    target = world + rng.normal(0, NOISE_M, world.shape)
    wrong = rng.permutation(count)[: round(wrong_share * count)]
    target[wrong] = rng.uniform(target.min(axis=0), target.max(axis=0), (len(wrong), 3))
    return truth.inverse.apply(world), target, truth


def assert_near(fit: SimilarityFit | None, wanted: Similarity3) -> None:
    assert fit is not None
    turn = Rotation.from_matrix(fit.target_from_source.rotation.T @ wanted.rotation).magnitude()
    assert np.degrees(turn) < 1.5
    assert fit.target_from_source.scale == pytest.approx(wanted.scale, rel=0.02)


@pytest.mark.parametrize("wrong_share", [0.0, 0.6, 0.8, 0.9, 0.95])
@pytest.mark.parametrize("flat", [False, True])
@pytest.mark.parametrize("seed", range(3))
def test_the_similarity_is_recovered_among_outliers(seed: int, flat: bool, wrong_share: float) -> None:
    source, target, truth = correspondences(seed, 600, wrong_share, flat=flat)
    rng = np.random.default_rng(seed)
    limit = 3 * NOISE_M
    assert_near(similarity_consensus(source, target, threshold=limit, rng=rng), truth)
    assert_near(similarity_consensus(target, source, threshold=limit / truth.scale, rng=rng), truth.inverse)


@pytest.mark.parametrize("seed", range(4))
def test_twenty_inliers_among_a_thousand_suffice(seed: int) -> None:
    source, target, truth = correspondences(seed, 1000, 0.98)
    assert_near(similarity_consensus(source, target, threshold=3 * NOISE_M, rng=np.random.default_rng(0)), truth)


def test_all_correspondences_count_as_inliers_beyond_the_sample_limit() -> None:
    source, target, truth = correspondences(1, 5000, 0.7)
    fit = similarity_consensus(source, target, threshold=3 * NOISE_M, rng=np.random.default_rng(0))
    assert_near(fit, truth)
    assert fit is not None
    assert fit.inliers.sum() > 0.95 * 1500  # 97 % of a normal error are within three standard deviations of each axis


def test_the_larger_of_two_consensus_sets_wins() -> None:
    """As with repeated fronts, half as many correspondences agree with a second similarity."""
    rng = np.random.default_rng(5)
    source = box_surface(400, rng)
    large, small = random_similarity(rng), random_similarity(rng)
    target = np.concatenate([large.apply(source[:120]), small.apply(source[120:180]), rng.uniform(-1, 1, (220, 3))])
    target += rng.normal(0, NOISE_M, target.shape)
    assert_near(similarity_consensus(source, target, threshold=3 * NOISE_M, rng=rng), large)


def test_scale_stays_in_its_range() -> None:
    source, target, truth = correspondences(2, 300, 0.5)
    around = (0.9 * truth.scale, 1.1 * truth.scale)
    beside = (1.5 * truth.scale, 2.0 * truth.scale)
    limits = {"threshold": 3 * NOISE_M, "rng": np.random.default_rng(0), "minimum_inliers": 8}
    assert_near(similarity_consensus(source, target, scale_range=around, **limits), truth)
    assert similarity_consensus(source, target, scale_range=beside, **limits) is None


def test_a_tiny_scale_cannot_win_by_collapsing_onto_a_cluster() -> None:
    rng = np.random.default_rng(8)
    source = box_surface(300, rng)
    target = source * 2.0 + rng.normal(0, 0.004, source.shape)
    target[:240] = rng.normal(0, 0.05, (240, 3))  # wrong matches concentrate at one spot
    fit = similarity_consensus(
        source, target, threshold=0.05, scale_range=(0.01, 10.0), relative_threshold=0.05, rng=np.random.default_rng(0)
    )
    assert fit is not None
    assert fit.target_from_source.scale == pytest.approx(2.0, rel=0.02)


def test_unrelated_points_give_no_fit() -> None:
    rng = np.random.default_rng(9)
    pair = rng.normal(size=(40, 3)), rng.normal(size=(40, 3))
    assert similarity_consensus(*pair, threshold=0.01, rng=rng, minimum_inliers=8) is None


@pytest.mark.parametrize("count", [0, 2, 3])
def test_too_few_or_coinciding_points_give_no_fit(count: int) -> None:
    points = np.ones((count, 3))
    assert similarity_consensus(points, points, threshold=0.01, rng=np.random.default_rng(0)) is None
    assert similarity_consensus(np.ones((9, 3)), np.ones((9, 3)), threshold=0.01, rng=np.random.default_rng(0)) is None


def test_the_same_call_gives_the_same_fit() -> None:
    source, target, _ = correspondences(3, 400, 0.9)
    first, second = (similarity_consensus(source, target, threshold=0.015, rng=np.random.default_rng(1)) for _ in range(2))
    assert first is not None
    assert second is not None
    np.testing.assert_array_equal(first.target_from_source.matrix, second.target_from_source.matrix)
