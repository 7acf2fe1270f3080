"""Fine registration: robust Gauss-Newton over all frames and kinds of evidence (paper eq. 7, ICP)."""

from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from r2c2r_core.align.lift import Lifted
from r2c2r_core.align.observe import Observation
from r2c2r_core.align.residuals import Anchors, Rows, all_rows, finest_gate, pivot_of, point_rows
from r2c2r_core.align.shape import Shape
from r2c2r_core.arrays import Matrix3, Vector3
from r2c2r_core.geometry.least_squares import Normal
from r2c2r_core.geometry.transforms import Similarity3


def refine(
    pose: Similarity3,
    shape: Shape,
    observation: Observation,
    anchors: Anchors,
    lifted: Sequence[Lifted],
    *,
    free_scale: bool,
    iterations: int,
    loose: float,
) -> Similarity3:
    """Damped Gauss-Newton over rotation, translation and (if free) scale; gates shrink from `loose` (relative to the size)."""
    gate = loose * observation.size_m
    for _ in range(iterations):
        rows = all_rows(pose, shape, observation, anchors, lifted, gate)
        step = _solve(rows, observation.size_m, free_scale)
        pose = moved(pose, step, pivot_of(pose, shape))
        gate = max(0.75 * gate, finest_gate(observation))
    return pose


def loosest_motion(
    pose: Similarity3, shape: Shape, observation: Observation, anchors: Anchors, lifted: Sequence[Lifted]
) -> tuple[np.ndarray, float]:
    """Least constrained step (7,) of rotation and translation, of one metre at the rim, and its standard deviation (m)."""
    normal = sum_rows(all_rows(pose, shape, observation, anchors, lifted, finest_gate(observation)))
    unit = rim_unit(observation.size_m)[:6]
    values, vectors = np.linalg.eigh(normal.information[:6, :6] * np.outer(unit, unit))
    return np.append(unit * vectors[:, 0], 0.0), float(1.0 / np.sqrt(max(values[0], 1e-12)))


def sum_rows(rows: list[Rows]) -> Normal:
    """Normal equations of all factors, over rotation, translation and log scale."""
    return sum((Normal.of(part.jacobian, part.residual, part.weight) for part in rows), Normal(np.zeros((7, 7)), np.zeros(7)))


def rim_unit(size_m: float) -> np.ndarray:
    """Steps of rotation, translation and log scale (7,) that each move the object's rim by one metre."""
    reach = 2.0 / max(size_m, 1e-3)
    return np.array([reach] * 3 + [1.0] * 3 + [reach])


def _solve(rows: list[Rows], size_m: float, free_scale: bool) -> np.ndarray:
    """The damped step (7,), bounded to 6 degrees, a tenth of the size and 8 % of scale."""
    normal, unit = sum_rows(rows), rim_unit(size_m)
    scaled, right = normal.information * np.outer(unit, unit), unit * normal.pull
    # A weak prior, one observation of half the size, damps unconstrained directions.
    scaled += np.eye(7) * (1e-6 * np.trace(scaled) / 7 + 4.0 / max(size_m, 1e-3) ** 2)
    if not free_scale:
        scaled[6, :], scaled[:, 6] = 0.0, 0.0
        scaled[6, 6] = 1.0
        right[6] = 0.0
    step = unit * np.linalg.solve(scaled, right)
    limits = np.array([np.radians(6)] * 3 + [0.1 * size_m] * 3 + [0.08])
    return np.asarray(step / max(1.0, float((np.abs(step) / limits).max())))


def moved(pose: Similarity3, step: np.ndarray, pivot: Vector3) -> Similarity3:
    """The pose after a step of rotation (rad), translation (m) and log scale about the pivot."""
    turn: Matrix3 = Rotation.from_rotvec(step[:3]).as_matrix()
    grow = float(np.exp(step[6]))
    translation = grow * turn @ (pose.translation - pivot) + pivot + step[3:6]
    return Similarity3(pose.scale * grow, turn @ pose.rotation, translation)


def turned_about_middle(pose: Similarity3, turn: Matrix3, shape: Shape) -> Similarity3:
    """The pose after a rotation in the world that leaves the centre of the placed mesh fixed."""
    return moved(pose, np.append(Rotation.from_matrix(turn).as_rotvec(), np.zeros(4)), pivot_of(pose, shape))


def point_condition(pose: Similarity3, shape: Shape, observation: Observation) -> float:
    """Condition number of the points' normal matrix in rotation and translation: large where the surface can slide."""
    rows = point_rows(pose, shape, observation, pivot_of(pose, shape), 0.05 * observation.size_m)
    if len(rows.residual) < 6:
        return 1e9
    scaled = rows.jacobian[:, :6] / np.array([0.5 * observation.size_m] * 3 + [1.0] * 3)
    values = np.linalg.eigvalsh((scaled * rows.weight[:, None]).T @ scaled)
    return float(min(values[-1] / max(values[0], 1e-12 * values[-1]), 1e9))
