"""How an appliance stands, by its edges in the photographs: glass leaves depth too little of its front to say.

The turn, place and borders at which the edges of its box lie on the clearest colour edges of all photographs together. A
line of its door, its shadow or a highlight may be clearer in one view; from other directions it lies elsewhere.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import cv2
import numpy as np

from r2c2r_core.arrays import Points
from r2c2r_core.geometry.camera import project
from r2c2r_core.geometry.transforms import rotation_about_z
from r2c2r_core.segment.appliances.outline import Body, Photo, body_of, hidden
from r2c2r_core.segment.appliances.squaring import turned_front
from r2c2r_core.segment.fronts.front import Front
from r2c2r_core.segment.runs.orthomosaic import Cell
from r2c2r_core.tuning import param, tuned

_PRIOR = np.array([np.radians(1.5), 0.008, 0.010, 0.010, 0.010, 0.020])  # how far off a stance by the rest of its depth may be


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """How a stance is found by edges in the photographs."""

    covered: float = param(0.7, "share", "of a front: where depth saw this much of it, depth knows its plane best")
    samples: int = param(16, "count", "along an edge", ge=4)
    blurs_px: tuple[float, float, float] = param((2.5, 1.2, 0.8), "px", "of the photographs, pass by pass")
    steps: tuple[float, float, float] = param((0.7, 0.3, 0.2), "ratio", "to the prior, tried first at each blur")
    trials: int = param(180, "count", "of a pass", ge=10)
    worth: float = param(2.0, "score", "of an edge's log contrast, beside one standard deviation of the prior")
    least_px: float = param(15.0, "px", "an edge this short has no direction")
    least_share: float = param(1 / 3, "share", "of an edge's samples that must be in view")
    enough: int = param(4, "count", "photographs that show an edge, from which on it counts in full", ge=1)
    beside_m: float = param(0.02, "m", "beyond a face's plane, from where the face is seen")
    margin_px: int = param(24, "px", "about the body, that is kept of a photograph")
    least_photos: int = param(5, "count", "that are needed")


class Stance(NamedTuple):
    """Off what was thought: turn about the upright axis through the front's middle, and metres outwards for each face."""

    turn_rad: float = 0.0
    forward_m: float = 0.0
    left_m: float = 0.0
    right_m: float = 0.0
    top_m: float = 0.0
    back_m: float = 0.0


def stood(front: Front, photos: Sequence[Photo]) -> Front:
    """The front as the photographs have it stand, where depth saw too little of it; else as it was."""
    run, cell = front.run, front.cell
    rows = slice(max(round(cell.top), 0), max(round(cell.bottom), 0))
    columns = slice(max(round(cell.left), 0), max(round(cell.right), 0))
    covered = run.seen[rows, columns]
    if not covered.size or covered.mean() > tuned(Params).covered:
        return front
    found = stance(body_of(front), photos)
    cell_m = run.grid.cell_m
    moved = Cell(
        cell.left - found.left_m / cell_m, cell.top - found.top_m / cell_m, cell.right + found.right_m / cell_m, cell.bottom
    )
    front = replace(front, depth_m=front.depth_m + found.forward_m)
    return turned_front(front, moved, found.turn_rad, found.forward_m)


def stance(body: Body, photos: Sequence[Photo]) -> Stance:
    """Where a body's edges are clearest; where it was thought when too few photographs show all of it."""
    params = tuned(Params)
    from scipy.optimize import minimize

    views = [view for photo in photos if (view := _view(body, photo)) is not None]
    if len(views) < params.least_photos:
        return Stance()
    best = np.zeros(len(_PRIOR))
    for blur_px, step in zip(params.blurs_px, params.steps, strict=True):
        slopes = [_Slopes.of(view, blur_px) for view in views]
        tried = best + np.vstack([np.zeros(len(_PRIOR)), np.diag(step * _PRIOR)])
        options = {"initial_simplex": tried, "maxfev": params.trials, "xatol": 2e-4, "fatol": 2e-3}
        best = minimize(_cost, best, args=(body, views, slopes), method="Nelder-Mead", options=options).x
    return Stance(*map(float, best))


@dataclass(frozen=True, slots=True, eq=False)
class _View:
    """A photograph that shows the whole body: which samples of which edges are in view, and the part that it fills."""

    photo: Photo
    shown: np.ndarray  # (edges, samples)
    left: int
    top: int
    lab: np.ndarray


