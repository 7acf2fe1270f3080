"""Furniture run: one plane's orthomosaic, line evidence, panels and handles. Keyed by plane, never by click."""

from dataclasses import dataclass, field

import cv2
import numpy as np

from r2c2r_core.arrays import Image
from r2c2r_core.segment.mosaics.edge_odds import edge_odds, seam_odds
from r2c2r_core.segment.mosaics.handles import GridHandle, find_handles
from r2c2r_core.segment.mosaics.lines import Evidence, ScoredTile, find_roll, frame_slide, gather, scored
from r2c2r_core.segment.mosaics.orthomosaic import (
    STEP,
    Cell,
    PlaneGrid,
    Tile,
    blend,
    choose_frames,
    frame_quality,
    make_grid,
    make_tile,
    support_on,
)
from r2c2r_core.segment.mosaics.panel_net import PanelOdds
from r2c2r_core.segment.mosaics.relief import Relief, measure_relief
from r2c2r_core.segment.planes import PlaneRegion
from r2c2r_core.segment.runs.partition import Partitioner
from r2c2r_core.segment.scene import Scene
from r2c2r_core.tuning import param, tuned

STEADY_CELLS = 1.0  # slides below this are measurement noise: poses agree


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the preparation of a run."""

    allowed_m: float = param(0.08, "m", "Maximum distance of line evidence beyond the observed part of the plane")
    relief_frames: int = param(60, "count", "Maximum number of frames used for the relief", ge=1)


@dataclass(slots=True, eq=False)
class Run:
    """Everything computed once per plane. `slides` fills as frames are requested."""

    region: PlaneRegion
    grid: PlaneGrid
    roll_rad: float
    vertical: Evidence
    horizontal: Evidence
    mosaic: Image
    relief: Relief
    odds: PanelOdds  # of the network, lines and depth
    seen: np.ndarray  # grid cells the scan has depth for
    panes: np.ndarray  # grid cells of glass in a frame
    cells: tuple[Cell, ...]
    handles: tuple[GridHandle | None, ...]  # one a cell
    poses_agree: bool
    slides: dict[int, tuple[float, float]] = field(default_factory=dict)

    def cell_at(self, column: float, row: float) -> Cell | None:
        """Panel at a grid position."""
        return next((cell for cell in self.cells if cell.contains(column, row)), None)

    def slide_of(self, frame_index: int, scene: Scene) -> tuple[float, float]:
        """Shift (columns, rows) that aligns a frame's content with the mosaic: its pose error in the plane."""
        if self.poses_agree:
            return 0.0, 0.0
        if frame_index not in self.slides:
            tile = make_tile(self.grid, scene, frame_index)
            self.slides[frame_index] = (0.0, 0.0) if tile is None else self._measure(scored(tile, self.grid.cell_m))
        return self.slides[frame_index]

    def _measure(self, tile: ScoredTile) -> tuple[float, float]:
        return (
            frame_slide(tile, 0, self.grid.cell_m, self.vertical),
            frame_slide(tile, 1, self.grid.cell_m, self.horizontal),
        )


def make_run(region: PlaneRegion, scene: Scene, cell_m: float, frame_count: int, margin_m: float = 0.0) -> Run | None:
    """Run of a plane: warp, gather evidence, level the axes to the lines, cut; None where no frame shows it.

    `margin_m` extends the grid beyond the observed part of the plane.
    """
    params = tuned(Params)
    views = _Views(make_grid(region, cell_m, 0.0, margin_m), region, scene, margin_m)
    few = max(frame_count // 2, 4)
    if not views.tiles(few):
        return None
    roll = find_roll(*views.evidence(few))
    if roll != 0.0:
        views = _Views(make_grid(region, cell_m, roll, margin_m), region, scene, margin_m)
    grid, tiles = views.grid, [tile for tile, _ in views.tiles(frame_count)]
    if not tiles:
        return None
    relief = measure_relief(grid, scene, views.chosen(params.relief_frames))
    return run_on(region, grid, roll, tiles, relief, views.evidence(frame_count))


def run_on(
    region: PlaneRegion,
    grid: PlaneGrid,
    roll_rad: float,
    tiles: list[Tile],
    relief: Relief,
    lines: tuple[Evidence, Evidence],
    cells: tuple[Cell, ...] | None = None,
) -> Run:
    """Run from a plane's tiles, relief, and upright and level colour lines; cut into panels where no cells are given.

    Where poses agree, the tiles are not shifted; otherwise the mosaic uses the best half of them only: more would blur it.
    """
    poses_agree = bool(np.median([max(abs(tile.shift[0]), abs(tile.shift[1])) for tile in tiles]) <= STEADY_CELLS)
    if poses_agree:
        for tile in tiles:
            tile.shift = (0.0, 0.0)
    mosaic = blend(tiles if poses_agree else tiles[: max(len(tiles) // 2, 8)])
    odds = edge_odds(seam_odds(mosaic, relief), mosaic, relief, *lines)
    vertical, horizontal = (_with_edges(found, relief, axis, grid) for axis, found in enumerate(lines))
    if cells is None:
        cells = tuple(Partitioner(odds, grid.cell_m).divide(Cell(0, 0, grid.columns, grid.rows)))
    flags = relief.on_plane(), relief.glazed()
    seen, panes = (each.repeat(STEP, axis=0).repeat(STEP, axis=1)[: grid.rows, : grid.columns] for each in flags)
    handles = find_handles(odds, relief, cells)
    slides = {tile.frame_index: tile.shift for tile in tiles}
    levels = vertical, horizontal
    return Run(region, grid, roll_rad, *levels, mosaic, relief, odds, seen, panes, cells, handles, poses_agree, slides)


class _Views:
    """The frames that show a plane on its grid, best first; each is warped and scored at most once."""

    def __init__(self, grid: PlaneGrid, region: PlaneRegion, scene: Scene, margin_m: float) -> None:
        self.grid, self._scene = grid, scene
        self._quality = frame_quality(grid, region, scene)
        near = support_on(grid, region, tuned(Params).allowed_m + margin_m).astype(np.float32)
        self._allowed = cv2.blur(near, (3, 3)) > 0.5
        self._made: dict[int, ScoredTile | None] = {}

    def chosen(self, count: int) -> list[int]:
        """Indices of the frames that see the plane best, at most `count`."""
        return choose_frames(self._quality, self._scene, count)

    def tiles(self, count: int) -> list[ScoredTile]:
        """Scored tiles of the chosen frames that show enough."""
        return [tile for index in self.chosen(count) if (tile := self._tile(index)) is not None]

    def evidence(self, count: int) -> tuple[Evidence, Evidence]:
        """Evidence of vertical and of horizontal lines; sets the tiles' shifts."""
        tiles = self.tiles(count)
        return gather(tiles, 0, self.grid.cell_m), gather(tiles, 1, self.grid.cell_m)

    def _tile(self, frame_index: int) -> ScoredTile | None:
        if frame_index not in self._made:
            tile = make_tile(self.grid, self._scene, frame_index)
            self._made[frame_index] = None if tile is None else scored(tile, self.grid.cell_m, self._allowed)
        return self._made[frame_index]


def _with_edges(evidence: Evidence, relief: Relief, axis: int, grid: PlaneGrid) -> Evidence:
    """Colour evidence combined with the plane's own ends as depth shows them."""
    edges = np.maximum(*relief.edge_evidence(axis, evidence.block, grid.columns, grid.rows))[: len(evidence.score)]
    score = np.where(edges > 1, np.maximum(evidence.score, edges), evidence.score)
    return Evidence(score, evidence.known | (edges > 2), evidence.block, edges)
