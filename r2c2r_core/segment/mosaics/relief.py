"""Height map over a plane: depth points of many frames, binned on its grid."""

from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np

from r2c2r_core.geometry.camera import depth_points, project
from r2c2r_core.model.capture import Frame
from r2c2r_core.segment.mosaics.orthomosaic import STEP, PlaneGrid
from r2c2r_core.segment.scene import Scene
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the relief."""

    deepest_m: float = param(0.04, "m", "Maximum distance behind the plane of points that are kept")
    raised_m: float = param(0.012, "m", "Minimum height of raised points, such as handles: above depth noise")
    highest_m: float = param(0.10, "m", "Maximum height of points that are kept: below objects in front of the plane")
    handle_thick_m: float = param(0.05, "m", "Maximum thickness of a handle, whose holes are closed")
    shadow_m: float = param(0.01, "m", "Distance beside a handle within which it hides the plane")
    ledge_m: float = param(0.035, "m", "Minimum width of a long raised part that is no handle")
    sunk_m: float = param(0.013, "m", "Maximum depth of the panel in a frame", source="shaker doors 6-10 mm, routed ones to 12")
    board_m: float = param(
        0.022, "m", "Distance between two fronts, one in front of the other", source="boards of 16-22 mm, and play between"
    )
    pane_m: float = param(
        0.08, "m", "Minimum side of a pane of glass", gt=0, source="panes of doors are 15 cm wide and more, channels 3 cm"
    )
    end_window_m: float = param(0.02, "m", "Length beyond an end of the plane without points of it")


class Edges(NamedTuple):
    """Edges of a plane as depth shows them: z-scores 0..6, (blocks, positions)."""

    ends: np.ndarray
    within: np.ndarray  # where the plane may continue: it steps back, or a frame's panel is sunk as deep; or glass begins


@dataclass(frozen=True, slots=True, eq=False)
class Relief:
    """Depth statistics on grid cells of `cell_m`: number of points, the fraction that is raised, and their mean heights."""

    cell_m: float
    count: np.ndarray
    raised: np.ndarray  # 0..1
    lift_m: np.ndarray  # mean of the raised points; 0 where there are none
    level_m: np.ndarray  # mean of the points that are not raised: the panel itself

    def on_plane(self) -> np.ndarray:
        """Mask of the cells dense with points of the plane, unlike cells that rays reach only beside or behind it."""
        flat = _box_mean(self.count * (1 - self.raised), 2)
        around = _box_mean(flat, round(0.10 / self.cell_m))
        filled = ((flat > 0.4 * around) & (flat > 0.3)).astype(np.uint8)
        size = (
            2 * round(tuned(Params).handle_thick_m / self.cell_m / 2) + 1
        )  # handles leave holes: closed, without growing outwards
        element = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
        closed = cv2.morphologyEx(np.pad(filled, size), cv2.MORPH_CLOSE, element)[size:-size, size:-size]
        return np.asarray(cv2.medianBlur(closed, 5) > 0)

    def edge_evidence(self, axis: int, block: int, columns: int, rows: int) -> "Edges":
        """Ends and steps of the plane, as z-scores 0..6 on (blocks, positions) of the grid, like colour evidence."""
        params = tuned(Params)
        points = self.count * (1 - self.raised)
        framed = np.where(self.glazed(), np.median(points[points > 0]) if points.any() else 0.0, points)
        whole, flat, raised, depth = (
            self._blocks(_box_mean(values, 1), axis, block, columns, rows)
            for values in (framed, points, self.count * self.raised, points * self.level_m)
        )
        level = depth / np.maximum(flat, 1e-6)
        handle, shadow = (round(size_m / self.cell_m) * STEP for size_m in (params.handle_thick_m, params.shadow_m))
        reach = max(2, round(params.end_window_m / self.cell_m) * STEP)
        ends, panes = (
            _end_scores(*_behind_handles(density, raised, handle, shadow, reach), self.cell_m) for density in (whole, flat)
        )
        flat, _ = _behind_handles(flat, raised, handle, shadow, reach)
        # The surface continues farther back than the panel of a frame is mostly sunk: a door that slides in front of another.
        seen = [np.maximum(window, 1e-6) for window in _windows(flat, reach)]
        before, after = (window / n for window, n in zip(_windows(flat * level, reach), seen, strict=True))
        back = np.where(np.minimum(*seen) > 0.4 * _usual(flat), np.abs(after - before), 0)
        step = 6 * np.clip((back - params.sunk_m) / (params.board_m - params.sunk_m), 0, 1)
        return Edges(ends=_widened(ends, reach), within=_widened([*panes, (step, back)], reach))

    def glazed(self) -> np.ndarray:
        """Mask of the cells of enclosed holes in the plane as large as a pane: glass in a frame, or a niche."""
        params = tuned(Params)
        hole = (~self.on_plane()).astype(np.uint8)
        _, labels, stats, _ = cv2.connectedComponentsWithStats(hole, connectivity=4)
        left, top, wide, high = (
            stats[:, k] for k in (cv2.CC_STAT_LEFT, cv2.CC_STAT_TOP, cv2.CC_STAT_WIDTH, cv2.CC_STAT_HEIGHT)
        )
        rows, columns = hole.shape
        inner = (left > 0) & (top > 0) & (left + wide < columns) & (top + high < rows)
        pane = inner & (np.minimum(wide, high) * self.cell_m > params.pane_m)
        pane[0] = False
        return np.asarray(pane[labels])

    def _blocks(self, values: np.ndarray, axis: int, block: int, columns: int, rows: int) -> np.ndarray:
        """Means over blocks of the grid, (blocks, positions)."""
        fine = cv2.resize(values.astype(np.float32), None, fx=STEP, fy=STEP, interpolation=cv2.INTER_LINEAR)
        fine = np.pad(fine, ((0, max(rows - fine.shape[0], 0)), (0, max(columns - fine.shape[1], 0))))[:rows, :columns]
        if axis == 1:
            fine = fine.T
        count = max(1, fine.shape[0] // block)
        means = fine[: count * block].reshape(count, -1, fine.shape[1]).mean(axis=1)
        return np.asarray(cv2.blur(means, (1, 3), borderType=cv2.BORDER_REPLICATE))


def measure_relief(grid: PlaneGrid, scene: Scene, frame_indices: list[int]) -> Relief:
    """Relief of a plane on cells of STEP grid cells."""
    params = tuned(Params)
    step = STEP
    shape = (grid.rows // step + 1, grid.columns // step + 1)
    size = shape[0] * shape[1]
    count, raised, lifts, level = np.zeros(size), np.zeros(size), np.zeros(size), np.zeros(size)
    for index in frame_indices:
        frame = scene.frame(index)
        depth = scene.depth(index)
        near_grid = _window(grid, frame, params)
        known = np.zeros(depth.shape, bool)
        known[near_grid] = depth[near_grid] > 0
        points = depth_points(depth, frame.depth_camera)[known].astype(np.float64)
        local = (grid.world_from_plane.inverse @ frame.world_from_camera).apply(points)
        lift = -local[:, 1]
        column = np.floor((local[:, 0] - grid.left_m) / (grid.cell_m * step)).astype(int)
        row = np.floor((grid.top_m - local[:, 2]) / (grid.cell_m * step)).astype(int)
        near = (lift > -params.deepest_m) & (lift < params.highest_m)
        near &= (column >= 0) & (row >= 0) & (column < shape[1]) & (row < shape[0])
        cell, lift = row[near] * shape[1] + column[near], lift[near]
        high = lift > params.raised_m
        count += np.bincount(cell, minlength=size)
        raised += np.bincount(cell[high], minlength=size)
        lifts += np.bincount(cell[high], lift[high], minlength=size)
        level += np.bincount(cell[~high], lift[~high], minlength=size)
    return Relief(
        grid.cell_m * step,
        count.reshape(shape),
        (raised / np.maximum(count, 1)).reshape(shape),
        (lifts / np.maximum(raised, 1)).reshape(shape),
        (level / np.maximum(count - raised, 1)).reshape(shape),
    )


def _window(grid: PlaneGrid, frame: Frame, params: Params) -> tuple[slice, slice]:
    """Rows and columns of a frame's depth image in which the space kept around a grid may be visible."""
    camera, ends = frame.depth_camera, np.array([(x, y) for x in (0, grid.columns + STEP) for y in (0, grid.rows + STEP)])
    corners = np.concatenate([grid.points_at(ends, depth) for depth in (-params.highest_m, params.deepest_m)])
    local = frame.world_from_camera.inverse.apply(corners)
    if local[:, 2].min() < 0.05:
        return slice(None), slice(None)
    low, high = (limit(project(local, camera), axis=0) for limit in (np.min, np.max))
    (left, top), (right, bottom) = (
        np.clip(edge, 0, (camera.width, camera.height)).astype(int) for edge in (np.floor(low) - 1, np.ceil(high) + 1)
    )
    return slice(top, bottom), slice(left, right)


