"""Robust fit of one joint to all frames: its axis, its pivot and every state, with covariance from the Jacobian."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from r2c2r_core.arrays import Matrix3, Vector3
from r2c2r_core.geometry.transforms import Rigid3, joint_transform
from r2c2r_core.segment.motion.hypotheses import Hypothesis
from r2c2r_core.segment.motion.pose import PlaneFix
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters (priors and robust scale) of the joint fit."""

    axis_rad: float = param(
        float(np.deg2rad(0.5)), "rad", "Standard deviation of a joint axis relative to its front's edge or normal"
    )
    pivot_m: float = param(
        0.012,
        "m",
        "Standard deviation of a hinge relative to its front's edge",
        source="concealed hinges turn 5-20 mm inside the edge",
    )
    free_state: float = param(1.0, "ratio", "Prior standard deviation of a state: radians or metres", gt=0)
    outlier: float = param(2.0, "σ", "Residual of a frame's plane above which its weight falls (Huber 1964)", gt=0)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FittedJoint:
    """A joint in the front frame of its closed leaf."""

    axis: Vector3  # unit
    pivot: Vector3
    turns: bool
    across: np.ndarray  # (2, 3) unit directions perpendicular to the axis: of its rotations, and of the pivot's shifts
    covariance: np.ndarray  # (4, 4): two rotations of the axis (rad), two shifts of the pivot (m)
    thicker_m: float = 0.0  # than the leaf was assumed to be, and
    sigma_thicker_m: float = np.inf  # its standard deviation

    def pose(self, state: float) -> Rigid3:
        """Pose of the leaf in a state: front_from_leaf, the identity where closed."""
        return joint_transform(self.axis, self.pivot, state, turns=self.turns)

    def covariance_in(self, rotation: Matrix3) -> np.ndarray:
        """Covariance (6, 6) of a small rotation of the axis (rad) and of the pivot (m), in the frame `rotation` maps into."""
        spread = np.zeros((6, 4))
        spread[:3, :2] = spread[3:, 2:] = rotation @ self.across.T
        return np.asarray(spread @ self.covariance @ spread.T)


def as_supposed(hypothesis: Hypothesis) -> FittedJoint:
    """Prior joint of a hypothesis, before any frame."""
    params = tuned(Params)
    return FittedJoint(
        axis=hypothesis.axis,
        pivot=hypothesis.pivot,
        turns=hypothesis.turns,
        across=_across(hypothesis),
        covariance=np.diag([params.axis_rad**2, params.axis_rad**2, params.pivot_m**2, params.pivot_m**2]),
    )


def fit_joint(
    hypothesis: Hypothesis, fixes: Sequence[PlaneFix], states: np.ndarray, sigma_thickness_m: float
) -> tuple[FittedJoint, np.ndarray, np.ndarray]:
    """Maximum-a-posteriori joint near a hypothesis, given the planes, and each frame's state with its standard deviation.

    Planes of the front and of the back tell how thick the leaf is, within `sigma_thickness_m` of what was assumed.
    """
    params = tuned(Params)
    across, seen = _across(hypothesis), _stacked(fixes)
    prior = np.concatenate([np.full(2, params.axis_rad), np.full(2, params.pivot_m), [sigma_thickness_m]])

    def residuals(x: np.ndarray) -> np.ndarray:
        off = seen.planes - _predicted(seen, hypothesis, across, x)
        whitened = np.einsum("nij,nj->ni", seen.whiten, off).ravel()
        return np.concatenate([whitened, x[:5] / prior, (x[5:] - states) / params.free_state])

    def jacobian(x: np.ndarray) -> np.ndarray:
        return _differences(residuals, x, len(fixes))

    start = np.concatenate([np.zeros(5), states])
    scales = np.concatenate([prior, np.full(len(fixes), 0.01)])
    fitted = least_squares(residuals, start, jac=jacobian, loss="huber", f_scale=params.outlier, x_scale=scales)
    covariance = np.linalg.inv(fitted.jac.T @ fitted.jac)
    axis, pivot = _joint_at(hypothesis, across, fitted.x)
    joint = FittedJoint(
        axis=axis,
        pivot=pivot,
        turns=hypothesis.turns,
        across=across,
        covariance=covariance[:4, :4],
        thicker_m=float(fitted.x[4]),
        sigma_thicker_m=float(np.sqrt(covariance[4, 4])),
    )
    return joint, fitted.x[5:], np.sqrt(np.diag(covariance)[5:])


