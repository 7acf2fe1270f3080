"""Articulation state of a front in one frame: how far a drawer is drawn out, or at what angle a door stands open."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from r2c2r_core.arrays import Points
from r2c2r_core.geometry.camera import project, unproject
from r2c2r_core.model.capture import Frame
from r2c2r_core.model.track import Swing
from r2c2r_core.segment.fronts.front import Front, front_corners
from r2c2r_core.segment.scene import Scene
from r2c2r_core.tuning import param, tuned

_EDGES: tuple[tuple[Literal["left", "right"], float], ...] = (("left", 1.0), ("right", -1.0))


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """When a front stands open."""

    closed_m: float = param(0.03, "m", "nearer its place it is closed: pose error and handles")
    farthest_m: float = param(0.6, "m", "that a drawer is drawn out")
    flat_m: float = param(0.015, "m", "a front is this flat, what else stands before one is not")
    most: float = param(0.6, "share", "of the depth points before the front that must lie on the flat")
    span: float = param(0.7, "share", "of the front's width and height that they must span")
    beside_m: float = param(0.05, "m", "beyond its edges the flat must end: the same outline, not a board before it")
    beside_share: float = param(0.35, "ratio", "of the density of points in that strip to that on the flat, at most")
    beside_gap_m: float = param(0.01, "m", "beyond its edges, where that strip begins for a drawer")
    inside: float = param(0.95, "share", "of the front's half width and height, within which depth is the front's")
    closed_share: float = param(0.4, "share", "of the depth in its place, from which it is closed")
    least_points: int = param(60, "count", "depth points of a flat")
    lift_bin_m: float = param(0.005, "m", "of heights over the plane that are counted together", gt=0)
    trim: float = param(0.03, "share", "of a flat's points left out at either end of its span", ge=0, lt=0.5)
    place: float = param(0.9, "share", "of a door's half width and height: its place")
    nearest_radius: float = param(0.2, "share", "of a door's half width, from its hinge, where its leaf is looked for")
    least_swing_rad: float = param(float(np.deg2rad(12.0)), "rad", "of a door that counts as open")
    bin_rad: float = param(float(np.deg2rad(3.0)), "rad", "of angles that are counted together", gt=0)
    behind_m: float = param(0.05, "m", "behind a door's place: depth there shows that it is not there")
    least_behind: int = param(30, "count", "depth points behind its place")
    edge_m: float = param(
        0.04, "m", "of a leaf's free edge: what its width may be measured short, in part from frames where it is open"
    )
    leaf_span: float = param(0.6, "share", "of a door's width that its flat must span: its hinge side may be hidden")
    off_hinge_m: float = param(
        0.05, "m", "from the hinge to the open leaf's plane: its thickness, and what the edge was measured off"
    )


def drawn_out(front: Front, scene: Scene, frame: Frame) -> float:
    """Metres a flat of the front's own outline stands before its place; 0 where closed, hidden or not to be told."""
    params = tuned(Params)
    grid = front.run.grid
    closed = front_corners(front.cell, grid, (0.0, 0.0))
    lift, x, z = _points_about(front, scene, frame, np.concatenate([closed, closed + grid.outward * params.farthest_m]))
    half_w, half_h = _halves(front)
    inside = (np.abs(x) < params.inside * half_w) & (np.abs(z) < params.inside * half_h)
    shown = lift[inside & (lift > -params.closed_m)]
    if len(shown) < params.least_points or (np.abs(shown) < params.closed_m).mean() > params.closed_share:
        return 0.0
    counts, edges = np.histogram(shown, bins=np.arange(params.closed_m, params.farthest_m, params.lift_bin_m))
    peak = int(np.argmax(np.convolve(counts, np.ones(5), mode="same")))
    out = float(edges[peak] + params.lift_bin_m / 2)
    flat = np.abs(lift - out) < params.flat_m
    own, beside = (
        flat & inside,
        flat & ~inside & (np.abs(x) > half_w + params.beside_gap_m) & (np.abs(x) < half_w + params.beside_m),
    )
    spans = _spans(x[own], z[own]) if own.sum() > params.least_points else np.zeros(2)
    density = own.sum() / (4 * params.inside**2 * half_w * half_h)
    around = beside.sum() / (4 * half_h * (params.beside_m - params.beside_gap_m))
    is_front = (
        own.sum() > params.most * len(shown) and (spans > params.span * 2 * params.inside * np.array([half_w, half_h])).all()
    )
    return out if is_front and around < params.beside_share * density else 0.0


def swung(front: Front, scene: Scene, frame: Frame) -> Swing | None:
    """How a door stands open: a flat of its size that hangs on its left or right edge; None where closed or not to be told."""
    params = tuned(Params)
    half_w, half_h = _halves(front)
    lift, x, z = _points_about(front, scene, frame, front_corners(front.cell, front.run.grid, (0.0, 0.0)))
    place = (np.abs(x) < params.place * half_w) & (np.abs(z) < params.place * half_h)
    closed, behind = int((place & (np.abs(lift) < params.closed_m)).sum()), int((place & (lift < -params.behind_m)).sum())
    if behind < params.least_behind or closed > params.closed_share * (closed + behind):
        return None
    lift, x, z = _points_about(front, scene, frame, _swept(front))
    before = (lift > params.closed_m) & (np.abs(z) < params.inside * half_h)
    leaves = [
        (leaf, Swing(hinge=hinge, angle_rad=leaf[1]))
        for hinge, sign in _EDGES
        if (leaf := _leaf(sign * x[before] + half_w, lift[before], z[before], half_w, half_h)) is not None
    ]
    return max(leaves, key=lambda found: found[0][0])[1] if leaves else None


