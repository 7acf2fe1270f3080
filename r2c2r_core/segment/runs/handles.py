"""Handle detection on panels: what stands out from the panel in relief and colour, and repeats over its siblings."""

from dataclasses import dataclass, replace

import cv2
import numpy as np

from r2c2r_core.arrays import Image
from r2c2r_core.segment.runs.orthomosaic import Cell
from r2c2r_core.segment.runs.relief import Relief
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """What on a panel is its handle. Confidences are products of the shares below, each 1 for an ordinary handle."""

    least_confidence: float = param(0.22, "score", "0 to 1, of a handle", ge=0, le=1)
    longest_m: float = param(0.9, "m", "side of a handle")
    shortest_m: float = param(0.018, "m", "longer side of a handle")
    thickest_m: float = param(0.055, "m", "shorter side of a handle that only colour shows")
    thickest_raised_m: float = param(0.09, "m", "shorter side of a handle that depth shows, which is coarser")
    thinnest_m: float = param(0.005, "m", "shorter side of a handle that only colour shows")
    rim_m: float = param(0.010, "m", "along a panel's edge: gaps and their shadows live here")
    background_m: float = param(0.12, "m", "over which the median colour is the panel's own")
    # in depth
    least_inside_m: float = param(0.03, "m", "of a panel within its rims")
    raised_share: float = param(0.25, "share", "of depth points over a cell that stand out, from where it is raised")
    least_area_m2: float = param(1e-4, "m²", "of a raised part")
    spans: float = param(0.9, "share", "of the panel that a raised part at its edge may reach across")
    unsure_raised: float = param(0.2, "share", "of its points standing out that says nothing for a part")
    sure_raised: float = param(0.5, "share", "of its points standing out that says all for a part")
    enough_points: float = param(12.0, "count", "points standing out that say all for a part", gt=0)
    ring_m: float = param(0.015, "m", "around a part, where its panel must be")
    around_share: float = param(0.25, "ratio", "to the panel's usual depth points, of a cell that is panel")
    around_enough: float = param(0.5, "share", "of the ring that is panel and says all for a part", gt=0)
    least_place: float = param(0.4, "share", "of its confidence that a part keeps at the oddest place")
    half_sure_m: float = param(0.06, "m", "twice the length from which it says all for a part", gt=0)
    surest: float = param(0.98, "score", "confidence, 0 to 1, at most", ge=0, le=1)
    # beside its siblings
    alone: float = param(0.6, "ratio", "of its confidence that a handle without siblings keeps")
    with_siblings: float = param(0.7, "ratio", "of its confidence that siblings of its shape add")
    sibling_worth: float = param(0.5, "share", "of a sibling's confidence that counts")
    siblings: int = param(4, "count", "siblings that count")
    same_length: float = param(0.15, "share", "of their length by which siblings may differ")
    same_length_m: float = param(0.005, "m", "by which their length may differ besides")
    same_thickness_m: float = param(0.0125, "m", "by which their thickness may differ")
    # in colour
    least_panel_m: float = param(0.06, "m", "side of a panel in which colour is looked at")
    levels: tuple[float, float, float] = param((12.0, 8.0, 5.0), "σ", "robust, from the panel's own colour")
    lightness_weight: float = param(0.8, "ratio", "of a difference in lightness to one in hue")
    least_fill: float = param(0.35, "share", "of its rectangle that a blob must fill")
    full: float = param(0.7, "share", "of its rectangle filled that says all for a blob", gt=0)
    by_colour: float = param(0.8, "score", "confidence, 0 to 1, of the clearest blob", ge=0, le=1)
    least_contrast: float = param(0.35, "share", "of its confidence that a blob keeps without contrast")
    # by its shape
    bar: float = param(3.0, "ratio", "of length to thickness of a bar")
    short_bar_m: float = param(0.06, "m", "below it a bar is short")
    short_bar: float = param(0.6, "share", "of a bar's worth that a short one has")
    round_knob: float = param(1.7, "ratio", "of length to thickness of a knob")
    knob_m: tuple[float, float] = param((0.018, 0.055), "m", "least and most of a knob")
    knob: float = param(0.75, "share", "of a bar's worth that a knob has")
    odd: float = param(0.4, "share", "of a bar's worth that any other shape has")
    # by its place
    centred_x: float = param(0.06, "share", "of the width, from the middle, within which it is centred")
    centred_z: float = param(0.08, "share", "of the height, from the middle, within which it is centred")
    near_side_m: float = param(0.10, "m", "from a side")
    near_end_m: float = param(0.14, "m", "from the top or bottom")
    on_rim_m: float = param(0.014, "m", "from an edge: a seam's shadow rather than a handle")
    on_rim: float = param(0.6, "share", "of an ordinary place's worth on the rim")
    long: float = param(1.8, "ratio", "of the sides of a handle that stands or lies")
    standing_inside: float = param(0.45, "share", "of an ordinary place's worth, standing far from the sides")
    lying_off_centre: float = param(0.75, "share", "of an ordinary place's worth, lying near an end beside the middle")
    lying_inside: float = param(0.4, "share", "of an ordinary place's worth, lying anywhere else")
    anywhere: float = param(0.5, "share", "of an ordinary place's worth, of what neither stands nor lies")


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
    least = tuned(Params).least_confidence
    proposals = [_raised_parts(relief, cell, cell_m) + _blobs(mosaic, cell, cell_m) for cell in cells]
    chosen: list[GridHandle | None] = []
    for i, own in enumerate(proposals):
        others = [blob for j, blobs in enumerate(proposals) if j != i for blob in blobs]
        rated = [replace(blob, confidence=_with_siblings(blob, others, cell_m)) for blob in own]
        best = max(rated, key=lambda blob: (blob.confidence, -blob.left, -blob.top), default=None)
        chosen.append(best if best is not None and best.confidence > least else None)
    return tuple(chosen)


