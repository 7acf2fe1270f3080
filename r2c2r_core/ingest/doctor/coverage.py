"""From how many sides, and from how near, the surface was filmed."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from r2c2r_core.arrays import Points
from r2c2r_core.geometry.visibility import look_up
from r2c2r_core.ingest.doctor.pairs import Views
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """How well a surface was filmed."""

    sample: int = param(3000, "count", "points of the surface that are asked", ge=1)
    apart_deg: float = param(10.0, "deg", "between directions that count as different")
    close_m: float = param(2.0, "m", "from which on a camera is too far for detail")
    behind: tuple[float, float] = param((0.04, 0.02), "m", "depth that still shows the point: at 0 m, and more for each metre")


class Cover(NamedTuple):
    """Shares of the seen surface."""

    from_three: float  # seen from three directions, 10 deg apart
    close: float  # seen from within 2 m


def cover(points_world: Points, views: Views) -> Cover:
    """How well the views cover points of the fused surface, each weighing the same."""
    points = points_world[:: max(1, len(points_world) // tuned(Params).sample)]
    if not len(points):
        return Cover(0.0, 0.0)
    seen, toward, distance = _sight(points, views)
    picked, count = np.zeros((len(points), 3, 3)), np.zeros(len(points), dtype=np.int64)
    cosine = np.cos(np.radians(tuned(Params).apart_deg))
    for view in range(len(views.position)):  # greedily: a direction counts when it is far from those counted
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
