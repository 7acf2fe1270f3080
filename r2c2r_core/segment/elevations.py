"""Elevations of a prepared capture: each plane drawn to scale, with its lines and cut panels, for a person to correct.

The only interface between the front editor and the runs; `Elevation` lists the data it needs.
"""

from collections.abc import Iterator

import numpy as np

from r2c2r_core.kitchen.walls import distances_behind
from r2c2r_core.model.capture import Wall
from r2c2r_core.model.elevation import Elevation, Lines
from r2c2r_core.segment.mosaics.lines import Evidence
from r2c2r_core.segment.mosaics.orthomosaic import Cell
from r2c2r_core.segment.prepared import PreparedCapture
from r2c2r_core.segment.runs.run import Run

_LEAST_SIDE_M = 0.3  # minimum side of a plane that is shown: a single front is as large
_WALL_M = 0.04  # maximum distance of a plane from a wall's to be the wall
_SEEN_SHARE = 0.5  # minimum fraction of a panel with depth
_CLEAR_Z = 6.0  # z-score of a line that is drawn as the clearest


def elevations(prepared: PreparedCapture) -> Iterator[Elevation]:
    """Elevations of large enough planes, the largest first; walls come last, without panels, since tiles are no fronts."""
    walls = prepared.scene.capture.room.walls
    large = [plane for plane in prepared.planes if min(plane.width_m, plane.height_m) >= _LEAST_SIDE_M]
    runs = [run for plane in large if (run := prepared.run_of(plane)) is not None]
    on_wall = {id(run): _is_wall(run, walls) for run in runs}
    for run in sorted(runs, key=lambda run: (on_wall[id(run)], -run.region.area_m2)):
        yield _elevation(run, prepared, () if on_wall[id(run)] else tuple(cell for cell in run.cells if _is_seen(cell, run)))


def _is_wall(run: Run, walls: tuple[Wall, ...]) -> bool:
    behind = distances_behind(walls, run.region.world_from_plane.translation, run.grid.outward)
    return any(abs(distance) < _WALL_M for distance in behind)


def _is_seen(cell: Cell, run: Run) -> bool:
    """Whether the scan has depth on most of a panel."""
    inside = run.seen[round(cell.top) : round(cell.bottom), round(cell.left) : round(cell.right)]
    return inside.size > 0 and bool(inside.mean() > _SEEN_SHARE)


def _elevation(run: Run, prepared: PreparedCapture, cells: tuple[Cell, ...]) -> Elevation:
    grid, capture_from_world = run.grid, prepared.scene.capture.world_from_capture.inverse
    corners_world = grid.points_at(np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]))
    corners = capture_from_world.apply(corners_world)
    return Elevation(
        picture=run.mosaic,
        cell_m=grid.cell_m,
        origin_capture=corners[0],
        right_capture=(corners[1] - corners[0]) / grid.cell_m,
        down_capture=(corners[2] - corners[0]) / grid.cell_m,
        top_m=float(corners_world[0, 2]),
        upright=_lines(run.vertical),
        level=_lines(run.horizontal),
        cells=tuple((cell.left, cell.top, cell.right, cell.bottom) for cell in cells),
    )


def _lines(evidence: Evidence) -> Lines:
    shares = np.clip(np.nan_to_num(evidence.score) / _CLEAR_Z, 0.0, 1.0)
    return Lines(clarity=np.round(255 * shares).astype(np.uint8), block=evidence.block)