def _raised_parts(relief: Relief, cell: Cell, cell_m: float) -> list[GridHandle]:
    """Parts of a panel that depth saw standing out of it."""
    params = tuned(Params)
    step = relief.cell_m / cell_m
    rim = round(params.rim_m / relief.cell_m)
    top, bottom = round(cell.top / step) + rim, round(cell.bottom / step) - rim
    left, right = round(cell.left / step) + rim, round(cell.right / step) - rim
    if min(bottom - top, right - left) < round(params.least_inside_m / relief.cell_m):
        return []
    area = (slice(top, bottom), slice(left, right))
    seen = cv2.blur(relief.count[area].astype(np.float32), (3, 3))
    raised = cv2.blur((relief.raised * relief.count)[area].astype(np.float32), (3, 3)) / np.maximum(seen, 0.3)
    flat = cv2.blur((relief.count * (1 - relief.raised))[area].astype(np.float32), (3, 3))
    usual = float(np.median(flat))
    mask = cv2.morphologyEx((raised > params.raised_share).astype(np.uint8), cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask)
    smallest, around_px = round(params.least_area_m2 / relief.cell_m**2), 2 * round(params.ring_m / relief.cell_m) + 1
    found = []
    for label in range(1, count):
        x, y, width, height, size = stats[label].tolist()
        length, thickness = max(width, height) * relief.cell_m, min(width, height) * relief.cell_m
        spans = width > params.spans * (right - left) or height > params.spans * (bottom - top)
        possible = params.shortest_m < length < params.longest_m and thickness <= params.thickest_raised_m
        if size < smallest or not possible or (spans and (y == 0 or x == 0)):
            continue
        inside = labels == label
        weight = (relief.count * relief.raised)[area][inside]
        lift = float(np.average(relief.lift_m[area][inside], weights=weight)) if weight.sum() > 0 else 0.0
        strength = _strength(float(raised[inside].mean()), float(weight.sum()), params)
        ring = cv2.dilate(inside.astype(np.uint8), np.ones((around_px, around_px), np.uint8)).astype(bool) & ~inside
        around = min(
            1.0, float((flat[ring] > params.around_share * usual).mean()) / params.around_enough
        )  # a handle has its panel around it
        place = _place_prior(x, y, width, height, mask.shape, relief.cell_m)
        found.append(
            GridHandle(
                left=(left + x) * step,
                top=(top + y) * step,
                right=(left + x + width) * step,
                bottom=(top + y + height) * step,
                protrusion_m=lift,
                confidence=params.surest
                * strength
                * around
                * (params.least_place + (1 - params.least_place) * place)
                * min(1.0, 0.5 + length / params.half_sure_m),
            )
        )
    return found


def _strength(raised: float, points: float, params: Params) -> float:
    """How clearly a part stands out: by the share of its depth points that do, and by their number."""
    share = (raised - params.unsure_raised) / (params.sure_raised - params.unsure_raised)
    return float(np.clip(share, 0.3, 1)) * float(np.clip(points / params.enough_points, 0.2, 1))


def _with_siblings(blob: GridHandle, others: list[GridHandle], cell_m: float) -> float:
    params = tuned(Params)
    if not others:
        return blob.confidence
    similar = sorted((other.confidence for other in others if _same_shape(blob, other, cell_m)), reverse=True)
    support = 1 - float(np.prod([1 - params.sibling_worth * confidence for confidence in similar[: params.siblings]]))
    return float(min(params.surest, blob.confidence * (params.alone + params.with_siblings * support)))