@dataclass(frozen=True, slots=True, eq=False)
class _Slopes:
    """How colour changes along x and y, (rows, columns, 3) each, in the part of a view that the body fills."""

    x: np.ndarray
    y: np.ndarray

    @classmethod
    def of(cls, view: _View, blur_px: float) -> "_Slopes":
        smooth = cv2.GaussianBlur(view.lab.astype(np.float32), (0, 0), blur_px)
        return cls(cv2.Sobel(smooth, cv2.CV_32F, 1, 0, scale=1 / 8), cv2.Sobel(smooth, cv2.CV_32F, 0, 1, scale=1 / 8))

    def across(self, uv_px: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Change across edges at their samples (edges, samples, 2): (edges, samples, 3)."""
        u, v = (np.ascontiguousarray(uv_px[..., k], dtype=np.float32) for k in (0, 1))
        x, y = (cv2.remap(slope, u, v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE) for slope in (self.x, self.y))
        return np.asarray(x * normals[:, None, :1] + y * normals[:, None, 1:])


def _cost(values: np.ndarray, body: Body, views: Sequence[_View], slopes: Sequence[_Slopes]) -> float:
    params = tuned(Params)
    edges = _edges(body, Stance(*values))
    contrast, count = np.zeros(len(edges)), np.zeros(len(edges))
    for view, slope in zip(views, slopes, strict=True):
        uv = _pixels(view.photo, edges)
        along = uv[:, -1] - uv[:, 0]
        length = np.linalg.norm(along, axis=1, keepdims=True)
        normals = np.stack([-along[:, 1], along[:, 0]], axis=1) / np.maximum(length, 1e-6)
        shown = view.shown & (length > params.least_px)
        change = slope.across(uv - [view.left + 0.5, view.top + 0.5], normals)
        mean = (change * shown[..., None]).sum(axis=1) / np.maximum(shown.sum(axis=1), 1)[:, None]
        told = shown.mean(axis=1) >= params.least_share
        contrast += np.where(told, np.log1p(np.linalg.norm(mean, axis=1)), 0.0)  # a clear edge outweighs no others
        count += told
    clear = contrast / np.maximum(count, 1) * np.minimum(count, params.enough) / params.enough
    return float(-params.worth * clear.sum() + 0.5 * np.sum((values / _PRIOR) ** 2))


def _view(body: Body, photo: Photo) -> _View | None:
    """What a photograph shows of the body; None where a part of it is outside."""
    params = tuned(Params)
    edges = _edges(body, Stance())
    local = photo.world_from_camera.inverse.apply(edges.reshape(-1, 3))
    eye = body.world_from_front.inverse.apply(photo.world_from_camera.translation[None])[0]
    if local[:, 2].min() < 0.2 or eye[1] > -params.beside_m:
        return None
    uv = project(local, photo.camera)
    low, high = np.floor(uv.min(axis=0)).astype(int) - 2, np.ceil(uv.max(axis=0)).astype(int) + 2
    size = np.array([photo.camera.width, photo.camera.height])
    if (low < 0).any() or (high > size).any():
        return None
    seen_side = {-1: eye[0] < -body.half_width_m - params.beside_m, 1: eye[0] > body.half_width_m + params.beside_m}
    above = eye[2] > body.top_m + params.beside_m
    # in the order of _edges: front left, front right, back left, back right, top front, top back, top left, top right
    faced = [True, True, seen_side[-1], seen_side[1], True, above, above or seen_side[-1], above or seen_side[1]]
    shown = np.array(faced)[:, None] & ~hidden(photo, uv, local[:, 2]).reshape(edges.shape[:2])
    left, top = np.maximum(low - params.margin_px, 0)
    right, bottom = np.minimum(high + params.margin_px, size)
    return _View(photo, shown, int(left), int(top), photo.lab[top:bottom, left:right])


def _pixels(photo: Photo, edges: Points) -> np.ndarray:
    local = photo.world_from_camera.inverse.apply(edges.reshape(-1, 3))
    return np.asarray(project(local, photo.camera).reshape(*edges.shape[:2], 2))


def _edges(body: Body, off: Stance) -> Points:
    """World points (8, samples, 3) of the upright edges and those of the top; the foot lies in shadow."""
    left, right, front, back = (
        -body.half_width_m - off.left_m,
        body.half_width_m + off.right_m,
        -off.forward_m,
        body.depth_m + off.back_m,
    )
    low, high, along = body.bottom_m, body.top_m + off.top_m, np.linspace(0.05, 0.95, tuned(Params).samples)
    ends = [((x, y, low), (x, y, high)) for y in (front, back) for x in (left, right)]
    ends += [((left, y, high), (right, y, high)) for y in (front, back)]
    ends += [((x, front, high), (x, back, high)) for x in (left, right)]
    starts, stops = np.array(ends).swapaxes(0, 1)[:, :, None]
    local = starts + along[:, None] * (stops - starts)
    turned = local.reshape(-1, 3) @ rotation_about_z(off.turn_rad).T
    return body.world_from_front.apply(turned).reshape(local.shape)
