"""Gaps in a front's rectangle that the sensor looks through: a wall beside an appliance has lines that mislead the cut."""

from dataclasses import dataclass, replace

import numpy as np

from r2c2r_core.arrays import Points
from r2c2r_core.geometry.visibility import look_up
from r2c2r_core.model.capture import Frame
from r2c2r_core.segment.fronts.front import Front
from r2c2r_core.segment.runs.orthomosaic import Cell
from r2c2r_core.segment.scene import Scene
from r2c2r_core.segment.viewpoints import best_views
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Gaps that the sensor looks through."""

    frames: int = param(16, "count", "that are looked at", ge=1)
    step_m: float = param(0.02, "m", "between places that are looked at", gt=0)
    behind_m: float = param(0.08, "m", "behind the front: depth went past it")
    open: float = param(
        0.85,
        "share",
        "of what was measured in a column or row",
        source="glass lies in a frame that returns light, a gap has none",
    )
    partly_open: float = param(0.5, "share", "of the line beside a gap")
    least_known: int = param(20, "count", "measurements of a line that tells")
    least_left: float = param(0.5, "share", "of the width or height: a rectangle that loses more was never the front")


def trimmed(front: Front, scene: Scene) -> Front:
    """The front's largest part between columns and rows that the frames measure past from end to end."""
    params = tuned(Params)
    grid, cell = front.run.grid, front.cell
    step = params.step_m / grid.cell_m
    columns, rows = np.arange(cell.left + step / 2, cell.right, step), np.arange(cell.top + step / 2, cell.bottom, step)
    if len(columns) < 4 or len(rows) < 4:
        return front
    at = np.stack(np.meshgrid(columns, rows, indexing="ij"), axis=-1)
    points = grid.points_at(at.reshape(-1, 2))
    known, through = np.zeros(len(points)), np.zeros(len(points))
    for frame in best_views(scene, points.mean(axis=0), params.frames):
        seen, past = looked_through(points, scene, frame)
        known += seen
        through += past
    of_known, of_through = known.reshape(at.shape[:2]), through.reshape(at.shape[:2])
    first_column, last_column = _solid_span(of_known.sum(axis=1), of_through.sum(axis=1))
    kept = slice(first_column, last_column + 1)
    first_row, last_row = _solid_span(of_known[kept].sum(axis=0), of_through[kept].sum(axis=0))
    left, right = _bounds(cell.left, cell.right, step, first_column, last_column, len(columns))
    top, bottom = _bounds(cell.top, cell.bottom, step, first_row, last_row, len(rows))
    if right - left < params.least_left * cell.width or bottom - top < params.least_left * cell.height:
        return front
    return replace(front, cell=Cell(left, top, right, bottom))


def looked_through(points: Points, scene: Scene, frame: Frame) -> tuple[np.ndarray, np.ndarray]:
    """Of each world point, whether a frame's sensor measured at it or behind it, and whether clearly behind it."""
    params = tuned(Params)
    z, seen, _ = look_up(points, frame.world_from_camera, frame.depth_camera, scene.depth(frame.index))
    return (seen > 0) & ~scene.noise.occluded(seen, z, params.behind_m), scene.noise.seen_through(seen, z, params.behind_m)


def _solid_span(known: np.ndarray, through: np.ndarray) -> tuple[int, int]:
    """The first and last line of the longest run without a gap; lines of which little is known are no gap."""
    params = tuned(Params)
    share = np.where(known < params.least_known, 0.0, through / np.maximum(known, 1))
    gaps = np.concatenate([[-1], np.flatnonzero(share > params.open), [len(share)]])
    longest = int(np.argmax(np.diff(gaps)))
    first, last = int(gaps[longest]) + 1, int(gaps[longest + 1]) - 1
    if last < first:
        return 0, len(share) - 1
    while first > 0 and first < last and share[first] > params.partly_open:
        first += 1
    while last < len(share) - 1 and last > first and share[last] > params.partly_open:
        last -= 1
    return first, last


def _bounds(low: float, high: float, step: float, first: int, last: int, count: int) -> tuple[float, float]:
    """Edges of the kept lines; an edge that lost none stays exactly where it was."""
    return (low if first == 0 else low + first * step), (high if last == count - 1 else low + (last + 1) * step)