def _same_shape(a: GridHandle, b: GridHandle, cell_m: float) -> bool:
    """Equal length and thickness, also when turned by a quarter (drawers and doors of one kitchen)."""
    params = tuned(Params)
    first, second = sorted((a.width, a.height)), sorted((b.width, b.height))
    length = params.same_length * max(first[1], second[1]) + params.same_length_m / cell_m
    return abs(first[1] - second[1]) < length and abs(first[0] - second[0]) < params.same_thickness_m / cell_m


def _blobs(mosaic: Image, cell: Cell, cell_m: float) -> list[GridHandle]:
    params = tuned(Params)
    rows, columns = slice(round(cell.top), round(cell.bottom)), slice(round(cell.left), round(cell.right))
    panel = mosaic[rows, columns]
    if min(panel.shape[:2]) * cell_m < params.least_panel_m:
        return []
    salience = _salience(panel, cell_m)
    found: list[GridHandle] = []
    for level in params.levels:
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
    params = tuned(Params)
    lab = cv2.cvtColor(panel, cv2.COLOR_RGB2LAB)
    known = panel.any(axis=2)
    size = min(int(params.background_m / cell_m) | 1, (min(panel.shape[:2]) - 1) | 1, 201)
    background = np.dstack([cv2.medianBlur(np.ascontiguousarray(lab[..., k]), size) for k in range(3)]).astype(np.float32)
    difference = np.linalg.norm((lab.astype(np.float32) - background) * [params.lightness_weight, 1, 1], axis=2)
    difference = np.where(known, difference, 0)
    middle = np.median(difference[known]) if known.any() else 0.0
    spread = 1.4826 * np.median(np.abs(difference[known] - middle)) if known.any() else 0.0
    rim = max(1, round(params.rim_m / cell_m))
    inner = np.zeros_like(difference)
    inner[rim:-rim, rim:-rim] = difference[rim:-rim, rim:-rim]
    return inner / (spread + 1.0)


def _components(salience: np.ndarray, level: float, shape: tuple[int, ...], cell_m: float) -> list[GridHandle]:
    params = tuned(Params)
    mask = (salience > level).astype(np.uint8)
    mask = cv2.morphologyEx(mask, cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
    count, _, stats, _ = cv2.connectedComponentsWithStats(mask)
    found = []
    for left, top, width, height, area in stats[1:count].tolist():
        length, thickness = max(width, height) * cell_m, min(width, height) * cell_m
        possible = params.shortest_m < length < params.longest_m
        if not (possible and params.thinnest_m < thickness < params.thickest_m):
            continue
        fill = area / (width * height)
        if fill < params.least_fill:
            continue
        shape_score = min(1.0, fill / params.full) * _shape_prior(length, thickness)
        place_score = _place_prior(left, top, width, height, shape, cell_m)
        contrast = min(1.0, level / params.levels[0])
        worth = params.least_contrast + (1 - params.least_contrast) * contrast
        confidence = params.by_colour * worth * shape_score * place_score
        found.append(GridHandle(left=left, top=top, right=left + width, bottom=top + height, confidence=float(confidence)))
    return found


def _shape_prior(length_m: float, thickness_m: float) -> float:
    """Bars are long and thin; knobs are round and 2-5 cm."""
    params = tuned(Params)
    if length_m / thickness_m > params.bar:
        return 1.0 if length_m > params.short_bar_m else params.short_bar
    knob = length_m / thickness_m < params.round_knob and params.knob_m[0] < length_m < params.knob_m[1]
    return params.knob if knob else params.odd


def _place_prior(left: int, top: int, width: int, height: int, shape: tuple[int, ...], cell_m: float) -> float:
    """People put handles near an edge, or on the middle line; drawers carry them across the middle."""
    params = tuned(Params)
    across, down = shape[1], shape[0]
    x, z = (left + width / 2) / across, (top + height / 2) / down
    centred_x, centred_z = abs(x - 0.5) < params.centred_x, abs(z - 0.5) < params.centred_z
    side = min(left, across - left - width) * cell_m
    end = min(top, down - top - height) * cell_m
    near_side, near_end = side < params.near_side_m, end < params.near_end_m
    if min(side, end) < params.on_rim_m:  # on the rim: a seam's shadow rather than a handle
        return params.on_rim
    if height > width * params.long:  # upright: beside an edge
        return 1.0 if near_side else params.standing_inside
    if width > height * params.long:  # lying: across the middle, or towards an edge
        return 1.0 if centred_x else params.lying_off_centre if near_end else params.lying_inside
    return 1.0 if (centred_x or near_side) and (centred_z or near_end or centred_x) else params.anywhere
