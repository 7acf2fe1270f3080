"""Coverage of the surface: number of viewing directions and distance of the nearest camera."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from r2c2r_core.arrays import Points
from r2c2r_core.geometry.visibility import look_up
from r2c2r_core.ingest.doctor.pairs import Views
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of surface coverage."""

    sample: int = param(3000, "count", "Approximate number of surface points tested", ge=1)
    apart_deg: float = param(10.0, "deg", "Minimum angle between two viewing directions to count as different")
    close_m: float = param(2.0, "m", "Camera distance below which a point counts as seen from close")
    behind: tuple[float, float] = param(
        (0.04, 0.02), "m", "Depth tolerance for a point to be visible: at 0 m, and increase per metre"
    )


class Cover(NamedTuple):
    """Coverage as fractions of the visible surface."""

    from_three: float  # seen from three directions, 10 deg apart
    close: float  # seen from within 2 m


def cover(points_world: Points, views: Views) -> Cover:
    """Coverage of the fused surface's points by the views, with equal weights."""
    points = points_world[:: max(1, len(points_world) // tuned(Params).sample)]
    if not len(points):
        return Cover(0.0, 0.0)
    seen, toward, distance = _sight(points, views)
    picked, count = np.zeros((len(points), 3, 3)), np.zeros(len(points), dtype=np.int64)
    cosine = np.cos(np.radians(tuned(Params).apart_deg))
    for view in range(len(views.position)):  # greedily: a direction counts if it is far enough from those already counted
        new = seen[view] & (count < 3) & (np.einsum("nkd,nd->nk", picked, toward[view]).max(axis=1) < cosine)
        rows = np.flatnonzero(new)
        picked[rows, count[rows]] = toward[view, rows]
        count[rows] += 1
    anywhere = seen.any(axis=0)
    nearest = np.where(seen, distance, np.inf).min(axis=0)
    total = max(int(anywhere.sum()), 1)
    return Cover(float((count[anywhere] == 3).sum() / total), float((nearest[anywhere] < tuned(Params).close_m).sum() / total))


def _sight(points: Points, views: Views) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Whether each view sees each point (v, n), the unit directions to the camera (v, n, 3), and the distances."""
    least, more = tuned(Params).behind
    seen = np.zeros((len(views.position), len(points)), dtype=bool)
    for view, depth_m in enumerate(views.depth_m):
        z, measured, inside = look_up(points, views.world_from_camera(view), views.camera(view), depth_m)
        seen[view] = inside & (np.abs(measured - z) < least + more * z)
    offset = views.translation[:, None] - points[None]
    distance = np.linalg.norm(offset, axis=2)
    return seen, offset / np.maximum(distance, 1e-6)[..., None], distance
