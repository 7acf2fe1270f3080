"""Handle detection on a placed mesh: surface that protrudes from its front."""

from dataclasses import dataclass

import numpy as np

from r2c2r_core.arrays import Vector3
from r2c2r_core.model.track import FrontHandle
from r2c2r_core.synthesize.surface import SurfaceSamples
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of handle detection."""

    stands_out_m: tuple[float, float] = param(
        (0.008, 0.10),
        "m",
        "Minimum and maximum protrusion of a handle",
        source="nearer is the front's own relief, farther is another object",
    )
    cell_m: float = param(0.02, "m", "Side of the cells whose connected components separate handles", gt=0)
    fewest_points: int = param(12, "count", "Minimum number of surface points of a handle")
    largest_share: float = param(0.35, "share", "Maximum fraction of the front that a handle covers: more is a second front")


def handle_of_mesh(samples: SurfaceSamples, world_from_axes: np.ndarray, low: Vector3, high: Vector3) -> FrontHandle | None:
    """The largest of `handles_of_mesh`."""
    return max(handles_of_mesh(samples, world_from_axes, low, high), key=_area, default=None)


def handles_of_mesh(
    samples: SurfaceSamples, world_from_axes: np.ndarray, low: Vector3, high: Vector3
) -> tuple[FrontHandle, ...]:
    """Each connected group of surface points in front of the front face, as a box in the front frame.

    `low` and `high` are the object's ends along the columns of `world_from_axes`, the front at low y.
    """
    params = tuned(Params)
    points = samples.points @ world_from_axes - np.array([(low[0] + high[0]) / 2, low[1], (low[2] + high[2]) / 2])
    half = (high - low) / 2
    out = -points[:, 1]
    near = (out > params.stands_out_m[0]) & (out < params.stands_out_m[1])
    near &= (np.abs(points[:, 0]) < half[0] + 0.01) & (np.abs(points[:, 2]) < half[2] + 0.01)
    boxes = [_box_of(group) for group in _groups(points[near]) if len(group) >= params.fewest_points]
    return tuple(box for box in boxes if _area(box) <= params.largest_share * 4 * half[0] * half[2])  # else a second front


def _box_of(group: np.ndarray) -> FrontHandle:
    return FrontHandle(
        left_m=float(group[:, 0].min()),
        right_m=float(group[:, 0].max()),
        bottom_m=float(group[:, 2].min()),
        top_m=float(group[:, 2].max()),
        protrusion_m=float(np.quantile(-group[:, 1], 0.95)),
        confidence=0.5,
        source="inferred",
        protrusion_source="inferred",
    )


def _area(handle: FrontHandle) -> float:
    return (handle.right_m - handle.left_m) * (handle.top_m - handle.bottom_m)


def _groups(points: np.ndarray) -> list[np.ndarray]:
    """The points of each 8-connected patch of 2 cm cells in the front plane."""
    from scipy.ndimage import label

    if len(points) == 0:
        return []
    cells = np.floor((points[:, [0, 2]] - points[:, [0, 2]].min(axis=0)) / tuned(Params).cell_m).astype(np.int64)
    grid = np.zeros(cells.max(axis=0) + 1, dtype=bool)
    grid[tuple(cells.T)] = True
    labels, count = label(grid, structure=np.ones((3, 3)))
    of_point = labels[tuple(cells.T)]
    return [points[of_point == number] for number in range(1, count + 1)]
