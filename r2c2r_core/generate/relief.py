"""Relief of a flat front: handles, panels and mouldings, raised or recessed, as boxes with planar faces.

Everything here is in a `front`-like frame: +X right, +Y into the furniture, +Z up, the outer face at y = 0.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import cv2
import numpy as np

from r2c2r_core.arrays import Points, Vector3
from r2c2r_core.generate.evidence import View, masked_points
from r2c2r_core.generate.variation import Variation
from r2c2r_core.model.track import FrontHandle, FrontPanel
from r2c2r_core.tuning import param, tuned

BESIDE_HANDLE_M = 0.02  # where its own edge, shadow and errors of its place may show


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the relief of fronts."""

    overlap_m: float = param(0.002, "m", "Depth to which parts reach into the panel, so that the union is one solid")
    least_step_m: float = param(0.005, "m", "Minimum height of a step")
    least_area_m2: float = param(0.0012, "m²", "Minimum area of a step")
    deepest_step_m: float = param(0.04, "m", "Maximum plausible height of a step")
    border_m: float = param(0.015, "m", "Width of the margin along the front's edge in which steps are ignored")
    least_fill: float = param(0.75, "share", "Minimum fraction of its bounding rectangle that a step covers")
    sigmas: float = param(4.0, "σ", "Minimum height of a step in standard deviations of the height noise")
    hand_m: tuple[float, float] = param(
        (0.01, 0.09),
        "m",
        "Minimum and maximum protrusion of a handle",
        source="clearance that a hand needs, and what would obstruct passage",
    )


class BoxPart(NamedTuple):
    """An axis-aligned box in the front's frame."""

    low: Vector3
    high: Vector3


class HeightMap(NamedTuple):
    """Height of each cell above the front in metres (nan where unmeasured); row 0 is the bottom."""

    height_m: np.ndarray
    cell_m: float
    left_m: float
    bottom_m: float


class Relief(NamedTuple):
    """Raised and recessed parts of a front, and its handle as measured in depth."""

    raised: Sequence[BoxPart]
    sunk: Sequence[BoxPart]
    handle: FrontHandle | None


def measure_relief(front: FrontPanel, variation: Variation) -> Relief:
    """Relief of a front from the views of one draw, in the front's frame."""
    points = [front.world_from_front.inverse.apply(masked_points(v, variation.erosion_px)) for v in variation.views]
    footprint = _depth_footprint(variation.views, front.centre)
    heights = measure_heights(points, front.width_m, front.height_m, max(0.006, 1.5 * footprint))
    raised, sunk = find_steps(heights, front.handle)
    if front.handle is None:
        return Relief(raised, sunk, None)
    protrusion = float(np.clip(measured_protrusion(heights, front.handle, footprint), *tuned(Params).hand_m))
    return Relief(raised, sunk, replace(front.handle, protrusion_m=protrusion))


def measure_heights(views_points: Sequence[Points], width_m: float, height_m: float, cell_m: float) -> HeightMap:
    """Median height per cell over all views, each view first levelled to the face (its pose is off by millimetres)."""
    columns, rows = max(round(width_m / cell_m), 1), max(round(height_m / cell_m), 1)
    cells: list[np.ndarray] = []
    heights: list[np.ndarray] = []
    for points in views_points:
        inside = (np.abs(points[:, 0]) < width_m / 2) & (np.abs(points[:, 2]) < height_m / 2) & (np.abs(points[:, 1]) < 0.12)
        chosen = points[inside]
        if len(chosen) < 50:
            continue
        column = ((chosen[:, 0] + width_m / 2) / width_m * columns).astype(int)
        row = ((chosen[:, 2] + height_m / 2) / height_m * rows).astype(int)
        cells.append(np.clip(row, 0, rows - 1) * columns + np.clip(column, 0, columns - 1))
        heights.append(np.median(chosen[:, 1]) - chosen[:, 1])
    heights = _levelled_together(cells, heights, rows * columns)
    grid = np.full(rows * columns, np.nan)
    if cells:
        grid = _cell_medians(np.concatenate(cells), np.concatenate(heights), rows * columns)
        grid -= np.nanmedian(grid) if np.isfinite(grid).any() else 0.0
    return HeightMap(grid.reshape(rows, columns), cell_m, -width_m / 2, -height_m / 2)


