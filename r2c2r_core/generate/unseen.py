"""Colour completion of texels that no frame shows."""

from dataclasses import dataclass

import cv2
import numpy as np

from r2c2r_core.arrays import Colours, Image, Points, Vector3
from r2c2r_core.generate.charts import FRONT, Atlas
from r2c2r_core.generate.relief import BESIDE_HANDLE_M
from r2c2r_core.model.track import FrontHandle
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of texture completion."""

    least_share: float = param(0.15, "share", "Minimum observed fraction of a side for its own colours to be used")
    before_face_m: float = param(
        0.002, "m", "Distance in front of the front face beyond which a texel belongs to a protruding part"
    )
    neighbours: int = param(4, "count", "Number of observed texels whose colours are blended", ge=2)
    most_known: int = param(12_000, "count", "Maximum number of observed texels in the neighbour search", ge=10)
    cells_a_reach: int = param(20, "count", "Number of lookup cells per reach: colours hardly change within one cell", ge=1)
    reach: float = param(
        0.15,
        "ratio",
        "Maximum distance of a neighbour, relative to the mesh's size; beyond it the median colour is as good",
        gt=0,
    )


def own_texels(atlas: Atlas, seen: np.ndarray, front_y_m: float | None) -> np.ndarray:
    """Texels that may keep their observed colours: on a barely observed side, texels along its edge show the neighbour."""
    if front_y_m is None:
        return np.ones(len(seen), dtype=bool)
    total = np.bincount(atlas.chart, minlength=6)
    share = np.bincount(atlas.chart[seen], minlength=6) / np.maximum(total, 1)
    return np.asarray((share > tuned(Params).least_share)[atlas.chart] | (atlas.chart == FRONT) | _stands_out(atlas, front_y_m))


def beside_cover(atlas: Atlas, seen: np.ndarray, covered: np.ndarray, front_y_m: float, reach_m: float) -> np.ndarray:
    """Texels of furniture's sides within `reach_m` of covered ones: what stands there, as a neighbour's front, colours them."""
    from scipy.spatial import cKDTree

    near, side = np.zeros(len(seen), dtype=bool), (atlas.chart != FRONT) & ~_stands_out(atlas, front_y_m)
    for chart in np.unique(atlas.chart[covered]):
        own, hidden = np.flatnonzero(side & seen & (atlas.chart == chart)), covered[atlas.chart[covered] == chart]
        distance, _ = cKDTree(atlas.points[hidden]).query(atlas.points[own], distance_upper_bound=reach_m)
        near[own] = np.isfinite(distance)
    return near


def beside_handle(atlas: Atlas, front_y_m: float, handle: FrontHandle) -> np.ndarray:
    """Texels of the front face behind a handle and beside it, up to an edge that is near: a strip left there shows the gap."""
    near = (atlas.chart == FRONT) & ~_stands_out(atlas, front_y_m)
    for axis, low, high in ((0, handle.left_m, handle.right_m), (2, handle.bottom_m, handle.top_m)):
        along = atlas.points[:, axis]
        ends = along.min(), along.max()
        low, high = low - BESIDE_HANDLE_M, high + BESIDE_HANDLE_M
        near &= (along > low) | (low - ends[0] < BESIDE_HANDLE_M)
        near &= (along < high) | (ends[1] - high < BESIDE_HANDLE_M)
    return np.asarray(near)


def fill_unseen(colours: Colours, seen: np.ndarray, atlas: Atlas, front_y_m: float | None, eye_local: Vector3) -> Colours:
    """Colours for unobserved texels: gaps from the nearest observed surface, the rest from the median colour.

    Neighbours are found in space, so separately unwrapped charts continue each other. The back of an object is assumed to
    mirror the front that `eye_local` (the cameras' mean position) sees; but an entirely unobserved side of furniture gets the
    plain tint, since its material does not continue the front's pattern around the corner.
    """
    if seen.all() or not seen.any():
        return np.where(seen[:, None], colours, np.uint8(160))
    on_front = seen & (atlas.chart == FRONT)
    filled = colours.copy()
    filled[~seen] = np.round(np.median(colours[on_front if on_front.any() else seen], axis=0)).astype(np.uint8)
    if front_y_m is None:
        known, gaps = np.flatnonzero(seen), np.flatnonzero(~seen)
        _blend_neighbours(filled, known, gaps, atlas.points, _mirrored(atlas.points[gaps], atlas.points, eye_local))
        _blend_neighbours(filled, known, gaps, atlas.points, atlas.points[gaps])
        return filled
    outside = _stands_out(atlas, front_y_m)
    face, missing = ~outside & (atlas.chart == FRONT), ~seen
    shown = (np.bincount(atlas.chart[seen & ~outside], minlength=6) > 0)[atlas.chart]
    # neither a handle nor a side, dark in its gap, colours the face
    for part, like in ((outside, outside), (face, face), (~outside & ~face & shown, ~outside)):
        gaps = np.flatnonzero(part & missing)
        _blend_neighbours(filled, np.flatnonzero(like & seen), gaps, atlas.points, atlas.points[gaps])
    return filled


def spread_colours(texture: Image, atlas: Atlas) -> Image:
    """The texture with gutters between charts filled with the nearest chart colour, so that filtering does not bleed black."""
    covered = np.zeros(atlas.size, np.uint8)
    covered.ravel()[atlas.texel] = 1
    if covered.all() or not covered.any():
        return texture
    _, label = cv2.distanceTransformWithLabels(1 - covered, cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL)
    lookup = np.zeros((int(label.max()) + 1, 3), np.uint8)
    lookup[label[covered == 1]] = texture[covered == 1]
    return lookup[label]


def _stands_out(atlas: Atlas, front_y_m: float) -> np.ndarray:
    """Texels in front of the front face: a handle's sides belong to the handle, not to the carcass."""
    return np.asarray(atlas.points[:, 1] < front_y_m - tuned(Params).before_face_m)


def _mirrored(chosen: Points, points: Points, eye_local: Vector3) -> Points:
    """Mirror images of the chosen points about the upright plane through the centre that faces the cameras."""
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    towards = (eye_local - middle) * [1.0, 1.0, 0.0]
    towards /= max(float(np.linalg.norm(towards)), 1e-9)
    return chosen - 2.0 * ((chosen - middle) @ towards)[:, None] * towards


def _blend_neighbours(filled: Colours, known: np.ndarray, missing: np.ndarray, points: Points, places: Points) -> None:
    """Blend the missing texels, in place, from the known colours nearest to their `places` to their current colours."""
    params = tuned(Params)
    from scipy.spatial import cKDTree

    if len(missing) == 0 or len(known) == 0:
        return
    known = known[:: max(len(known) // params.most_known, 1)]
    reach = params.reach * float(np.linalg.norm(np.ptp(points, axis=0)))
    asked, of_cell = _by_cell(places, reach / params.cells_a_reach)
    found = cKDTree(points[known]).query(asked, k=min(params.neighbours, len(known)), distance_upper_bound=reach)
    distance, neighbour = (values.reshape(len(asked), -1)[of_cell] for values in found)
    near = np.isfinite(distance)
    weight = np.where(near, 1.0 / np.maximum(distance, 1e-4), 0.0)
    samples = filled[known[np.where(near, neighbour, 0)]]
    nearby = (samples * weight[..., None]).sum(axis=1) / np.maximum(weight.sum(axis=1), 1e-12)[:, None]
    trust = np.where(near[:, :1], np.exp(-((2.0 * distance[:, :1] / reach) ** 2)), 0.0)
    filled[missing] = np.round(trust * nearby + (1 - trust) * filled[missing]).clip(0, 255).astype(np.uint8)


def _by_cell(places: Points, size_m: float) -> tuple[Points, np.ndarray]:
    """One place per occupied cell of space, and the cell of every place: neighbours are similar within a cell."""
    cell = np.floor((places - places.min(axis=0)) / max(size_m, 1e-9)).astype(np.int64)
    count = cell.max(axis=0) + 1
    _, first, of_cell = np.unique(
        (cell[:, 0] * count[1] + cell[:, 1]) * count[2] + cell[:, 2], return_index=True, return_inverse=True
    )
    return places[first], of_cell