@dataclass(frozen=True, slots=True, eq=False)
class _Stacked:
    """Fixes of all frames, stacked (n, ...)."""

    planes: np.ndarray
    whiten: np.ndarray  # (n, 3, 3): residuals of unit variance
    turned: np.ndarray  # (n, 3, 3) and
    shifted: np.ndarray  # (n, 3): from the front frame into that of the leaf at its expected pose
    is_back: np.ndarray


def _stacked(fixes: Sequence[PlaneFix]) -> _Stacked:
    inverses = [fix.expected.inverse for fix in fixes]
    return _Stacked(
        planes=np.stack([fix.plane for fix in fixes]),
        whiten=np.stack([np.linalg.inv(np.linalg.cholesky(fix.covariance)) for fix in fixes]),
        turned=np.stack([inverse.rotation for inverse in inverses]),
        shifted=np.stack([inverse.translation for inverse in inverses]),
        is_back=np.array([fix.is_back for fix in fixes]),
    )


def _across(hypothesis: Hypothesis) -> np.ndarray:
    return np.stack([v for v in np.eye(3) if abs(v @ hypothesis.axis) < 0.5])


def _joint_at(hypothesis: Hypothesis, across: np.ndarray, x: np.ndarray) -> tuple[Vector3, Vector3]:
    axis = hypothesis.axis + x[0] * np.cross(across[0], hypothesis.axis) + x[1] * np.cross(across[1], hypothesis.axis)
    return axis / np.linalg.norm(axis), hypothesis.pivot + x[2] * across[0] + x[3] * across[1]


def _predicted(seen: _Stacked, hypothesis: Hypothesis, across: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Planes (n, 3) predicted by the joint and its states, in the parametrisation of the fixes."""
    axis, pivot = _joint_at(hypothesis, across, x)
    states = x[5:]
    if hypothesis.turns:
        rotation = Rotation.from_rotvec(axis * states[:, None]).as_matrix()
        shift = pivot - rotation @ pivot
    else:
        rotation, shift = np.tile(np.eye(3), (len(states), 1, 1)), axis * states[:, None]
    normal = np.einsum("nij,nj->ni", seen.turned, rotation[:, :, 1])
    origin = np.einsum("nij,nj->ni", seen.turned, shift) + seen.shifted
    level = ((normal * origin).sum(axis=1) + np.where(seen.is_back, x[4], 0.0)) / normal[:, 1]
    return np.stack([level, -normal[:, 0] / normal[:, 1], -normal[:, 2] / normal[:, 1]], axis=1)


def _differences(residuals: Callable[[np.ndarray], np.ndarray], x: np.ndarray, count: int) -> np.ndarray:
    """Jacobian by forward differences: all states in one step, since each frame depends on its own state alone."""
    step, base = 1e-6, residuals(x)
    result = np.zeros((len(base), len(x)))
    for k in range(5):
        moved_x = x.copy()
        moved_x[k] += step
        result[:, k] = (residuals(moved_x) - base) / step
    moved_x = x.copy()
    moved_x[5:] += step
    change = (residuals(moved_x) - base) / step
    frame = np.arange(count)
    for row in range(3):
        result[3 * frame + row, 5 + frame] = change[3 * frame + row]
    result[3 * count + 5 + frame, 5 + frame] = change[3 * count + 5 + frame]
    return result
