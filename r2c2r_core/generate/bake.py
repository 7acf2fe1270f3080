"""Texture baking: each texel is a robust blend of the sharp, frontal, unoccluded frames that see it."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from r2c2r_core.arrays import Colours, DepthMetres, Faces, Image, Mask, Points
from r2c2r_core.generate.charts import Atlas
from r2c2r_core.generate.consistency import VIEWS_KEPT, render_depth, sensor_depth
from r2c2r_core.generate.evidence import View, moved_edge
from r2c2r_core.generate.unseen import beside_cover, beside_handle, fill_unseen, own_texels, spread_colours
from r2c2r_core.geometry.camera import project, sample_nearest
from r2c2r_core.geometry.texels import bilinear_colours
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.track import FrontHandle
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of texture baking."""

    least_cosine: float = param(
        0.2, "cosine", "Minimum cosine between a texel's normal and the viewing direction for a view to colour it"
    )
    grazing_cosine: float = param(
        0.5, "cosine", "Cosine of the viewing angle below which depth measured beyond the surface rejects the sample"
    )
    hidden_m: float = param(
        0.015, "m", "Minimum distance of a texel behind the mesh's rendered depth for it to count as self-occluded"
    )
    sensor_gap_m: float = param(
        0.03, "m", "Minimum distance, beyond the depth noise, between texel and measured depth for an occlusion"
    )
    views_per_side: int = param(9, "count", "Maximum number of frames that texture one side", ge=1)
    power: float = param(
        4.0,
        "ratio",
        "Exponent of a frame's weight cos²·sharpness/z²",
        source="backends.md 2.6: 4 nearly selects the best frame and still hides seams",
    )
    next_view: float = param(
        0.05,
        "ratio",
        "Factor by which the weight of each next-best frame of a flat side is reduced",
        source="poses differ by millimetres, so an even blend shows ghosting",
    )
    outlier_levels: float = param(
        40.0,
        "grey",
        "Scale of the robust weight on a sample's deviation from the frames' median (highlights, occluder fringes)",
        gt=0,
    )
    edge_share: float = param(
        0.006, "share", "Mask erosion relative to the mask's size, which removes the dark gap and the blur along its outline"
    )


class Baked(NamedTuple):
    """A texture and the fraction of it that was observed."""

    texture: Image
    seen_fraction: float  # of the covered texels


def bake(
    atlas: Atlas,
    vertices_world: Points,
    faces: Faces,
    world_from_local: Rigid3,
    views: Sequence[View],
    front_y_m: float | None = None,
    handle: FrontHandle | None = None,
) -> Baked:
    """Texture of an atlas whose points are in the local frame; unobserved texels get plausible colours.

    `front_y_m` is the front face of furniture: its other sides are then filled from their own material, or from the plain tint.
    Beside its `handle`, photos show that handle where the model has none, by errors of millimetres, and its shadow: those
    texels count as not observed.
    """
    eyes = world_from_local.inverse.apply(np.array([view.eye_world for view in views]))
    wanted = np.ones((len(views), 6), dtype=bool) if front_y_m is None else _best_views(atlas, eyes, views)
    sides = _gather(atlas, vertices_world, faces, world_from_local, views, wanted)
    if front_y_m is not None:
        for side in sides:
            _prefer_best(side.weights)
    colours, seen = _blend(sides, len(views), len(atlas.points))
    if front_y_m is not None:
        seen &= ~beside_cover(atlas, seen, np.concatenate([side.covered for side in sides]), front_y_m, _blurred_m(views, eyes))
    seen &= own_texels(atlas, seen, front_y_m)
    if front_y_m is not None and handle is not None:
        seen &= ~beside_handle(atlas, front_y_m, handle)
    texture = np.zeros((*atlas.size, 3), np.uint8)
    texture.reshape(-1, 3)[atlas.texel] = fill_unseen(colours, seen, atlas, front_y_m, eyes.mean(axis=0))
    return Baked(spread_colours(texture, atlas), float(seen.mean()) if len(seen) else 0.0)


class _Side(NamedTuple):
    """Colour samples and weights of one chart's texels in the views that show it."""

    views: np.ndarray  # (k,) indices of the views
    texels: np.ndarray  # (t,) texels that at least one view shows
    samples: np.ndarray  # (3, k, t) uint8, a channel at a time: numpy is slow along an axis of three
    weights: np.ndarray  # (k, t) float32, 0 where a view does not show the texel
    covered: np.ndarray  # (c,) texels before which more views measure something else than show the texel


class _Photo(NamedTuple):
    """The parts of a view that do not depend on the texel."""

    view: View
    camera_from_local: Rigid3
    mask: Mask  # well inside the object
    surface_m: DepthMetres  # rendered depth of the mesh, reduced size
    sensor_m: DepthMetres  # measured depth, at the same pixels


