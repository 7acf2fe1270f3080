import numpy as np
import pytest

from r2c2r_core.geometry.least_change import least_change

NONE = np.zeros((0, 2)), np.zeros(0)


def test_satisfied_bounds_give_zero_change() -> None:
    np.testing.assert_array_equal(least_change(*NONE, np.array([[1.0, 0.0]]), np.array([-1.0])), [0, 0])


def test_the_solution_for_one_bound_is_its_orthogonal_projection() -> None:
    np.testing.assert_allclose(least_change(*NONE, np.array([[3.0, 4.0]]), np.array([10.0])), [1.2, 1.6], atol=1e-12)


def test_an_equality_and_a_bound_are_both_satisfied() -> None:
    y = least_change(np.array([[1.0, -1.0]]), np.array([1.0]), np.array([[0.0, 1.0]]), np.array([2.0]))
    np.testing.assert_allclose(y, [3, 2], atol=1e-9)


def test_no_feasible_point_is_closer_than_the_solution() -> None:
    """Checked on random problems against other feasible points, by the optimality condition of a projection."""
    rng = np.random.default_rng(0)
    for _ in range(20):
        equal, rows = rng.normal(size=(2, 8)), rng.normal(size=(12, 8))
        inside = rng.normal(size=8)
        equal_to, bound = equal @ inside, rows @ inside - rng.uniform(0, 1, 12)
        y = least_change(equal, equal_to, rows, bound)
        assert (rows @ y >= bound - 1e-9).all()
        np.testing.assert_allclose(equal @ y, equal_to, atol=1e-9)
        for _ in range(200):  # the distance to any other feasible point is larger
            other = inside + rng.normal(size=8) * 0.3
            other -= equal.T @ np.linalg.solve(equal @ equal.T, equal @ other - equal_to)
            if (rows @ other >= bound).all():
                assert y @ (other - y) >= -1e-9


def test_contradicting_bounds_raise() -> None:
    with pytest.raises(ValueError, match="contradict"):
        least_change(*NONE, np.array([[1.0, 0.0], [-1.0, 0.0]]), np.array([1.0, 1.0]))


@pytest.mark.parametrize("far", [1e-3, 1.0, 1e3, 1e5])
def test_a_distant_bound_is_met_beside_a_nearly_rigid_one(far: float) -> None:
    """The costs of the unknowns differ by large factors, as for a soft bound beside a face."""
    rows = np.array([[5e-3, 5e-3, 1e-5, 0.0], [-5e-3, 5e-3, 0.0, 1e-5]])
    y = least_change(np.zeros((0, 4)), np.zeros(0), rows, np.array([5e-3 * far, -1e-4]))
    assert (rows @ y >= [5e-3 * far * (1 - 1e-9), -1e-4 - 1e-9 * far]).all()
    np.testing.assert_allclose(y[:2], far / 2, rtol=1e-4)
