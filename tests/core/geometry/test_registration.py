"""Similarity fits recover a perturbed known truth, forward and inverse."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from r2c2r_core.geometry.registration import DegenerateFitError, umeyama, umeyama_batch
from r2c2r_core.geometry.transforms import Similarity3


def random_similarity(seed: int) -> Similarity3:
    rng = np.random.default_rng(seed)
    return Similarity3(
        float(np.exp(rng.uniform(-1.2, 1.2))), Rotation.random(random_state=seed).as_matrix(), rng.uniform(-2, 2, 3)
    )


def angle_deg(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.degrees(Rotation.from_matrix(a.T @ b).magnitude()))


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("flat", [False, True])
def test_umeyama_recovers_the_similarity_and_its_inverse(seed: int, flat: bool) -> None:
    truth = random_similarity(seed)
    source = np.random.default_rng(seed + 100).normal(size=(12, 3)) * ([1, 1, 0] if flat else [1, 1, 1])
    target = truth.apply(source)
    forward, backward = umeyama(source, target), umeyama(target, source)
    assert forward.scale == pytest.approx(truth.scale)
    np.testing.assert_allclose(forward.rotation, truth.rotation, atol=1e-7)
    np.testing.assert_allclose(backward.matrix, truth.inverse.matrix, atol=1e-6)


def test_equations_4_and_5_of_the_paper_give_the_inverse_rotation() -> None:
    truth = random_similarity(3)
    p = np.random.default_rng(0).normal(size=(20, 3))
    q = truth.apply(p)
    p0, q0 = p - p.mean(axis=0), q - q.mean(axis=0)
    u, _, vt = np.linalg.svd(q0.T @ p0)  # eq. 4: H = sum q p^T
    printed = vt.T @ u.T  # eq. 5: R = V U^T
    assert angle_deg(printed, truth.rotation.T) < 1e-4
    assert angle_deg(printed, truth.rotation) > 5.0
    assert angle_deg(umeyama(p, q).rotation, truth.rotation) < 1e-4


def test_flat_noisy_fronts_are_never_fitted_with_a_reflection() -> None:
    rng = np.random.default_rng(1)
    reflections = 0
    for seed in range(60):
        truth = random_similarity(seed)
        source = rng.uniform(-0.5, 0.5, (12, 3)) * [1, 1, 0]
        target = truth.apply(source) + rng.normal(0, 0.01 * truth.scale, source.shape)
        u, _, vt = np.linalg.svd((target - target.mean(axis=0)).T @ (source - source.mean(axis=0)))
        reflections += np.linalg.det(u @ vt) < 0
        fit = umeyama(source, target)
        assert np.linalg.det(fit.rotation) == pytest.approx(1.0)
        assert angle_deg(fit.rotation, truth.rotation) < 5.0  # 1 cm noise on a metre
    assert reflections > 10  # without the sign of the determinant


def test_mirrored_clouds_are_not_matched_by_a_reflection() -> None:
    source = np.random.default_rng(2).normal(size=(30, 3))
    fit = umeyama(source, source * [-1, 1, 1])
    assert np.linalg.det(fit.rotation) == pytest.approx(1.0)
    assert np.linalg.norm(fit.apply(source) - source * [-1, 1, 1], axis=1).mean() > 0.2


def test_collinear_points_raise() -> None:
    line = np.outer(np.linspace(0, 1, 8), [1.0, 2.0, 3.0])
    with pytest.raises(DegenerateFitError):
        umeyama(line, line)


def test_a_fixed_scale_is_kept() -> None:
    source = np.random.default_rng(4).normal(size=(30, 3))
    assert umeyama(source, 2.0 * source, scale=1.5).scale == 1.5


def test_zero_weights_exclude_outliers() -> None:
    truth = random_similarity(5)
    source = np.random.default_rng(5).normal(size=(30, 3))
    target = truth.apply(source)
    target[:10] += 5.0
    weights = np.repeat([0.0, 1.0], [10, 20])
    scales, rotations, shifts = umeyama_batch(source[None], target[None], weights[None])
    np.testing.assert_allclose(scales[0] * rotations[0], truth.matrix[:3, :3], atol=1e-7)
    np.testing.assert_allclose(shifts[0], truth.translation, atol=1e-7)


def test_the_batch_fit_equals_single_fits() -> None:
    rng = np.random.default_rng(6)
    source, target = rng.normal(size=(5, 9, 3)), rng.normal(size=(5, 9, 3))
    scales, rotations, shifts = umeyama_batch(source, target)
    for k in range(5):
        one = umeyama(source[k], target[k])
        np.testing.assert_allclose(scales[k] * rotations[k], one.scale * one.rotation, atol=1e-9)
        np.testing.assert_allclose(shifts[k], one.translation, atol=1e-9)