def swung_corners(front: Front, swing: Swing) -> Points:
    """World corners of a door where it stands open, ordered as `front_corners`."""
    corners = front_corners(front.cell, front.run.grid, (0.0, 0.0))
    fixed, free = ([0, 3], [1, 2]) if swing.hinge == "left" else ([1, 2], [0, 3])
    across = corners[free] - corners[fixed]
    width = np.linalg.norm(across, axis=1, keepdims=True)
    opened = corners.copy()
    opened[free] = corners[fixed] + np.cos(swing.angle_rad) * across + np.sin(swing.angle_rad) * width * front.run.grid.outward
    return opened


def _leaf(across: np.ndarray, lift: np.ndarray, z: np.ndarray, half_w: float, half_h: float) -> tuple[int, float] | None:
    """Points on, and opening angle of, the flat that hangs on the origin of (across, lift); None where none is a door's."""
    params = tuned(Params)
    angle, radius = np.arctan2(lift, across), np.hypot(across, lift)
    reach = (radius > params.nearest_radius * half_w) & (radius < 2 * half_w) & (angle > params.least_swing_rad)
    if reach.sum() < params.least_points:
        return None
    counts, edges = np.histogram(angle[reach], bins=np.arange(0.0, np.pi, params.bin_rad))
    guess = float(edges[int(np.argmax(np.convolve(counts, np.ones(3), mode="same")))] + params.bin_rad / 2)
    off, along = _turned(across, lift, guess)
    near = reach & (np.abs(off) < 1.5 * params.off_hinge_m)
    for _ in range(3):  # a line of its own: the camera may see the leaf's back, beside the hinge by its thickness
        if near.sum() < params.least_points:
            return None
        slope, offset = np.polyfit(along[near], off[near], 1)
        guess, shift = guess + float(np.arctan(slope)), float(offset * np.cos(np.arctan(slope)))
        off, along = _turned(across, lift, guess)
        near = reach & (np.abs(off - shift) < params.flat_m)
    own = near & (along < 2 * half_w)
    beyond = (
        (np.abs(off - shift) < params.flat_m)
        & (along > 2 * half_w + params.edge_m)
        & (along < 2 * half_w + params.edge_m + params.beside_m)
    )
    if own.sum() < params.least_points or abs(shift) > params.off_hinge_m or guess < params.least_swing_rad:
        return None
    spans = _spans(along[own], z[own])
    if (
        spans < [params.leaf_span * 2 * half_w, params.span * 2 * params.inside * half_h]
    ).any() or own.sum() < params.most * near.sum():
        return None
    density = own.sum() / spans.prod()
    around = beyond.sum() / (params.beside_m * spans[1])
    return (int(own.sum()), guess) if around < params.beside_share * density else None


def _spans(across: np.ndarray, upright: np.ndarray) -> np.ndarray:
    """How far points reach across and upright, without the outermost."""
    trim = tuned(Params).trim
    return np.asarray(np.ptp(np.quantile(np.stack([across, upright]), [trim, 1 - trim], axis=1), axis=0))


def _turned(across: np.ndarray, lift: np.ndarray, angle_rad: float) -> tuple[np.ndarray, np.ndarray]:
    """Distances off, and along, the line through the origin at an angle."""
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    return c * lift - s * across, c * across + s * lift


def _swept(front: Front) -> Points:
    """Corners of the space that the door passes through, hung on either side."""
    grid = front.run.grid
    closed = front_corners(front.cell, grid, (0.0, 0.0))
    aside = 0.5 * (closed[[1, 1, 2, 2]] - closed[[0, 0, 3, 3]]) * np.array([-1.0, 1.0, 1.0, -1.0])[:, None]
    wide = closed + aside
    return np.concatenate([wide, wide + grid.outward * front.cell.width * grid.cell_m])


def _halves(front: Front) -> tuple[float, float]:
    """Half the front's width and height, metres."""
    cell_m = front.run.grid.cell_m
    return front.cell.width * cell_m / 2, front.cell.height * cell_m / 2


def _points_about(front: Front, scene: Scene, frame: Frame, space: Points) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Depth points in view of a space (world corners), as height over the front's plane, and x to the right and z up in it."""
    grid, camera, depth = front.run.grid, frame.depth_camera, scene.depth(frame.index)
    corners = front_corners(front.cell, grid, (0.0, 0.0))
    seen = frame.world_from_camera.inverse.apply(space)
    nothing = np.zeros(0)
    if seen[:4, 2].min() < 0.2:
        return nothing, nothing, nothing
    uv = project(np.maximum(seen, [-np.inf, -np.inf, 0.2]), camera)
    left, top = np.clip(np.floor(uv.min(axis=0)), 0, [camera.width, camera.height]).astype(int)
    right, bottom = np.clip(np.ceil(uv.max(axis=0)), 0, [camera.width, camera.height]).astype(int)
    row, column = np.nonzero(depth[top:bottom, left:right] > 0)
    row, column = row + top, column + left
    points = unproject(np.stack([column + 0.5, row + 0.5], axis=1), depth[row, column].astype(np.float64), camera)
    local = (frame.world_from_camera.apply(points) - corners.mean(axis=0)) @ grid.world_from_plane.rotation
    return -local[:, 1], local[:, 0], local[:, 2]
