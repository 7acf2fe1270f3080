"""Fine registration: one robust least-squares estimate over all frames and kinds of evidence (paper eq. 7, ICP)."""

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
    """Damped Gauss-Newton over turn, shift and (when free) scale; gates shrink from `loose` (a share of the size) on."""
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
    """The step (7,) of turn and shift that all the evidence together holds least, of a metre at the rim, and its spread (m)."""
    normal = sum_rows(all_rows(pose, shape, observation, anchors, lifted, finest_gate(observation)))
    unit = rim_unit(observation.size_m)[:6]
    values, vectors = np.linalg.eigh(normal.information[:6, :6] * np.outer(unit, unit))
    return np.append(unit * vectors[:, 0], 0.0), float(1.0 / np.sqrt(max(values[0], 1e-12)))


def sum_rows(rows: list[Rows]) -> Normal:
    """Normal equations of all factors, over turn, shift and log scale."""
    return sum((Normal.of(part.jacobian, part.residual, part.weight) for part in rows), Normal(np.zeros((7, 7)), np.zeros(7)))


def rim_unit(size_m: float) -> np.ndarray:
    """Turn, shift and log scale (7,) that move the object's rim by a metre each."""
    reach = 2.0 / max(size_m, 1e-3)
    return np.array([reach] * 3 + [1.0] * 3 + [reach])


def _solve(rows: list[Rows], size_m: float, free_scale: bool) -> np.ndarray:
    """The damped step (7,), bounded to 6 degrees, a tenth of the size and 8 % of scale."""
    normal, unit = sum_rows(rows), rim_unit(size_m)
    scaled, right = normal.information * np.outer(unit, unit), unit * normal.pull
    # One observation of half a size stops directions that nothing holds.
    scaled += np.eye(7) * (1e-6 * np.trace(scaled) / 7 + 4.0 / max(size_m, 1e-3) ** 2)
    if not free_scale:
        scaled[6, :], scaled[:, 6] = 0.0, 0.0
        scaled[6, 6] = 1.0
        right[6] = 0.0
    step = unit * np.linalg.solve(scaled, right)
    limits = np.array([np.radians(6)] * 3 + [0.1 * size_m] * 3 + [0.08])
    return np.asarray(step / max(1.0, float((np.abs(step) / limits).max())))


def moved(pose: Similarity3, step: np.ndarray, pivot: Vector3) -> Similarity3:
    """The pose after a step of turn (rad), shift (m) and log scale about the pivot."""
    turn: Matrix3 = Rotation.from_rotvec(step[:3]).as_matrix()
    grow = float(np.exp(step[6]))
    translation = grow * turn @ (pose.translation - pivot) + pivot + step[3:6]
    return Similarity3(pose.scale * grow, turn @ pose.rotation, translation)


def turned_about_middle(pose: Similarity3, turn: Matrix3, shape: Shape) -> Similarity3:
    """The pose after a turn in the world that leaves the middle of the placed mesh where it is."""
    return moved(pose, np.append(Rotation.from_matrix(turn).as_rotvec(), np.zeros(4)), pivot_of(pose, shape))


def point_condition(pose: Similarity3, shape: Shape, observation: Observation) -> float:
    """Largest over smallest eigenvalue of the points' normal matrix in turn and shift: large = the surface slides."""
    rows = point_rows(pose, shape, observation, pivot_of(pose, shape), 0.05 * observation.size_m)
    if len(rows.residual) < 6:
        return 1e9
    scaled = rows.jacobian[:, :6] / np.array([0.5 * observation.size_m] * 3 + [1.0] * 3)
    values = np.linalg.eigvalsh((scaled * rows.weight[:, None]).T @ scaled)
    return float(min(values[-1] / max(values[0], 1e-12 * values[-1]), 1e9))
