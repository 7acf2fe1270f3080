"""Handle detection on panels: what stands out from the panel in relief and colour, and repeats over its siblings."""

from dataclasses import dataclass, replace

import cv2
import numpy as np

from r2c2r_core.arrays import Image
from r2c2r_core.segment.runs.orthomosaic import Cell
from r2c2r_core.segment.runs.relief import Relief

_LONGEST_M, _SHORTEST_M, _THICKEST_M = 0.9, 0.018, 0.055
_RIM_M = 0.010  # gaps and their shadows live here
_BACKGROUND_M = 0.12  # the panel's own colour is the median over this


@dataclass(frozen=True, slots=True, kw_only=True)
class GridHandle:
    """A handle in grid cells, with a confidence 0..1."""

    left: float
    top: float
    right: float
    bottom: float
    confidence: float
    protrusion_m: float = 0.0  # 0: not measured

    @property
    def width(self) -> float:
        """In grid cells."""
        return self.right - self.left

    @property
    def height(self) -> float:
        """In grid cells."""
        return self.bottom - self.top


def find_handles(mosaic: Image, relief: Relief, cells: tuple[Cell, ...], cell_m: float) -> tuple[GridHandle | None, ...]:
    """The likeliest handle of each panel: what stands out of it in depth, else what stands out in colour.

    A shape that its siblings carry too gains, one on its own loses a little.
    """
    proposals = [_raised_parts(relief, cell, cell_m) + _blobs(mosaic, cell, cell_m) for cell in cells]
    chosen: list[GridHandle | None] = []
    for i, own in enumerate(proposals):
        others = [blob for j, blobs in enumerate(proposals) if j != i for blob in blobs]
        rated = [replace(blob, confidence=_with_siblings(blob, others)) for blob in own]
        best = max(rated, key=lambda blob: (blob.confidence, -blob.left, -blob.top), default=None)
        chosen.append(best if best is not None and best.confidence > 0.22 else None)
    return tuple(chosen)


def _raised_parts(relief: Relief, cell: Cell, cell_m: float) -> list[GridHandle]:
    """Parts of a panel that depth saw standing out of it."""
    step = relief.cell_m / cell_m
    rim = round(_RIM_M / relief.cell_m)
    top, bottom = round(cell.top / step) + rim, round(cell.bottom / step) - rim
    left, right = round(cell.left / step) + rim, round(cell.right / step) - rim
    if bottom - top < 6 or right - left < 6:
        return []
    area = (slice(top, bottom), slice(left, right))
    seen = cv2.blur(relief.count[area].astype(np.float32), (3, 3))
    raised = cv2.blur((relief.raised * relief.count)[area].astype(np.float32), (3, 3)) / np.maximum(seen, 0.3)
    flat = cv2.blur((relief.count * (1 - relief.raised))[area].astype(np.float32), (3, 3))
    usual = float(np.median(flat))
    mask = cv2.morphologyEx((raised > 0.25).astype(np.uint8), cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask)
    found = []
    for label in range(1, count):
        x, y, width, height, size = stats[label].tolist()
        length, thickness = max(width, height) * relief.cell_m, min(width, height) * relief.cell_m
        spans = width > 0.9 * (right - left) or height > 0.9 * (bottom - top)
        if size < 4 or not _SHORTEST_M < length < _LONGEST_M or thickness > 0.09 or (spans and (y == 0 or x == 0)):
            continue
        inside = labels == label
        weight = (relief.count * relief.raised)[area][inside]
        lift = float(np.average(relief.lift_m[area][inside], weights=weight)) if weight.sum() > 0 else 0.0
        strength = float(np.clip((raised[inside].mean() - 0.2) / 0.3, 0.3, 1)) * float(np.clip(weight.sum() / 12, 0.2, 1))
        ring = cv2.dilate(inside.astype(np.uint8), np.ones((7, 7), np.uint8)).astype(bool) & ~inside
        around = min(1.0, float((flat[ring] > 0.25 * usual).mean()) / 0.5)  # a handle has its panel around it
        place = _place_prior(x, y, width, height, mask.shape, relief.cell_m)
        found.append(
            GridHandle(
                left=(left + x) * step,
                top=(top + y) * step,
                right=(left + x + width) * step,
                bottom=(top + y + height) * step,
                protrusion_m=lift,
                confidence=0.98 * strength * around * (0.4 + 0.6 * place) * min(1.0, 0.5 + length / 0.06),
            )
        )
    return found


def _with_siblings(blob: GridHandle, others: list[GridHandle]) -> float:
    if not others:
        return blob.confidence
    similar = sorted((other.confidence for other in others if _same_shape(blob, other)), reverse=True)
    support = 1 - float(np.prod([1 - 0.5 * confidence for confidence in similar[:4]]))
    return float(min(0.98, blob.confidence * (0.6 + 0.7 * support)))