def _windows(values: np.ndarray, reach: int) -> tuple[np.ndarray, np.ndarray]:
    """Means of the `reach` positions up to, and from, each position."""
    window = np.ones((1, reach), np.float32) / reach
    return (
        cv2.filter2D(values, -1, window, anchor=(reach - 1, 0), borderType=cv2.BORDER_CONSTANT),
        cv2.filter2D(values, -1, window, anchor=(0, 0), borderType=cv2.BORDER_CONSTANT),
    )


def _end_scores(flat: np.ndarray, raised: np.ndarray, cell_m: float) -> list[tuple[np.ndarray, np.ndarray]]:
    """Scores (0..6) and sharpness of the plane's end at each position, per kind of evidence."""
    params, usual = tuned(Params), _usual(flat)
    reach = max(2, round(params.end_window_m / cell_m) * STEP)
    # The plane ends, or all surface near it: beside the end of a door with its handle there, little of the plane is left.
    found = [_ends(density, usual, reach) for density in (flat, flat + raised)]
    # Or something broader than a handle protrudes beyond the line: a worktop's edge, a refrigerator.
    share = raised / np.maximum(flat + raised, 0.05)
    ledge = _windows(share, round(params.ledge_m / cell_m) * STEP)
    beside = _windows(share, reach)
    rise = np.maximum(ledge[0] - beside[1], ledge[1] - beside[0])
    return [*found, (6 * np.clip((rise - 0.5) / 0.2, 0, 1), rise)]


