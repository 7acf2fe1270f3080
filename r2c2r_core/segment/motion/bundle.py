"""One robust fit of a joint to all frames: its axis, its pivot and every state, with covariance from the Jacobian."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.sparse import lil_matrix

from r2c2r_core.arrays import Matrix3, Vector3
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.segment.motion.hypotheses import Hypothesis, moved
from r2c2r_core.segment.motion.pose import PlaneFix
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """What is known of a joint before any frame."""

    axis_rad: float = param(float(np.deg2rad(0.5)), "rad", "standard deviation of an axis from its front's edge or normal")
    pivot_m: float = param(
        0.012, "m", "standard deviation of a hinge from its front's edge", source="concealed hinges turn 5-20 mm inside it"
    )
    thickness_m: float = param(0.003, "m", "standard deviation of a board's thickness", source="lists: fronts of 16-22 mm")
    free_state: float = param(1.0, "ratio", "standard deviation of a state before it is seen: radians or metres", gt=0)
    outlier: float = param(2.0, "σ", "of a frame's plane from which it counts less (Huber 1964)", gt=0)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FittedJoint:
    """A joint in the front frame of its closed leaf."""

    axis: Vector3  # unit
    pivot: Vector3
    turns: bool
    across: np.ndarray  # (2, 3) unit directions square to the axis: of its turns, and of the pivot's shifts
    covariance: np.ndarray  # (4, 4): two turns of the axis (rad), two shifts of the pivot (m)

    def pose(self, state: float) -> Rigid3:
        """Where the leaf stands: front_from_leaf, the identity where closed."""
        return moved(self.axis, self.pivot, self.turns, state)

    def covariance_in(self, rotation: Matrix3) -> np.ndarray:
        """(6, 6), of a small rotation of the axis (rad) and of the pivot (m), in a frame that `rotation` turns into."""
        spread = np.zeros((6, 4))
        spread[:3, :2] = spread[3:, 2:] = rotation @ self.across.T
        return np.asarray(spread @ self.covariance @ spread.T)


def as_supposed(hypothesis: Hypothesis) -> FittedJoint:
    """The joint as it was known before any frame."""
    params = tuned(Params)
    return FittedJoint(
        axis=hypothesis.axis,
        pivot=hypothesis.pivot,
        turns=hypothesis.turns,
        across=_across(hypothesis),
        covariance=np.diag([params.axis_rad**2, params.axis_rad**2, params.pivot_m**2, params.pivot_m**2]),
    )


def fit_joint(
    hypothesis: Hypothesis, fixes: Sequence[PlaneFix], states: np.ndarray
) -> tuple[FittedJoint, np.ndarray, np.ndarray]:
    """The joint near a hypothesis that explains the planes best, and each frame's state with its standard deviation."""
    params = tuned(Params)
    across = _across(hypothesis)
    count = len(fixes)
    whiten = [np.linalg.inv(np.linalg.cholesky(fix.covariance)) for fix in fixes]
    prior = np.concatenate([np.full(2, params.axis_rad), np.full(2, params.pivot_m), [params.thickness_m]])

    def residuals(x: np.ndarray) -> np.ndarray:
        axis, pivot = _joint_at(hypothesis, across, x)
        rows = [
            white @ (fix.plane - _plane_at(fix, moved(axis, pivot, hypothesis.turns, state), x[4]))
            for fix, white, state in zip(fixes, whiten, x[5:], strict=True)
        ]
        return np.concatenate([*rows, x[:5] / prior, (x[5:] - states) / params.free_state])

    start = np.concatenate([np.zeros(5), states])
    fitted = least_squares(
        residuals,
        start,
        loss="huber",
        f_scale=params.outlier,
        jac_sparsity=_sparsity(count),
        x_scale=_scales(count, hypothesis),
    )
    jacobian = np.asarray(fitted.jac.todense()) if hasattr(fitted.jac, "todense") else np.asarray(fitted.jac)
    covariance = np.linalg.inv(jacobian.T @ jacobian)
    axis, pivot = _joint_at(hypothesis, across, fitted.x)
    joint = FittedJoint(axis=axis, pivot=pivot, turns=hypothesis.turns, across=across, covariance=covariance[:4, :4])
    return joint, fitted.x[5:], np.sqrt(np.diag(covariance)[5:])


def _across(hypothesis: Hypothesis) -> np.ndarray:
    return np.stack([v for v in np.eye(3) if abs(v @ hypothesis.axis) < 0.5])


def _joint_at(hypothesis: Hypothesis, across: np.ndarray, x: np.ndarray) -> tuple[Vector3, Vector3]:
    axis = hypothesis.axis + x[0] * np.cross(across[0], hypothesis.axis) + x[1] * np.cross(across[1], hypothesis.axis)
    return axis / np.linalg.norm(axis), hypothesis.pivot + x[2] * across[0] + x[3] * across[1]


def _plane_at(fix: PlaneFix, pose: Rigid3, thicker_m: float) -> np.ndarray:
    """The plane that a pose of the leaf predicts, as the fix measures it: in the frame where the leaf was expected."""
    local = fix.expected.inverse @ pose
    normal = local.rotation[:, 1]
    level = float(normal @ local.translation) / normal[1]
    back = thicker_m / normal[1] if fix.is_back else 0.0
    return np.array([level + back, -normal[0] / normal[1], -normal[2] / normal[1]])


def _sparsity(count: int) -> lil_matrix:
    """Which residuals depend on what: each frame on its own state, and all on the joint."""
    pattern = lil_matrix((3 * count + 5 + count, 5 + count), dtype=int)
    pattern[: 3 * count, :5] = 1
    for k in range(count):
        pattern[3 * k : 3 * k + 3, 5 + k] = 1
        pattern[3 * count + 5 + k, 5 + k] = 1
    for k in range(5):
        pattern[3 * count + k, k] = 1
    return pattern


def _scales(count: int, hypothesis: Hypothesis) -> np.ndarray:
    state = 0.02 if hypothesis.turns else 0.005
    return np.concatenate([[0.01, 0.01, 0.005, 0.005, 0.003], np.full(count, state)])
