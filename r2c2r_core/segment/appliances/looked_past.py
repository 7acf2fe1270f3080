"""See-through depth at a front's plane: no appliance lies there, in spite of lines from shadows or tiles."""

from dataclasses import dataclass

import cv2
import numpy as np

from r2c2r_core.arrays import Mask
from r2c2r_core.geometry.visibility import look_up
from r2c2r_core.kitchen.category import Category
from r2c2r_core.segment.runs.run import Run
from r2c2r_core.segment.scene import Scene
from r2c2r_core.segment.viewpoints import best_views
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of see-through depth."""

    frames: int = param(8, "count", "Maximum number of frames checked: a click waits for them", ge=1)
    spacing_m: float = param(0.02, "m", "Distance between the places checked", gt=0)
    behind_m: float = param(
        0.06, "m", "Minimum distance of depth behind the plane, beyond the noise, for the sensor to have looked past it"
    )
    below_m: float = param(
        0.01, "m", "Minimum distance under the floor at which nothing can stand: beyond the error of the floor's height"
    )
    share: float = param(0.5, "share", "Minimum fraction of the frames observing a place that must look past it", gt=0, lt=1)


def looked_past(run: Run, scene: Scene, click: np.ndarray, kind: Category) -> Mask:
    """Mask of the grid cells that depth looks past, as far around a click (column, row) as such an appliance extends.

    Where the floor is known, cells under it count as looked past.
    """
    params, grid = tuned(Params), run.grid
    step = max(1, round(params.spacing_m / grid.cell_m))
    reach = np.array([kind.width.high, kind.height.high]) / grid.cell_m
    rows, columns = run.seen.shape
    low = np.clip(click - reach, 0, [columns, rows]).astype(int)
    high = np.clip(click + reach, 0, [columns, rows]).astype(int)
    past = np.zeros(run.seen.shape, bool)
    column, row = np.arange(low[0], high[0], step), np.arange(low[1], high[1], step)
    if not len(column) or not len(row):
        return past
    places = np.stack(np.meshgrid(column, row), axis=-1) + step / 2
    points = grid.points_at(places.reshape(-1, 2).astype(np.float64))
    known, through = np.zeros(len(points)), np.zeros(len(points))
    for frame in best_views(scene, grid.points_at(click[None])[0], params.frames)[: params.frames]:
        z, seen, _ = look_up(points, frame.world_from_camera, frame.depth_camera, scene.depth(frame.index))
        known += (seen > 0) & ~scene.noise.occluded(seen, z, params.behind_m)
        through += scene.noise.seen_through(seen, z, params.behind_m)
    below = points[:, 2] < -params.below_m if scene.capture.room.floor_found else np.zeros(len(points), bool)
    share = ((through > params.share * np.maximum(known, 1)) | below).reshape(places.shape[:2]).astype(np.uint8)
    size = (int(high[0] - low[0]), int(high[1] - low[1]))
    past[low[1] : high[1], low[0] : high[0]] = cv2.resize(share, size, interpolation=cv2.INTER_NEAREST) > 0
    return past