def _usual(flat: np.ndarray) -> float:
    """Usual density of points on the plane."""
    return float(np.median(flat[flat > 0.2])) if (flat > 0.2).any() else 1.0


def _ends(density: np.ndarray, usual: float, reach: int) -> tuple[np.ndarray, np.ndarray]:
    """Score (0..6) and sharpness of the end of points at each position."""
    before, after = _windows(density, reach)
    high, low = np.maximum(before, after), np.minimum(before, after)
    step = np.where(high > max(0.4 * usual, 0.4), 1 - low / np.maximum(high, 1e-6), 0)
    return 6 * np.clip((step - 0.55) / 0.3, 0, 1), (high - low) / usual


def _widened(found: list[tuple[np.ndarray, np.ndarray]], reach: int) -> np.ndarray:
    """Maximum of the scores at their peaks, widened: ends deviate by a cell or two from block to block."""
    peaks = np.max([_at_peaks(score, sharp, reach) for score, sharp in found], axis=0)
    return np.asarray(cv2.dilate(peaks.astype(np.float32), np.ones((1, 5), np.uint8)))


def _at_peaks(score: np.ndarray, sharp: np.ndarray, reach: int) -> np.ndarray:
    """Non-maximum suppression of a score by sharpness, since the score is as high a centimetre beside."""
    score = score.copy()
    score[:, :reach] = score[:, -reach:] = 0
    sharp = np.where(score > 0, sharp, 0).astype(np.float32)
    return np.where(sharp >= cv2.dilate(sharp, np.ones((1, 2 * reach + 1), np.uint8)) - 1e-4, score, 0)


def _behind_handles(flat: np.ndarray, raised: np.ndarray, width: int, shadow: int, least: int) -> tuple[np.ndarray, np.ndarray]:
    """Both densities without handles (raised over less than `width` positions between parts of the plane) and their shadows.

    The plane continues behind a handle, for `least` positions or more; it ends at a worktop's edge.
    """
    element = np.ones((1, width | 1), np.uint8)
    flat, raised = flat.astype(np.float32), raised.astype(np.float32)
    panel = cv2.morphologyEx(flat, cv2.MORPH_OPEN, np.ones((1, least | 1), np.uint8))
    closed = np.maximum(flat, cv2.morphologyEx(panel, cv2.MORPH_CLOSE, element))
    narrow = np.minimum(raised - cv2.morphologyEx(raised, cv2.MORPH_OPEN, element), closed)
    handle = cv2.dilate(narrow, np.ones((1, 2 * shadow + 1), np.uint8)) > 0.5 * closed
    return np.where(handle, closed, flat), np.where(handle, raised - narrow, raised)


def _box_mean(values: np.ndarray, radius: int) -> np.ndarray:
    size = 2 * radius + 1
    return np.asarray(cv2.blur(values.astype(np.float32), (size, size)))
