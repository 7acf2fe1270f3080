"""Kernels, normal equations and robust linear fits, compared with their definitions."""

import numpy as np
import pytest

from r2c2r_core.geometry.least_squares import Normal, cauchy, cauchy_loss, fit_linear, geman_mcclure


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(5)


def test_normal_equations_of_parts_sum_to_those_of_all_rows(rng: np.random.Generator) -> None:
    jacobian, residual, weight = rng.normal(size=(9, 3)), rng.normal(size=9), rng.uniform(0.1, 2.0, 9)
    whole = Normal.of(jacobian, residual, weight)
    first, second = (Normal.of(jacobian[part], residual[part], weight[part]) for part in (slice(4), slice(4, None)))
    root = np.sqrt(weight)
    expected = np.linalg.lstsq(jacobian * root[:, None], -residual * root, rcond=None)[0]
    np.testing.assert_allclose((first + second).step(), expected, atol=1e-12)
    np.testing.assert_allclose((whole - second).step(), first.step(), atol=1e-9)


def test_damping_shortens_a_step_and_zeroes_unobserved_parameters(rng: np.random.Generator) -> None:
    normal = Normal.of(np.array([[1.0, 0.0], [2.0, 0.0]]), np.array([-1.0, -2.0]), np.ones(2))
    np.testing.assert_allclose(normal.step(1.0), [5.0 / 6.0, 0.0])


def test_slope_and_curvature_of_the_loss_match_finite_differences() -> None:
    scale = np.array([0.5, 2.0, np.inf])
    loss = cauchy_loss(scale)
    at, step = np.array([0.3, 7.0, 4.0]), 1e-5
    value, slope, curvature = loss(at)
    np.testing.assert_allclose((loss(at + step)[0] - loss(at - step)[0]) / (2 * step), slope, rtol=1e-8)
    np.testing.assert_allclose((loss(at + step)[1] - loss(at - step)[1]) / (2 * step), curvature, rtol=1e-6)
    np.testing.assert_allclose(slope, cauchy(np.sqrt(at), scale))
    assert value[2] == at[2]


@pytest.mark.parametrize(("kernel", "scale"), [(cauchy, 0.03), (geman_mcclure, 0.15)])
def test_a_line_is_fitted_among_outliers(kernel: object, scale: float, rng: np.random.Generator) -> None:
    x = rng.uniform(-1.0, 1.0, 400)
    y = 0.3 * x - 0.1 + 0.01 * rng.standard_normal(400)
    wrong = rng.random(400) < 0.3
    y[wrong] += rng.uniform(0.3, 1.0, int(wrong.sum()))
    design = np.column_stack([x, np.ones(400)])
    start = np.linalg.lstsq(design, y, rcond=None)[0]
    found, information = fit_linear(design, y, kernel, scale, rounds=40, start=start)  # type: ignore[arg-type]
    assert np.abs(start - [0.3, -0.1]).max() > 0.1
    np.testing.assert_allclose(found, [0.3, -0.1], atol=0.01)
    assert (np.linalg.eigvalsh(information) > 0).all()


def test_rows_with_several_targets_get_one_weight(rng: np.random.Generator) -> None:
    z = np.linspace(0.0, 1.0, 50)
    middles = np.column_stack([0.2 * z, -0.1 * z]) + 0.4
    middles[:5, 0] += 0.5
    found, _ = fit_linear(np.column_stack([z, np.ones(50)]), middles, geman_mcclure, 0.05, rounds=40)
    np.testing.assert_allclose(found, [[0.2, -0.1], [0.4, 0.4]], atol=1e-3)
