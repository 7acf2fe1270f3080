"""Orthomosaic of a vertical plane: every frame warped by a homography onto one metric grid, without occluders."""

from dataclasses import dataclass, field

import cv2
import numpy as np

from r2c2r_core.arrays import Image, Matrix3, Points, Vector3
from r2c2r_core.geometry.camera import Intrinsics, project, sample_nearest
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.capture import Frame
from r2c2r_core.model.rectangle import Rectangle3
from r2c2r_core.segment.planes import PlaneRegion
from r2c2r_core.segment.scene import Scene
from r2c2r_core.tuning import param, tuned

STEP = 2
"""Grid cells in a cell of the relief, and of the odds of edges: depth is coarser than colour."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the orthomosaic and of the choice of its frames."""

    pad_m: float = param(0.08, "m", "Margin around the observed part, so that its outer edges lie inside")
    border_share: float = param(
        0.004, "share", "Fraction of the image width left out at the border: tiles are shifted by pixels to align"
    )
    view_in_front_m: float = param(
        0.08,
        "m",
        "Minimum distance in front of the plane of an occluder that hides a part of it from a view",
        source="handles (5 cm) and the fused surface's error do not reach it",
    )
    in_front_m: float = param(0.05, "m", "Minimum distance in front of the plane of an occluder", source="handles are not")
    odd_lab: float = param(
        25.0, "grey", "Colour difference from the median of all frames at which a frame's weight falls to 1/e", gt=0
    )
    odd_weight: float = param(0.02, "share", "Fraction of its weight that a frame of another colour keeps", gt=0)
    least_cosine: float = param(0.12, "cosine", "Minimum cosine between the viewing direction and the plane's normal")
    past_m: float = param(
        0.1,
        "m",
        "Minimum distance of depth behind the plane to look past it: deeper than sunk panels, nearer than a unit's rear",
    )
    hole_m: float = param(0.2, "m", "Minimum side of the square hole that an opened front leaves", gt=0)
    across_m: float = param(0.08, "m", "Maximum width of a shelf's edge, or of objects on it, that splits such a hole", gt=0)
    about_m: float = param(0.04, "m", "Margin around a hole: the edges of a unit's boards, and a depth pixel")
    coarse_m: float = param(0.02, "m", "Cell size for the search for holes: depth is coarser than colour", gt=0)


@dataclass(frozen=True, slots=True, eq=False)
class PlaneGrid:
    """Square cells on a plane. Columns run along +x of `world_from_plane`, rows down along -z, from (left, top)."""

    world_from_plane: Rigid3
    left_m: float
    top_m: float
    cell_m: float
    columns: int
    rows: int

    @property
    def outward(self) -> Vector3:
        """Unit normal towards the room."""
        return -self.world_from_plane.rotation[:, 1]

    def cells_of(self, points_world: Points) -> np.ndarray:
        """Continuous (column, row) of world points, projected along the normal."""
        local = self.world_from_plane.inverse.apply(points_world)
        return np.stack([(local[:, 0] - self.left_m) / self.cell_m, (self.top_m - local[:, 2]) / self.cell_m], axis=1)

    def points_at(self, cells: np.ndarray, depth_m: float = 0.0) -> Points:
        """World points of continuous (column, row) positions (n, 2), `depth_m` behind the plane."""
        x = self.left_m + cells[:, 0] * self.cell_m
        z = self.top_m - cells[:, 1] * self.cell_m
        return self.world_from_plane.apply(np.stack([x, np.full(len(x), depth_m), z], axis=1))

    def rectangle(self, cell: "Cell", slide: tuple[float, float] = (0.0, 0.0)) -> Rectangle3:
        """Rectangle of a cell in the world, as a frame with that slide shows it."""
        middle = np.array([[(cell.left + cell.right) / 2 - slide[0], (cell.top + cell.bottom) / 2 - slide[1]]])
        place = Rigid3(self.world_from_plane.rotation, self.points_at(middle)[0])
        return Rectangle3(world_from_front=place, width_m=cell.width * self.cell_m, height_m=cell.height * self.cell_m)

    def pixel_from_cell(self, frame: Frame, camera: Intrinsics) -> Matrix3:
        """Homography from continuous cells to continuous pixels; its third row gives z in metres."""
        rotation = self.world_from_plane.rotation
        origin = self.world_from_plane.apply(np.array([self.left_m, 0.0, self.top_m]))
        world = np.column_stack([rotation[:, 0] * self.cell_m, -rotation[:, 2] * self.cell_m, origin])
        seen = frame.world_from_camera.inverse
        local = seen.rotation @ world
        local[:, 2] += seen.translation
        return camera.matrix @ local

    def in_photo(self, cells: Image, frame: Frame, slide: tuple[float, float]) -> Image:
        """Image of the grid's cells as a frame with that slide shows the plane; 0 beyond it."""
        camera, moved = frame.rgb_camera, np.array([[1, 0, -slide[0]], [0, 1, -slide[1]], [0, 0, 1]])
        homography = _for_opencv(self.pixel_from_cell(frame, camera) @ moved)
        return np.asarray(cv2.warpPerspective(cells, homography, (camera.width, camera.height)))


