"""Front from a rectangle drawn by a person: its edges are kept; mosaics give the handle and the frames' pose errors."""

from dataclasses import dataclass, replace

import cv2
import numpy as np

from r2c2r_core.arrays import Mask
from r2c2r_core.errors import ObjectNotSeen
from r2c2r_core.geometry.transforms import Rigid3, front_rotation
from r2c2r_core.model.capture import Frame
from r2c2r_core.model.inputs import DrawnFront, DrawnHandle
from r2c2r_core.model.rectangle import Rectangle3
from r2c2r_core.model.track import FrontPanel
from r2c2r_core.segment.fronts.found import FoundFront
from r2c2r_core.segment.fronts.front import Front, front_panel
from r2c2r_core.segment.mosaics.handles import GridHandle
from r2c2r_core.segment.mosaics.lines import gather, scored
from r2c2r_core.segment.mosaics.orthomosaic import Cell, PlaneGrid, choose_frames, frame_quality, make_tile
from r2c2r_core.segment.mosaics.relief import measure_relief
from r2c2r_core.segment.planes import PlaneRegion
from r2c2r_core.segment.protocol import SegmentConfig
from r2c2r_core.segment.runs.run import Run, run_on
from r2c2r_core.segment.scene import Scene
from r2c2r_core.tuning import param, tuned

_AROUND_M = 0.08  # margin around the rectangle: its neighbours' lines show the frames' pose errors
_SUPPORT_M = 0.02  # side of the region's cells


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of painted rectangles."""

    trim: float = param(0.05, "share", "Fraction of an outline beyond each edge: its corners are rounded, hands tremble")
    filled: float = param(0.85, "share", "Minimum fraction of its rectangle that a painted front fills: plants cut off some")


def drawn_front(drawn: DrawnFront, scene: Scene, config: SegmentConfig) -> Front:
    """Drawn rectangle on a grid of its own; `depth_m` is not known here. Raises ObjectNotSeen where no frame sees it."""
    corners = scene.capture.world_from_capture.apply(np.array(drawn.corners_capture))
    grid, cell = _grid_around(Rectangle3.from_corners(corners), config.cell_m)
    run = _run_of(grid, cell, scene, config.mosaic_frames)
    handle = _handle_on(drawn.handle, cell, grid.cell_m) if drawn.handle is not None else run.handles[0]
    return Front(run, cell, handle, 0.0)


def painted_front(mask: Mask, grid: PlaneGrid, frame: Frame, world_from_capture: Rigid3) -> DrawnFront | None:
    """Rectangle on a plane that a mask painted in a frame fills; None for another shape, and for one the image cuts off."""
    found, _ = cv2.findContours(mask.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    outline = max((part[:, 0] for part in found), key=cv2.contourArea, default=np.zeros((0, 2), int))
    params = tuned(Params)
    if len(outline) < 4 or (outline.min(axis=0) <= 0).any() or (outline.max(axis=0) >= np.array(mask.shape[::-1]) - 1).any():
        return None
    pixel_from_cell = grid.pixel_from_cell(frame, frame.rgb_camera)
    cells = cv2.perspectiveTransform((outline + 0.5)[None].astype(np.float64), np.linalg.inv(pixel_from_cell))[0]
    (left, top), (right, bottom) = np.quantile(cells, [params.trim, 1 - params.trim], axis=0)
    if cv2.contourArea(cells.astype(np.float32)) < params.filled * (right - left) * (bottom - top):
        return None
    corners = grid.rectangle(Cell(left, top, right, bottom)).corners
    return DrawnFront(corners_capture=tuple(map(tuple, world_from_capture.inverse.apply(corners).tolist())))


@dataclass(frozen=True, slots=True, eq=False)
class FoundDrawn(FoundFront):
    """A furniture front whose rectangle was drawn by a person."""

    def panel(self) -> FrontPanel | None:
        """Drawn rectangle, with full confidence, and its handle."""
        return replace(front_panel(self.front), confidence=1.0, edges=(), changes=(), seam=0.0)


def _grid_around(face: Rectangle3, cell_m: float) -> tuple[PlaneGrid, Cell]:
    """Grid whose axes are the rectangle's edges, and the rectangle on it."""
    pad, (half_w, half_h) = round(_AROUND_M / cell_m), face.half_m
    cell = Cell(pad, pad, pad + face.width_m / cell_m, pad + face.height_m / cell_m)
    grid = PlaneGrid(
        face.world_from_front,
        -half_w - pad * cell_m,
        half_h + pad * cell_m,
        cell_m,
        int(np.ceil(cell.right)) + pad,
        int(np.ceil(cell.bottom)) + pad,
    )
    return grid, cell


def _run_of(grid: PlaneGrid, cell: Cell, scene: Scene, frame_count: int) -> Run:
    """Run of one known panel, as `make_run` builds it."""
    region = _region(grid, cell)
    chosen = choose_frames(frame_quality(grid, region, scene), scene, frame_count)
    tiles = [tile for index in chosen if (tile := make_tile(grid, scene, index)) is not None]
    if not tiles:
        raise ObjectNotSeen(
            f"the drawn front is seen in 0 of {len(scene.frames)} frames, at least 1 expected",
            hint="draw it on the scanned surface",
        )
    relief = measure_relief(grid, scene, chosen)
    lines = [scored(tile, grid.cell_m) for tile in tiles]
    evidence = gather(lines, 0, grid.cell_m), gather(lines, 1, grid.cell_m)
    roll = float(np.arcsin(np.clip(grid.world_from_plane.rotation[2, 0], -1.0, 1.0)))
    return run_on(region, grid, roll, tiles, relief, evidence, (cell,))


def _region(grid: PlaneGrid, cell: Cell) -> PlaneRegion:
    """Rectangle as a plane observed everywhere, with level axes."""
    face = grid.rectangle(cell)
    rows, columns = (max(round(side / _SUPPORT_M), 1) for side in (face.height_m, face.width_m))
    return PlaneRegion(
        world_from_plane=Rigid3(front_rotation(grid.outward), grid.world_from_plane.translation),
        width_m=face.width_m,
        height_m=face.height_m,
        support=np.ones((rows, columns), bool),
        cell_m=_SUPPORT_M,
        area_m2=face.width_m * face.height_m,
    )


def _handle_on(handle: DrawnHandle | str, cell: Cell, cell_m: float) -> GridHandle | None:
    """Drawn handle on the grid; None where the person marked that there is none."""
    if not isinstance(handle, DrawnHandle):
        return None
    column, row = (cell.left + cell.right) / 2, (cell.top + cell.bottom) / 2
    return GridHandle(
        left=column + handle.left_m / cell_m,
        top=row - handle.top_m / cell_m,
        right=column + handle.right_m / cell_m,
        bottom=row - handle.bottom_m / cell_m,
        confidence=1.0,
        source="person",
    )
