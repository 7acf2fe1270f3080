"""What shows behind an open front: the rear board, the sides and the shelves of its compartment, as peaks of depth points."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from r2c2r_core.arrays import Points
from r2c2r_core.geometry.camera import depth_points
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.capture import Frame
from r2c2r_core.model.motion import Inside
from r2c2r_core.segment.motion.leaf import Leaf
from r2c2r_core.segment.motion.leaf import Params as LeafParams
from r2c2r_core.segment.scene import Scene
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Where boards of a compartment are looked for, and what counts as one."""

    deepest_m: float = param(0.75, "m", "behind a front, to where its compartment may reach", source="worktops are 600-700 mm")
    shallowest_m: float = param(0.12, "m", "behind it, from where a rear board may stand: wall units are 300 mm")
    rim_m: float = param(0.03, "m", "inside the front's outline: boards are 16-20 mm, and depth errs at them")
    bin_m: float = param(0.004, "m", "of the histograms of depth points", gt=0)
    spread_m: float = param(0.012, "m", "about a face, within which depth points are its own: their noise", gt=0)
    beside_m: float = param(0.05, "m", "beside a face, where there must be few: what lies about is spread evenly")
    least_points: int = param(80, "count", "depth points of a face", ge=10)
    least_frames: int = param(3, "count", "frames that must show it", ge=1)
    sharp: float = param(3.0, "ratio", "of points at a face to those beside it, over lengths alike", gt=1)
    spans: float = param(0.4, "share", "of the front's width that a rear board must show over, or its depth of a side or shelf")
    shows: float = param(0.15, "share", "of the points of the clearest level, that a shelf has: less is what lies on one", gt=0)
    boards_m: tuple[float, ...] = param((0.01, 0.06), "m", "of a unit's boards and a machine's walls, thinnest and thickest")
    apart_m: float = param(0.08, "m", "between two shelves, at least")


@dataclass(frozen=True, slots=True, eq=False)
class _Cloud:
    """Depth points of a compartment in the front frame, y from the outer face backwards, and the frame of each."""

    points: Points
    frame: np.ndarray

    def where(self, keep: np.ndarray) -> "_Cloud":
        return _Cloud(self.points[keep], self.frame[keep])


def measure_inside(
    leaf: Leaf, place: Callable[[Frame], Rigid3 | None], scene: Scene, *, drawn_out_m: float = 0.0
) -> Inside | None:
    """The compartment that a front closes, or the drawer that it pulls out; None where none of its boards were seen.

    `place` is world_from_front of what is measured in the frames that show its inside, None in others: a drawer's box moves
    with its front, a carcass stays. `drawn_out_m` is how far a drawer came out at most: its rear board stays in the unit,
    whose own face would else look like one.
    """
    params, half = tuned(Params), np.array(leaf.half_m)
    cloud = _behind(leaf, place, scene)
    within = (np.abs(cloud.points[:, 0]) < half[0] - params.rim_m) & (np.abs(cloud.points[:, 2]) < half[1] - params.rim_m)
    rear = _rear(cloud.where(within), leaf, max(params.shallowest_m, drawn_out_m + params.rim_m))
    if rear is None:
        return None
    front = tuned(LeafParams).thickness_m
    before = cloud.where((cloud.points[:, 1] > front + params.rim_m) & (cloud.points[:, 1] < rear - params.rim_m))
    if drawn_out_m > 0:
        return Inside(depth_m=rear - front)
    sides = _ends([at for at, _ in _faces(before, 0, across=1, least_span_m=params.rim_m)], leaf.half_m[0])
    levels = _faces(before, 2, across=0, least_span_m=params.spans * leaf.width_m)
    most = max((count for _, count in levels), default=0)
    level = sorted(at for at, count in levels if count > params.shows * most)
    bottom, top = _ends(level, leaf.half_m[1])
    return Inside(
        depth_m=rear - front,
        width_m=_between(*sides),
        height_m=_between(bottom, top),
        shelves_m=()
        if bottom is None
        else tuple(at - bottom for at in level if bottom + params.apart_m < at < (top or np.inf)),
    )


def _behind(leaf: Leaf, place: Callable[[Frame], Rigid3 | None], scene: Scene) -> _Cloud:
    params, (half_w, half_h) = tuned(Params), leaf.half_m
    found, numbers = [np.zeros((0, 3))], [np.zeros(0, int)]
    for frame in scene.frames:
        world_from_front = place(frame)
        if world_from_front is None:
            continue
        depth = scene.depth(frame.index)
        seen = depth_points(depth, frame.depth_camera)[depth > 0].astype(np.float64)
        local = (world_from_front.inverse @ frame.world_from_camera).apply(seen)
        keep = (np.abs(local[:, 0]) < half_w) & (np.abs(local[:, 2]) < half_h)
        keep &= (local[:, 1] > 0) & (local[:, 1] < params.deepest_m)
        found.append(local[keep])
        numbers.append(np.full(int(keep.sum()), frame.index))
    return _Cloud(np.concatenate(found), np.concatenate(numbers))


def _rear(cloud: _Cloud, leaf: Leaf, least_m: float) -> float | None:
    """Where the rear board's face stands: the furthest face square to the depth, behind what stands on the shelves."""
    faces = _faces(cloud, 1, across=0, least_span_m=tuned(Params).spans * leaf.width_m)
    return max((at for at, _ in faces if at > least_m), default=None)


def _ends(faces: list[float], half_m: float) -> tuple[float | None, float | None]:
    """The innermost faces of the boards at both ends; None where one was not seen."""
    thinnest, thickest = tuned(Params).boards_m
    ends = [at for at in faces if half_m - thickest < abs(at) < half_m - thinnest]
    return max((at for at in ends if at < 0), default=None), min((at for at in ends if at > 0), default=None)


def _between(low: float | None, high: float | None) -> float | None:
    return None if low is None or high is None else high - low


def _faces(cloud: _Cloud, axis: int, *, across: int, least_span_m: float) -> list[tuple[float, int]]:
    """Where points crowd along an axis, and how many: flat faces square to it, that reach far enough across."""
    params = tuned(Params)
    values = cloud.points[:, axis]
    if len(values) < params.least_points:
        return []
    edges = np.arange(values.min() - params.beside_m, values.max() + params.beside_m + params.bin_m, params.bin_m)
    count, _ = np.histogram(values, edges)
    reach, beside = round(params.spread_m / params.bin_m), round(params.beside_m / params.bin_m)
    own, around = (np.convolve(count, np.ones(2 * n + 1), "same") for n in (reach, beside))
    usual = (around - own) * (2 * reach + 1) / (2 * (beside - reach))
    found = []
    order = np.argsort(-own, kind="stable")
    taken = np.zeros(len(own), bool)
    for k in order[: int((own >= params.least_points).sum())]:
        if taken[k] or own[k] < params.sharp * max(usual[k], 1.0):
            continue
        taken[max(k - beside, 0) : k + beside + 1] = True
        at = float(np.median(values[np.abs(values - (edges[k] + params.bin_m / 2)) < params.spread_m]))
        face = np.abs(values - at) < params.spread_m
        span = np.ptp(np.quantile(cloud.points[face, across], [0.03, 0.97]))
        if span > least_span_m and len(np.unique(cloud.frame[face])) >= params.least_frames:
            found.append((at, int(face.sum())))
    return found