@dataclass(frozen=True, slots=True)
class Cell:
    """A rectangle of grid cells, edges at continuous positions (columns left..right, rows top..bottom)."""

    left: float
    top: float
    right: float
    bottom: float

    @property
    def width(self) -> float:
        """Width in grid cells."""
        return self.right - self.left

    @property
    def height(self) -> float:
        """Height in grid cells."""
        return self.bottom - self.top

    def contains(self, column: float, row: float) -> bool:
        """Whether a position lies inside."""
        return self.left <= column < self.right and self.top <= row < self.bottom


@dataclass(slots=True, eq=False)
class Tile:
    """One frame on the grid. `shift` (columns, rows) moves its content into alignment with the other frames."""

    frame_index: int
    lab: np.ndarray  # (rows, columns, 3) uint8
    weight: np.ndarray  # (rows, columns) float32, 0 where unseen or occluded
    shift: tuple[float, float] = field(default=(0.0, 0.0))


def make_grid(region: PlaneRegion, cell_m: float, roll_rad: float = 0.0, margin_m: float = 0.0) -> PlaneGrid:
    """Grid over a region and a margin, its axes rotated in the plane by `roll_rad` (positive lifts the right side)."""
    params = tuned(Params)
    c, s = np.cos(roll_rad), np.sin(roll_rad)
    turn = np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]])
    rotation = region.world_from_plane.rotation @ turn
    half_w = region.width_m / 2 * c + region.height_m / 2 * abs(s) + params.pad_m + margin_m
    half_h = region.height_m / 2 * c + region.width_m / 2 * abs(s) + params.pad_m + margin_m
    return PlaneGrid(
        Rigid3(rotation, region.world_from_plane.translation),
        -half_w,
        half_h,
        cell_m,
        int(2 * half_w / cell_m),
        int(2 * half_h / cell_m),
    )


def support_on(grid: PlaneGrid, region: PlaneRegion, reach_m: float) -> np.ndarray:
    """Mask of the grid cells (rows, columns) within `reach_m` of the observed part of the region."""
    step = 4
    column, row = np.meshgrid(np.arange(0, grid.columns, step) + step / 2, np.arange(0, grid.rows, step) + step / 2)
    points = grid.points_at(np.stack([column.ravel(), row.ravel()], axis=1))
    seen = region.supports(points, reach_m).reshape(row.shape).astype(np.uint8)
    return cv2.resize(seen, (grid.columns, grid.rows), interpolation=cv2.INTER_NEAREST) > 0


def frame_quality(grid: PlaneGrid, region: PlaneRegion, scene: Scene) -> np.ndarray:
    """Quality of each frame's view of each coarse part of a region (frames, parts): large, sharp, frontal is best; 0 unseen."""
    spacing = min(0.1, region.width_m / 2, region.height_m / 2) / grid.cell_m
    column, row = np.meshgrid(np.arange(spacing / 2, grid.columns, spacing), np.arange(spacing / 2, grid.rows, spacing))
    points = grid.points_at(np.stack([column.ravel(), row.ravel()], axis=1))
    points = points[region.supports(points, 0.03)]
    if len(points) == 0:
        return np.zeros((len(scene.frames), 0))
    return np.stack([_view_quality(points, grid, frame, scene) for frame in scene.frames])


def choose_frames(quality: np.ndarray, scene: Scene, count: int) -> list[int]:
    """Frames that together show a region best by their `frame_quality`, best first, so that any first few show all of it.

    Greedy maximisation of a submodular sum (Nemhauser 1978): a frame's gain on a part falls with what earlier ones show of it,
    and is relative to the best view of that part (else its worst seen end would get none); squared like the blend's weights.
    """
    seen = quality[:, quality.max(axis=0, initial=0.0) > 0]
    share, shown, chosen = (seen / seen.max(axis=0, initial=0.0)) ** 2, np.zeros(seen.shape[1]), list[int]()
    while len(chosen) < count:
        gains = np.log1p(share / (1 + shown)).sum(axis=1)
        gains[chosen] = 0.0
        best = int(np.argmax(gains))
        if gains[best] <= 0:
            break
        chosen.append(best)
        shown += share[best]
    return [scene.frames[i].index for i in chosen]


