"""The joint fit against a general solver, and the block form of its covariance against the full matrix."""

import numpy as np
import pytest
from scipy.optimize import least_squares

from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.segment.motion import bundle
from r2c2r_core.segment.motion.bundle import Params, fit_joint
from r2c2r_core.segment.motion.hypotheses import Hypothesis
from r2c2r_core.segment.motion.pose import PlaneFix
from r2c2r_core.tuning import tuned
from tests.core.segment.motion.boards import joint

STATES = {"left": np.linspace(0.2, 1.4, 25), "bottom": np.linspace(0.1, 1.3, 25), "out": np.linspace(0.05, 0.4, 25)}
SIGMAS = np.array([0.004, 0.005, 0.005])  # of a plane's position (m) and slopes
SIGMA_THICKNESS_M = 0.003


def fixes(hypothesis: Hypothesis, states: np.ndarray) -> list[PlaneFix]:
    """Planes of a leaf whose hinge is 1 cm off, seen a degree or a centimetre from the expected poses; three are outliers."""
    rng = np.random.default_rng(4)
    off, found = Rigid3(np.eye(3), np.array([0.01, 0.006, 0.0])), []
    for number, state in enumerate(states):
        expected = hypothesis.pose(float(state) + float(rng.normal(0, 0.01)))
        leaf_from_expected = (off @ hypothesis.pose(float(state)) @ off.inverse).inverse @ expected
        normal, origin = leaf_from_expected.inverse.rotation[:, 1], leaf_from_expected.inverse.translation
        plane = np.array([normal @ origin, -normal[0], -normal[2]]) / normal[1] + rng.normal(0, SIGMAS)
        plane[0] += 0.03 if number in (4, 11, 17) else 0.0
        found.append(PlaneFix(number, expected, plane, np.diag(SIGMAS**2), number % 2 == 0, 500))
    return found


@pytest.mark.parametrize("way", STATES)
def test_the_fit_equals_that_of_a_general_robust_solver(way: str) -> None:
    hypothesis, expected, params = joint(way), STATES[way], tuned(Params)
    planes = fixes(hypothesis, expected)
    seen, across = bundle._stacked(planes), bundle._across(hypothesis)
    prior = np.array([params.axis_rad, params.axis_rad, params.pivot_m, params.pivot_m, SIGMA_THICKNESS_M])

    def residuals(x: np.ndarray) -> np.ndarray:
        off = seen.planes - bundle._predicted(seen, hypothesis, across, x[:5], x[5:])
        whitened = np.einsum("nij,nj->ni", seen.whiten, off)
        return np.concatenate([whitened.ravel(), x[:5] / prior, (x[5:] - expected) / params.free_state])

    start = np.concatenate([np.zeros(5), expected])
    oracle = least_squares(residuals, start, loss="huber", f_scale=params.outlier, x_scale="jac", xtol=1e-12, ftol=1e-12)
    found, states, sigmas = fit_joint(hypothesis, planes, expected, SIGMA_THICKNESS_M)
    axis, pivot = bundle._joint_at(hypothesis, across, oracle.x[:5])
    covariance = np.linalg.inv(oracle.jac.T @ oracle.jac)
    assert found.axis == pytest.approx(axis, abs=1e-5)
    assert found.pivot == pytest.approx(pivot, abs=1e-5)
    assert states == pytest.approx(oracle.x[5:], abs=1e-5)
    assert found.covariance == pytest.approx(covariance[:4, :4], rel=1e-3, abs=1e-9)
    assert sigmas == pytest.approx(np.sqrt(np.diag(covariance)[5:]), rel=1e-3)


def test_outlying_frames_hardly_move_the_hinge() -> None:
    hypothesis, expected = joint("left"), STATES["left"]
    found, _, _ = fit_joint(hypothesis, fixes(hypothesis, expected), expected, SIGMA_THICKNESS_M)
    assert found.pivot[:2] - hypothesis.pivot[:2] == pytest.approx([0.01, 0.006], abs=0.003)
