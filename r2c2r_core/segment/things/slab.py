"""Level slabs, table tops and worktops, in the fused surface: their plane, and their plan without what stands on them."""

from dataclasses import dataclass

import numpy as np

from r2c2r_core.arrays import Points, Vector3
from r2c2r_core.geometry.least_squares import fit_linear, geman_mcclure
from r2c2r_core.segment.scene import Scene
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of level slabs."""

    level_cos: float = param(0.92, "cosine", "Minimum cosine between a face normal and up for a level surface")
    off_slab_m: float = param(
        0.015, "m", "Maximum height above a slab of points that belong to it; higher ones belong to objects on it"
    )
    hidden_m: float = param(0.12, "m", "Radius of the morphological closing that bridges objects hiding part of a slab")
    least_m2: float = param(0.045, "m²", "Minimum area of a level part under a click for it to be a slab")


@dataclass(frozen=True, slots=True, eq=False)
class Slab:
    """Level surface under the clicks: its plan in voxels, filled under the objects on it, and its plane."""

    plan: np.ndarray  # (x, y) bool
    plane: np.ndarray  # (a, b, c): its height is a x + b y + c


@dataclass(frozen=True, slots=True, eq=False)
class Levels:
    """Level faces of the fused surface in a box of voxels."""

    low: Vector3
    size_m: float
    labels: np.ndarray  # (x, y, z): number of the connected level part in a voxel, 0 elsewhere
    middles: Points  # of the faces

    def slab_at(self, positives: Points, reach_m: float, *, whole: bool = False) -> Slab | None:
        """The level part within reach of the clicks, `whole` with all that lies in its plane; None without one."""
        from scipy import ndimage

        params, size = tuned(Params), self.size_m
        reach = int(np.ceil(reach_m / size))
        votes: list[int] = []
        for point in positives:
            at = np.clip(np.floor((point - self.low) / size).astype(int), 0, np.array(self.labels.shape) - 1)
            block = self.labels[tuple(slice(max(k - reach, 0), k + reach + 1) for k in at)]
            votes += np.unique(block[block > 0]).tolist()
        if not votes:
            return None
        sizes, cells = np.bincount(self.labels.ravel()), np.floor((self.middles - self.low) / size).astype(int)
        own = self.labels[tuple(cells.T)] == max(set(votes), key=lambda vote: sizes[vote])
        system = np.column_stack([self.middles[own, :2], np.ones(own.sum())])
        plane = fit_linear(system, self.middles[own, 2], geman_mcclure, 0.01, rounds=15)[0]
        own = (own | whole) & (np.abs(self.middles[:, 2] - height_of(plane, self.middles)) < params.off_slab_m)
        plan = plan_of(self.middles[own], self.low, size, self.labels.shape[:2])
        if plan.sum() * size**2 < params.least_m2:
            return None
        pad = max(1, round(params.hidden_m / size))
        closed = ndimage.binary_closing(np.pad(plan, pad + 1), iterations=pad)[pad + 1 : -pad - 1, pad + 1 : -pad - 1]
        filled = ndimage.binary_fill_holes(closed)
        broad = ndimage.binary_opening(filled, iterations=max(1, pad // 2))  # without the rail of a chair drawn up to it
        return Slab(np.asarray(filled & ndimage.binary_dilation(broad, iterations=max(1, pad // 2))), plane)


def height_of(plane: np.ndarray, points: Points) -> np.ndarray:
    """Height of a nearly level plane (a, b, c) under points (..., 3): a x + b y + c."""
    return np.asarray(points[..., :2] @ plane[:2] + plane[2])


def level_cells(scene: Scene, low: Vector3, high: Vector3, size_m: float) -> Levels:
    """Level faces of the fused surface between two corners."""
    from scipy import ndimage

    parts = scene.parts
    faces = parts.faces_near((low + high) / 2, float(np.linalg.norm(high - low)) / 2)
    at = parts.middles[faces]
    at = at[(parts.normals[faces, 2] > tuned(Params).level_cos) & ((at > low) & (at < high)).all(axis=1)]
    filled = np.zeros(np.ceil((high - low) / size_m).astype(int) + 1, bool)
    filled[tuple(np.floor((at - low) / size_m).astype(int).T)] = True
    return Levels(low, size_m, np.asarray(ndimage.label(filled, np.ones((3, 3, 3)))[0]), at)


def plan_of(points: Points, low: Vector3, size_m: float, shape: tuple[int, ...]) -> np.ndarray:
    """Cells (x, y) of a plan that points lie in."""
    plan = np.zeros(shape, bool)
    plan[tuple(np.floor((points[:, :2] - low[:2]) / size_m).astype(int).T)] = True
    return plan


def arm_at(plan: np.ndarray, beside: np.ndarray, click: Vector3, low: np.ndarray, size: float, yaw_rad: float) -> np.ndarray:
    """Plan of the rectangle about the click that holds the most of a plan and the least beside it: one arm of an L.

    Cells of neither tell nothing: objects cover them.
    """
    turn = np.array([[np.cos(yaw_rad), -np.sin(yaw_rad)], [np.sin(yaw_rad), np.cos(yaw_rad)]])  # world_from_arm
    step = 2 * size
    half = int(np.ceil(np.linalg.norm(plan.shape) / 2))
    offsets = np.arange(-half, half + 1) * step
    grid = click[:2] + np.stack(np.meshgrid(offsets, offsets, indexing="ij"), axis=-1) @ turn.T
    cells = np.floor((grid - low[:2]) / size).astype(int)
    inside = ((cells >= 0) & (cells < plan.shape)).all(axis=-1)
    worth = np.where(plan, 1, np.where(beside, -1, 0))[tuple(np.where(inside[..., None], cells, 0).transpose(2, 0, 1))]
    sums = np.cumsum(np.where(inside, worth, 0), axis=0)
    best, arm = -np.inf, np.zeros((2, 2))
    for first in range(half + 1):
        rows = sums[half:] - (sums[first - 1] if first else 0)  # by the last row, from that of the click on
        before, after = np.cumsum(rows[:, half::-1], axis=1), np.cumsum(rows[:, half:], axis=1)
        total = before.max(axis=1) + after.max(axis=1) - rows[:, half]
        last = int(total.argmax())
        if total[last] > best:
            best = total[last]
            arm = np.array([[first - half, -before[last].argmax()], [last, after[last].argmax()]]) * step
    centres = low[:2] + (np.stack(np.meshgrid(*map(np.arange, plan.shape), indexing="ij"), axis=-1) + 0.5) * size
    at = (centres - click[:2]) @ turn
    tight, loose = (((at > arm[0] - margin) & (at < arm[1] + margin)).all(axis=-1) for margin in (0.0, step))
    return np.asarray(tight | (plan & loose))