def _view_quality(points: Points, grid: PlaneGrid, frame: Frame, scene: Scene) -> np.ndarray:
    params = tuned(Params)
    to_camera = frame.world_from_camera.translation - points
    cosine = (to_camera @ grid.outward) / np.linalg.norm(to_camera, axis=1)
    height, width = scene.rendered_mm[frame.index].shape
    camera = frame.rgb_camera.resized(width, height)
    local = frame.world_from_camera.inverse.apply(points)
    uv, z = project(local, camera), local[:, 2]
    seen, _ = sample_nearest(scene.surface_depth(frame.index, (width, height)), uv)
    border = params.border_share * width
    inside = (z > 0.15) & (uv > border).all(axis=1) & (uv < [width - border, height - border]).all(axis=1)
    good = inside & (cosine > params.least_cosine) & ~scene.noise.occluded(seen, z, params.view_in_front_m)
    column, row = np.floor(grid.cells_of(points)).astype(int).T.clip(0, [[grid.columns - 1], [grid.rows - 1]])
    good &= ~opened_cells(grid, scene, frame)[row, column]
    return np.where(good, cosine * np.sqrt(max(frame.sharpness, 1e-3)) / np.maximum(z, 0.4), 0)


def make_tile(grid: PlaneGrid, scene: Scene, frame_index: int) -> Tile | None:
    """Tile of one frame warped onto the grid; None when it shows too little of it."""
    frame = scene.frame(frame_index)
    if (frame.world_from_camera.translation - grid.world_from_plane.translation) @ grid.outward < 0.05:
        return None
    visible, z = visible_cells(grid, scene, frame)
    if visible.mean() < 0.02:
        return None
    homography = grid.pixel_from_cell(frame, frame.rgb_camera)
    image = cv2.warpPerspective(
        scene.rgb(frame_index),
        _for_opencv(homography),
        (grid.columns, grid.rows),
        flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
    )
    density = np.minimum(frame.rgb_camera.fx * grid.cell_m / np.maximum(z, 0.2), 1.0)
    weight = np.where(visible, density**2 * np.sqrt(max(frame.sharpness, 1e-3)), 0).astype(np.float32)
    return Tile(frame_index, cv2.cvtColor(image, cv2.COLOR_RGB2LAB), weight)


