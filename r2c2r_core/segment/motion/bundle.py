"""Robust fit of one joint to all frames: its axis, its pivot and every state, with their covariance.

Gauss-Newton with Huber weights. The information matrix has the shape of an arrow, for a frame's state is linked to the others
only through the joint: the states are eliminated by the Schur complement, as points are in bundle adjustment.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from r2c2r_core.arrays import Matrix3, Vector3
from r2c2r_core.geometry.least_squares import huber
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
    rounds: int = param(15, "count", "Number of Gauss-Newton rounds", source="4 to 13 rounds reach a ten-thousandth of σ", ge=1)
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

    def residuals(joint: np.ndarray, values: np.ndarray) -> np.ndarray:
        off = seen.planes - _predicted(seen, hypothesis, across, joint, values)
        return np.column_stack([np.einsum("nij,nj->ni", seen.whiten, off), (values - states) / params.free_state])

    found, values = np.zeros(5), states.astype(np.float64)
    for _ in range(params.rounds):
        off, by_joint, by_state = _linearised(residuals, found, values)
        weights, held = huber(off, params.outlier), huber(found / prior, params.outlier) / prior**2
        pull = -np.einsum("nri,nr->i", by_joint, weights * off) - held * found
        change, changes = _Arrow.of(by_joint, by_state, weights, held).step(pull, -(by_state * weights * off).sum(axis=1))
        found, values = found + change, values + changes
    off, by_joint, by_state = _linearised(residuals, found, values)
    inliers, held = np.abs(off) <= params.outlier, (np.abs(found / prior) <= params.outlier) / prior**2  # the loss's curvature
    covariance, variances = _Arrow.of(by_joint, by_state, inliers, held).covariance()
    axis, pivot = _joint_at(hypothesis, across, found)
    joint = FittedJoint(
        axis=axis,
        pivot=pivot,
        turns=hypothesis.turns,
        across=across,
        covariance=covariance[:4, :4],
        thicker_m=float(found[4]),
        sigma_thicker_m=float(np.sqrt(covariance[4, 4])),
    )
    return joint, values, np.sqrt(variances)


@dataclass(frozen=True, slots=True, eq=False)
class _Arrow:
    """Information matrix of the joint's five parameters and of one state per frame."""

    joint: np.ndarray  # (5, 5)
    between: np.ndarray  # (n, 5) of each state with the joint
    states: np.ndarray  # (n,)

    @staticmethod
    def of(by_joint: np.ndarray, by_state: np.ndarray, weights: np.ndarray, held: np.ndarray) -> "_Arrow":
        """Information of residuals (n, r) with derivatives (n, r, 5) and (n, r), and of the joint's prior (5,)."""
        weighted = by_joint * weights[..., None]
        return _Arrow(
            np.einsum("nri,nrj->ij", weighted, by_joint) + np.diag(held),
            np.einsum("nri,nr->ni", weighted, by_state),
            (weights * by_state**2).sum(axis=1),
        )

    @property
    def _reduced(self) -> np.ndarray:
        """Schur complement of the states."""
        return self.joint - self.between.T @ (self.between / self.states[:, None])

    def step(self, pull: np.ndarray, pulls: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Gauss-Newton step of the joint (5,) and of the states (n,)."""
        change = np.linalg.solve(self._reduced, pull - self.between.T @ (pulls / self.states))
        return change, (pulls - self.between @ change) / self.states

    def covariance(self) -> tuple[np.ndarray, np.ndarray]:
        """Covariance of the joint (5, 5), and variances of the states (n,)."""
        joint, along = np.linalg.inv(self._reduced), self.between / self.states[:, None]
        return joint, 1 / self.states + np.einsum("ni,ij,nj->n", along, joint, along)


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


def _predicted(seen: _Stacked, hypothesis: Hypothesis, across: np.ndarray, x: np.ndarray, states: np.ndarray) -> np.ndarray:
    """Planes (n, 3) predicted by the joint (5,) and its states (n,), in the parametrisation of the fixes."""
    axis, pivot = _joint_at(hypothesis, across, x)
    if hypothesis.turns:
        rotation = Rotation.from_rotvec(axis * states[:, None]).as_matrix()
        shift = pivot - rotation @ pivot
    else:
        rotation, shift = np.tile(np.eye(3), (len(states), 1, 1)), axis * states[:, None]
    normal = np.einsum("nij,nj->ni", seen.turned, rotation[:, :, 1])
    origin = np.einsum("nij,nj->ni", seen.turned, shift) + seen.shifted
    level = ((normal * origin).sum(axis=1) + np.where(seen.is_back, x[4], 0.0)) / normal[:, 1]
    return np.stack([level, -normal[:, 0] / normal[:, 1], -normal[:, 2] / normal[:, 1]], axis=1)


def _linearised(
    residuals: Callable[[np.ndarray, np.ndarray], np.ndarray], joint: np.ndarray, states: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Residuals (n, r) and their forward differences by the joint (n, r, 5) and by each frame's own state (n, r)."""
    step, base = 1e-6, residuals(joint, states)
    by_joint = np.stack([(residuals(joint + moved, states) - base) / step for moved in step * np.eye(5)], axis=-1)
    return base, by_joint, (residuals(joint, states + step) - base) / step