def _levelled_together(cells: list[np.ndarray], heights: list[np.ndarray], count: int) -> list[np.ndarray]:
    """Each view's heights shifted to agree, cell by cell, with the mean of the views before it.

    A framed front has two levels of similar area, so the median of a single view may be either.
    """
    total, seen = np.zeros(count), np.zeros(count)
    levelled = []
    for cell, height in zip(cells, heights, strict=True):
        shared = seen[cell] > 0
        if shared.sum() > 20:
            height = height - np.median(height[shared] - total[cell[shared]] / seen[cell[shared]])
        np.add.at(total, cell, height)
        np.add.at(seen, cell, 1.0)
        levelled.append(height)
    return levelled


def _cell_medians(cell: np.ndarray, height: np.ndarray, count: int) -> np.ndarray:
    """Median height of each cell with at least three points; nan elsewhere."""
    grid = np.full(count, np.nan)
    order = np.lexsort((height, cell))
    occupied, first, points = np.unique(cell[order], return_index=True, return_counts=True)
    enough = points >= 3
    grid[occupied[enough]] = height[order][(first + points // 2)[enough]]
    return grid


def find_steps(heights: HeightMap, handle: FrontHandle | None) -> tuple[list[BoxPart], list[BoxPart]]:
    """Rectangles raised above and recessed below the outer face, where depth supports them beyond noise."""
    params = tuned(Params)
    z = _levelled_to_border(heights)
    known = np.isfinite(z)
    if known.mean() < 0.5:
        return [], []
    filled = np.where(known, z, 0.0).astype(np.float32)
    smooth = cv2.medianBlur(filled, 3)
    noise = 1.4826 * float(np.median(np.abs(filled - smooth)[known]))
    allowed = known & ~_handle_cells(heights, handle) & ~_border_cells(heights, params.border_m)
    raised: list[BoxPart] = []
    sunk: list[BoxPart] = []
    for sign, parts in ((1.0, raised), (-1.0, sunk)):
        strong = allowed & (sign * smooth > max(params.least_step_m, params.sigmas * noise))
        parts.extend(_step_boxes(heights, smooth, strong, sign))
    return raised, sunk


def handle_parts(handle: FrontHandle, *, as_bar: bool) -> list[BoxPart]:
    """A handle of the measured rectangle and protrusion: a bar on two posts, or a block where it is small or thin."""
    low = np.array([handle.left_m, -handle.protrusion_m, handle.bottom_m])
    high = np.array([handle.right_m, tuned(Params).overlap_m, handle.top_m])
    long, narrow = (2, 0) if handle.is_vertical else (0, 2)
    length, breadth = high[long] - low[long], high[narrow] - low[narrow]
    if not as_bar or length < 2.5 * breadth or handle.protrusion_m < 0.015:
        return [BoxPart(low, high)]
    bar_high = high.copy()
    bar_high[1] = low[1] + min(0.5 * handle.protrusion_m, max(breadth, 0.008))
    parts = [BoxPart(low, bar_high)]
    post = min(0.012, 0.15 * length)
    for start in (low[long] + 0.08 * length, high[long] - 0.08 * length - post):
        post_low, post_high = low.copy(), high.copy()
        post_low[long], post_high[long] = start, start + post
        post_low[narrow], post_high[narrow] = low[narrow] + 0.1 * breadth, high[narrow] - 0.1 * breadth
        post_low[1] = low[1] + 0.25 * (bar_high[1] - low[1])
        parts.append(BoxPart(post_low, post_high))
    return parts


def measured_protrusion(heights: HeightMap, handle: FrontHandle, footprint_m: float) -> float:
    """The handle's protrusion measured in depth, if depth pixels resolve it; else the track's value."""
    narrow = min(handle.right_m - handle.left_m, handle.top_m - handle.bottom_m)
    inside = heights.height_m[_handle_cells(heights, handle, grow_m=0.0) & np.isfinite(heights.height_m)]
    if footprint_m > narrow / 4 or len(inside) < 6:
        return handle.protrusion_m
    measured = float(np.percentile(inside, 80))
    return measured if 0.5 * handle.protrusion_m < measured < 2.0 * handle.protrusion_m else handle.protrusion_m


def _levelled_to_border(heights: HeightMap) -> np.ndarray:
    """Heights above the outer frame: on a framed front most cells lie on the recessed panel, so the median is not the face."""
    z = heights.height_m
    strip = _border_cells(heights, 0.05) & ~_border_cells(heights, tuned(Params).border_m) & np.isfinite(z)
    if strip.sum() < 20:
        return z
    level = float(np.median(z[strip]))
    return z - level if abs(level) > tuned(Params).least_step_m else z


def _step_boxes(heights: HeightMap, smooth: np.ndarray, strong: np.ndarray, sign: float) -> list[BoxPart]:
    """Connected regions that fill a rectangle at one level, as boxes."""
    params = tuned(Params)
    count, labels, stats, _ = cv2.connectedComponentsWithStats(strong.astype(np.uint8), connectivity=4)
    rows, columns = smooth.shape
    pitch_x, pitch_z = -2 * heights.left_m / columns, -2 * heights.bottom_m / rows
    boxes = []
    for label in range(1, count):
        region = labels == label
        left, bottom, width, height, area = (int(v) for v in stats[label])
        level = float(np.median(smooth[region]))
        spread = float(np.median(np.abs(smooth[region] - level)))
        if area * pitch_x * pitch_z < params.least_area_m2 or area < params.least_fill * width * height:
            continue
        if abs(level) > params.deepest_step_m or spread > 0.35 * abs(level):
            continue
        x0, z0 = heights.left_m + left * pitch_x, heights.bottom_m + bottom * pitch_z
        x1, z1 = x0 + width * pitch_x, z0 + height * pitch_z
        near, far = (-abs(level), params.overlap_m) if sign > 0 else (-0.01, abs(level))
        boxes.append(BoxPart(np.array([x0, near, z0]), np.array([x1, far, z1])))
    return boxes


def _cell_centres(heights: HeightMap) -> tuple[np.ndarray, np.ndarray]:
    rows, columns = heights.height_m.shape
    x = heights.left_m * (1 - 2 * (np.arange(columns) + 0.5) / columns)
    z = heights.bottom_m * (1 - 2 * (np.arange(rows) + 0.5) / rows)
    return x[None, :], z[:, None]


def _border_cells(heights: HeightMap, border_m: float) -> np.ndarray:
    x, z = _cell_centres(heights)
    return np.asarray((np.abs(x) > -heights.left_m - border_m) | (np.abs(z) > -heights.bottom_m - border_m))


def _handle_cells(heights: HeightMap, handle: FrontHandle | None, grow_m: float = BESIDE_HANDLE_M) -> np.ndarray:
    x, z = _cell_centres(heights)
    if handle is None:
        return np.zeros(heights.height_m.shape, dtype=bool)
    beside = (x > handle.left_m - grow_m) & (x < handle.right_m + grow_m)
    return np.asarray(beside & (z > handle.bottom_m - grow_m) & (z < handle.top_m + grow_m))


def _depth_footprint(views: Sequence[View], target_world: Vector3) -> float:
    """Size of a depth pixel on the object at the median distance, metres."""
    sizes = [float(np.linalg.norm(v.eye_world - target_world)) / v.depth_camera.fx for v in views]
    return float(np.median(sizes))