def visible_cells(grid: PlaneGrid, scene: Scene, frame: Frame) -> tuple[np.ndarray, np.ndarray]:
    """Mask of the cells (rows, columns) in the image without an occluder in front, and the plane's z-depth there."""
    column, row = np.arange(grid.columns) + 0.5, np.arange(grid.rows) + 0.5
    homography = grid.pixel_from_cell(frame, frame.rgb_camera)
    z, u, v = (
        (homography[k, 0] * column).astype(np.float32) + (homography[k, 1] * row + homography[k, 2]).astype(np.float32)[:, None]
        for k in (2, 0, 1)
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        u, v = u / z, v / z
    camera = frame.rgb_camera
    inside = (z > 0.15) & (u > 3) & (v > 3) & (u < camera.width - 3) & (v < camera.height - 3)
    depth = scene.filled_depth(frame.index)
    flags = cv2.INTER_NEAREST | cv2.WARP_INVERSE_MAP
    to_depth = grid.pixel_from_cell(frame, frame.depth_camera)
    seen = cv2.warpPerspective(depth, _for_opencv(to_depth), (grid.columns, grid.rows), flags=flags)
    occluded = scene.noise.occluded(seen, z, tuned(Params).in_front_m)
    grown = cv2.dilate(occluded.astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
    return inside & ~grown & ~opened_cells(grid, scene, frame), z


def opened_cells(grid: PlaneGrid, scene: Scene, frame: Frame) -> np.ndarray:
    """Mask of the cells (rows, columns) at which a frame looks past a plane of the scan: a front stands open there.

    Glass, which all frames look past, is no plane of the scan; gaps and stray readings are smaller than a front.
    """
    params = tuned(Params)
    size = np.ceil(np.array([grid.columns, grid.rows]) * grid.cell_m / params.coarse_m).astype(int)
    coarse = PlaneGrid(grid.world_from_plane, grid.left_m, grid.top_m, params.coarse_m, *size.tolist())
    homography = coarse.pixel_from_cell(frame, frame.depth_camera)
    z = (
        homography[2, 0] * (np.arange(size[0]) + 0.5)
        + (homography[2, 1] * (np.arange(size[1]) + 0.5) + homography[2, 2])[:, None]
    )
    sensor = scene.depth(frame.index)
    scan = scene.surface_depth(frame.index, (sensor.shape[1], sensor.shape[0]))
    flags = cv2.INTER_NEAREST | cv2.WARP_INVERSE_MAP
    measured, known = (
        cv2.warpPerspective(depth, _for_opencv(homography), size.tolist(), flags=flags) for depth in (sensor, scan)
    )
    past = (z > 0.15) & scene.noise.seen_through(measured, z, params.past_m)
    past &= (known > 0) & ~scene.noise.seen_through(known, z, params.past_m)
    hole = past.astype(np.uint8)
    for operation, side_m in (
        (cv2.MORPH_CLOSE, params.across_m),
        (cv2.MORPH_OPEN, params.hole_m),
        (cv2.MORPH_DILATE, 2 * params.about_m),
    ):
        side = 2 * round(side_m / params.coarse_m / 2) + 1
        hole = cv2.morphologyEx(hole, operation, np.ones((side, side), np.uint8))
    row, column = ((np.arange(count) * grid.cell_m / params.coarse_m).astype(int) for count in (grid.rows, grid.columns))
    return np.asarray(hole[row[:, None], column] > 0)


def blend(tiles: list[Tile]) -> Image:
    """RGB mosaic of tiles, each moved by its own shift; colours that few tiles show get little weight.

    A drawer that is open in some frames, or a passing object, must not leave a shade on the mosaic.
    """
    params, usual = tuned(Params), _usual(tiles)
    total = np.zeros((*tiles[0].weight.shape, 3), np.float32)
    weights = np.zeros(tiles[0].weight.shape, np.float32)
    for tile in tiles:
        colour, weight = _moved(tile)
        lab = colour.astype(np.float32)
        lightness, a, b = cv2.split(cv2.absdiff(lab, usual))
        off = cv2.max(lightness, cv2.max(a, b))
        weight = weight * (params.odd_weight + np.exp(-((off / params.odd_lab) ** 2)))
        total += cv2.multiply(lab, cv2.merge([weight] * 3))
        weights += weight
    lab = (total / np.maximum(weights, 1e-9)[..., None]).clip(0, 255).astype(np.uint8)
    image = cv2.cvtColor(lab, cv2.COLOR_LAB2RGB)
    image[weights == 0] = 0
    return np.asarray(image, dtype=np.uint8)


def _moved(tile: Tile) -> tuple[np.ndarray, np.ndarray]:
    """Colour and mosaic weight of a tile, moved by its shift."""
    if tile.shift == (0.0, 0.0):
        return tile.lab, tile.weight**2
    move = np.array([[1, 0, tile.shift[0]], [0, 1, tile.shift[1]]], np.float32)
    size = (tile.weight.shape[1], tile.weight.shape[0])
    return cv2.warpAffine(tile.lab, move, size), cv2.warpAffine(tile.weight, move, size) ** 2


def _usual(tiles: list[Tile]) -> np.ndarray:
    """Median colour (rows, columns, 3) over the tiles that show a cell, at a resolution of STEP cells."""
    thinned = [[array[::STEP, ::STEP].copy() for array in _moved(tile)] for tile in tiles]  # copied: a view keeps all of it
    coarse = np.stack([colour for colour, _ in thinned])
    shown = np.stack([weight for _, weight in thinned]) > 0
    coarse[~shown] = 255  # sorts behind all visible colours
    coarse.sort(axis=0)
    count = shown.sum(axis=0)
    pair = np.stack([np.maximum(count - 1, 0) // 2, np.minimum(count // 2, len(coarse) - 1)])
    middle = np.take_along_axis(coarse, pair[..., None], axis=0).astype(np.float32).mean(axis=0)
    middle[count == 0] = 0
    rows, columns = tiles[0].weight.shape
    return np.asarray(cv2.resize(middle, (columns, rows), interpolation=cv2.INTER_LINEAR))


def _for_opencv(pixel_from_cell: Matrix3) -> Matrix3:
    """Homography for OpenCV, whose cell and pixel centres are at integers; ours are at i + 0.5."""
    shift = np.array([[1, 0, 0.5], [0, 1, 0.5], [0, 0, 1]])
    back = np.array([[1, 0, -0.5], [0, 1, -0.5], [0, 0, 1]])
    return back @ pixel_from_cell @ shift


def joined(cells: list[Cell]) -> Cell:
    """Smallest rectangle around cells."""
    return Cell(
        min(c.left for c in cells), min(c.top for c in cells), max(c.right for c in cells), max(c.bottom for c in cells)
    )