def _same_shape(a: GridHandle, b: GridHandle) -> bool:
    """Equal length and thickness, also when turned by a quarter (drawers and doors of one kitchen)."""
    first, second = sorted((a.width, a.height)), sorted((b.width, b.height))
    return abs(first[1] - second[1]) < 0.15 * max(first[1], second[1]) + 2 and abs(first[0] - second[0]) < 5


def _blobs(mosaic: Image, cell: Cell, cell_m: float) -> list[GridHandle]:
    rows, columns = slice(round(cell.top), round(cell.bottom)), slice(round(cell.left), round(cell.right))
    panel = mosaic[rows, columns]
    if min(panel.shape[:2]) * cell_m < 0.06:
        return []
    salience = _salience(panel, cell_m)
    found: list[GridHandle] = []
    for level in (12.0, 8.0, 5.0):
        found += _components(salience, level, panel.shape, cell_m)
    return [
        replace(
            blob,
            left=blob.left + columns.start,
            right=blob.right + columns.start,
            top=blob.top + rows.start,
            bottom=blob.bottom + rows.start,
        )
        for blob in found
    ]


def _salience(panel: Image, cell_m: float) -> np.ndarray:
    """Distance to the panel's local colour in units of its texture (robust deviations)."""
    lab = cv2.cvtColor(panel, cv2.COLOR_RGB2LAB)
    known = panel.any(axis=2)
    size = min(int(_BACKGROUND_M / cell_m) | 1, (min(panel.shape[:2]) - 1) | 1, 201)
    background = np.dstack([cv2.medianBlur(np.ascontiguousarray(lab[..., k]), size) for k in range(3)]).astype(np.float32)
    difference = np.linalg.norm((lab.astype(np.float32) - background) * [0.8, 1, 1], axis=2)
    difference = np.where(known, difference, 0)
    middle = np.median(difference[known]) if known.any() else 0.0
    spread = 1.4826 * np.median(np.abs(difference[known] - middle)) if known.any() else 0.0
    rim = max(1, round(_RIM_M / cell_m))
    inner = np.zeros_like(difference)
    inner[rim:-rim, rim:-rim] = difference[rim:-rim, rim:-rim]
    return inner / (spread + 1.0)


def _components(salience: np.ndarray, level: float, shape: tuple[int, ...], cell_m: float) -> list[GridHandle]:
    mask = (salience > level).astype(np.uint8)
    mask = cv2.morphologyEx(mask, cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
    count, _, stats, _ = cv2.connectedComponentsWithStats(mask)
    found = []
    for left, top, width, height, area in stats[1:count].tolist():
        length, thickness = max(width, height) * cell_m, min(width, height) * cell_m
        if not (_SHORTEST_M < length < _LONGEST_M and 0.005 < thickness < _THICKEST_M):
            continue
        fill = area / (width * height)
        if fill < 0.35:
            continue
        shape_score = min(1.0, fill / 0.7) * _shape_prior(length, thickness)
        place_score = _place_prior(left, top, width, height, shape, cell_m)
        contrast = min(1.0, level / 12.0)
        confidence = 0.8 * (0.35 + 0.65 * contrast) * shape_score * place_score
        found.append(GridHandle(left=left, top=top, right=left + width, bottom=top + height, confidence=float(confidence)))
    return found


def _shape_prior(length_m: float, thickness_m: float) -> float:
    """Bars are long and thin; knobs are round and 2-5 cm."""
    if length_m / thickness_m > 3:
        return 1.0 if length_m > 0.06 else 0.6
    knob = length_m / thickness_m < 1.7 and 0.018 < length_m < 0.055
    return 0.75 if knob else 0.4


def _place_prior(left: int, top: int, width: int, height: int, shape: tuple[int, ...], cell_m: float) -> float:
    """People put handles near an edge, or on the middle line; drawers carry them across the middle."""
    across, down = shape[1], shape[0]
    x, z = (left + width / 2) / across, (top + height / 2) / down
    centred_x, centred_z = abs(x - 0.5) < 0.06, abs(z - 0.5) < 0.08
    side = min(left, across - left - width) * cell_m
    end = min(top, down - top - height) * cell_m
    near_side, near_end = side < 0.10, end < 0.14
    if side < 0.014 or end < 0.014:  # on the rim: a seam's shadow rather than a handle
        return 0.6
    if height > width * 1.8:  # upright: beside an edge
        return 1.0 if near_side else 0.45
    if width > height * 1.8:  # lying: across the middle, or towards an edge
        return 1.0 if centred_x else 0.75 if near_end else 0.4
    return 1.0 if (centred_x or near_side) and (centred_z or near_end or centred_x) else 0.5