def _best_views(atlas: Atlas, eyes_local: Points, views: Sequence[View]) -> np.ndarray:
    """(view, chart) booleans: whether the view is among the most useful for that side (frontal, near, sharp)."""
    params = tuned(Params)
    wanted = np.zeros((len(views), 6), dtype=bool)
    sharp = np.array([0.3 + 0.7 * view.sharpness for view in views])
    for chart in np.unique(atlas.chart):
        normal = np.eye(3)[chart // 2] * (1.0 if chart % 2 else -1.0)
        towards = eyes_local - atlas.points[atlas.chart == chart].mean(axis=0)
        distance = np.maximum(np.linalg.norm(towards, axis=1), 0.05)
        usefulness = np.maximum(towards @ normal / distance, 0.0) ** 2 / distance**2 * sharp
        best = np.argsort(-usefulness, kind="stable")[: params.views_per_side]
        wanted[best[usefulness[best] > 0], chart] = True
    return wanted


def _blurred_m(views: Sequence[View], eyes_local: Points) -> float:
    """Distance of a surface in front of the object within which depth takes it for the object's."""
    distances = np.linalg.norm(eyes_local, axis=1)
    return float(np.median([v.noise.reach(z, tuned(Params).sensor_gap_m) for v, z in zip(views, distances, strict=True)]))


def _prefer_best(weights: np.ndarray) -> None:
    """Scale a side's weights (k, t) in place, so that the view with the largest total weight dominates."""
    params = tuned(Params)
    for rank, view in enumerate(np.argsort(-weights.sum(axis=1), kind="stable")):
        weights[view] *= max(params.next_view**rank, 1e-9)


def _gather(
    atlas: Atlas,
    vertices_world: Points,
    faces: Faces,
    world_from_local: Rigid3,
    views: Sequence[View],
    wanted: np.ndarray,
) -> list[_Side]:
    """Colours and weights of each chart's texels in its chosen views."""
    photos = {k: _photo(views[k], vertices_world, faces, world_from_local) for k in np.flatnonzero(wanted.any(axis=1)).tolist()}
    sides = []
    for chart in np.flatnonzero(np.bincount(atlas.chart, minlength=6)):
        texels, chosen = np.flatnonzero(atlas.chart == chart), np.flatnonzero(wanted[:, chart])
        points, normals = (np.ascontiguousarray(of[texels].T, dtype=np.float32) for of in (atlas.points, atlas.normals))
        samples = np.zeros((3, len(chosen), len(texels)), np.uint8)
        weights, covered = np.zeros((len(chosen), len(texels)), np.float32), np.zeros(len(texels), np.uint16)
        for row, k in enumerate(chosen.tolist()):
            _look(photos[k], points, normals, samples[:, row], weights[row], covered)
        seen = (weights > 0).any(axis=0)
        sides.append(
            _Side(chosen, texels[seen], samples[:, :, seen], weights[:, seen], texels[covered > (weights > 0).sum(axis=0)])
        )
    return sides


def _photo(view: View, vertices_world: Points, faces: Faces, world_from_local: Rigid3) -> _Photo:
    surface, inside = render_depth(vertices_world, faces, view), _well_inside(view, tuned(Params).edge_share)
    return _Photo(view, view.world_from_camera.inverse @ world_from_local, inside, surface, sensor_depth(view, surface.shape))


@lru_cache(maxsize=VIEWS_KEPT)
def _well_inside(view: View, edge_share: float) -> Mask:
    return moved_edge(view.mask, -max(1.0, edge_share * np.sqrt(view.mask.sum())))


def _look(
    photo: _Photo, points: np.ndarray, normals: np.ndarray, samples: np.ndarray, weights: np.ndarray, covered: np.ndarray
) -> None:
    """Write one view's colours (3, t) and weights (t,) at points (3, t) with normals (3, t); count the covered ones (t,)."""
    params = tuned(Params)
    dx, dy, dz = photo.camera_from_local.inverse.translation.astype(np.float32)[:, None] - points
    distance = np.sqrt(dx * dx + dy * dy + dz * dz)
    cosine = (dx * normals[0] + dy * normals[1] + dz * normals[2]) / np.maximum(distance, np.float32(1e-9))
    facing = np.flatnonzero(cosine > params.least_cosine)
    if len(facing) == 0:
        return
    cosine = cosine[facing]
    in_camera = _moved(points[:, facing], photo.camera_from_local)
    colours, shown, hidden = _look_up(photo, in_camera, cosine < params.grazing_cosine)
    covered[facing] += hidden
    z = np.maximum(in_camera[:, 2], np.float32(0.05))
    sharpness = np.float32(0.3 + 0.7 * photo.view.sharpness)
    weights[facing] = np.where(shown, (cosine**2 * sharpness / z**2) ** params.power, np.float32(0))
    samples[:, facing] = colours.T


def _look_up(photo: _Photo, in_camera: np.ndarray, grazing: np.ndarray) -> tuple[Colours, np.ndarray, np.ndarray]:
    """The view's colour at each camera-frame point, whether it shows the point, and whether something else covers it.

    A shown point lies in the mask and is occluded neither by the mesh nor, where the sensor measured, by anything else. On
    grazing sides, where a mask that is a pixel too wide smears the neighbouring surface over a hand's breadth, depth must
    confirm the surface.
    """
    params = tuned(Params)
    z, (height, width) = in_camera[:, 2], photo.surface_m.shape
    camera, noise = photo.view.rgb_camera, photo.view.noise
    uv = np.where(z[:, None] > 0.05, project(in_camera, camera), np.float32(np.nan))
    in_mask, inside = sample_nearest(photo.mask, uv)
    small = np.array([width / camera.width, height / camera.height], np.float32)
    both, _ = sample_nearest(np.stack([photo.surface_m, photo.sensor_m], axis=-1), uv * small)
    surface, measured = both[:, 0], both[:, 1]
    hidden = noise.occluded(measured, z, params.sensor_gap_m)
    beyond = noise.seen_through(measured, z, params.sensor_gap_m) & grazing
    shown = inside & in_mask & (z < surface + params.hidden_m) & ~hidden & ~beyond
    return bilinear_colours(photo.view.rgb, uv), shown, inside & hidden


def _moved(points: np.ndarray, transform: Rigid3) -> np.ndarray:
    """Points given as columns (3, n), transformed in single precision, as rows (n, 3)."""
    r, t = transform.rotation.astype(np.float32), transform.translation.astype(np.float32)
    x, y, z = points
    return np.stack([x * r[k, 0] + y * r[k, 1] + z * r[k, 2] + t[k] for k in range(3)]).T


def _blend(sides: Sequence[_Side], views: int, count: int) -> tuple[Colours, np.ndarray]:
    """Robust weighted mean of each texel's samples, down-weighted by their deviation from the median grey after exposure
    correction.
    """
    params = tuned(Params)
    greys = [_grey(side.samples) for side in sides]
    gains = _gains(sides, greys, views)
    colours, seen = np.zeros((count, 3), np.uint8), np.zeros(count, dtype=bool)
    for side, grey in zip(sides, greys, strict=True):
        if len(side.texels) == 0:
            continue
        gain = gains[side.views, None]
        grey *= gain
        median = _median_shown(grey, side.weights > 0)
        agreement = np.exp(-(((grey - median) / np.float32(params.outlier_levels)) ** 2))
        final = side.weights / np.maximum(side.weights.max(axis=0), np.float32(1e-30)) * (agreement + np.float32(1e-4))
        share = gain * final / np.maximum(final.sum(axis=0), np.float32(1e-12))
        for channel, samples in enumerate(side.samples):
            mean = (samples * share).sum(axis=0)
            colours[side.texels, channel] = np.round(mean).clip(0, 255)
        seen[side.texels] = True
    return colours, seen


def _gains(sides: Sequence[_Side], greys: Sequence[np.ndarray], views: int) -> np.ndarray:
    """Gain that brings each view to the common exposure."""
    ratios: list[list[np.ndarray]] = [[] for _ in range(views)]
    for side, grey in zip(sides, greys, strict=True):
        shown = side.weights > 0
        median = _median_shown(grey, shown)
        for k, its_grey, is_shown in zip(side.views, grey, shown, strict=True):
            usable = is_shown & (its_grey > 15) & (median > 15)
            ratios[k].append(median[usable] / its_grey[usable])
    return np.array([_gain(np.concatenate(of_view)) if of_view else 1.0 for of_view in ratios], np.float32)


def _gain(ratios: np.ndarray) -> float:
    return 1.0 if len(ratios) < 50 else float(np.clip(np.median(ratios), 0.7, 1.4))


def _grey(samples: np.ndarray) -> np.ndarray:
    """Mean of the colour channels, (k, t)."""
    red, green, blue = samples
    return np.asarray((red.astype(np.float32) + green + blue) / np.float32(3.0))


def _median_shown(grey: np.ndarray, shown: np.ndarray) -> np.ndarray:
    """Lower median over the views that show each texel (lower, because highlights are bright)."""
    if len(grey) == 0:
        return np.zeros(grey.shape[1], np.float32)
    ordered = np.where(shown, grey, np.float32(np.inf)).T.copy()  # numpy sorts contiguous rows faster
    ordered.sort(axis=1)
    middle = np.maximum(shown.sum(axis=0) - 1, 0) // 2
    return np.asarray(ordered[np.arange(len(middle)), middle])
