"""Inside of a compartment behind an open front: rear board, sides and shelves, as peaks in histograms of depth points."""

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
    """Tuned parameters of the boards of a compartment."""

    ajar_rad: float = param(float(np.deg2rad(25.0)), "rad", "Minimum opening angle of a door to see behind it")
    ajar_m: float = param(0.08, "m", "Minimum opening of a drawer or a sliding leaf to see behind it")
    deepest_m: float = param(0.75, "m", "Maximum depth of a compartment behind its front", source="worktops are 600-700 mm")
    shallowest_m: float = param(0.12, "m", "Minimum distance of a rear board behind the front")
    rim_m: float = param(0.03, "m", "Margin inside the front's outline: boards are 16-20 mm, with depth errors at their edges")
    bin_m: float = param(0.004, "m", "Bin size of the histograms of depth points", gt=0)
    spread_m: float = param(0.012, "m", "Maximum distance from a face of depth points on it: their noise", gt=0)
    beside_m: float = param(0.05, "m", "Distance beside a face within which there must be few points: clutter is spread evenly")
    least_points: int = param(80, "count", "Minimum number of depth points on a face", ge=10)
    least_frames: int = param(3, "count", "Minimum number of frames that must show a face", ge=1)
    sharp: float = param(3.0, "ratio", "Minimum ratio of points on a face to those beside it, over equal lengths", gt=1)
    spans: float = param(0.4, "share", "Minimum fraction of the front's width that a rear board or shelf must span")
    shows: float = param(
        0.15,
        "share",
        "Minimum points of a shelf as a fraction of those of the clearest level: fewer are objects on a shelf",
        gt=0,
    )
    boards_m: tuple[float, ...] = param(
        (0.01, 0.06), "m", "Minimum and maximum thickness of a unit's boards and of a machine's walls"
    )
    apart_m: float = param(0.08, "m", "Minimum distance between two shelves")
    edge_m: float = param(
        0.02, "m", "Width of the rim of a front's outline that shows its edge: depth errs there by as much", gt=0
    )
    thin_m: tuple[float, float] = param((0.01, 0.02), "m", "Range behind the outer face in which every board has its edge")
    thick_m: float = param(
        0.035, "m", "Minimum thickness of a front that is thicker than a board: depth blurs its edges by a pixel"
    )
    thickest_m: float = param(0.1, "m", "Maximum thickness of a front: surface farther behind belongs to the side of a drawer")
    free: float = param(
        0.99, "ratio", "Minimum displacement of freely moving points relative to that of the leaf's centre", gt=0
    )
    ends: float = param(
        0.15, "share", "Points of an edge, as a fraction of its usual count near the face, below which the edge has ended", gt=0
    )
    beyond: float = param(
        0.05, "ratio", "Maximum ratio of points behind a rear board to those on it: depth looks past a row of jars", gt=0
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Cloud:
    """Depth points of a compartment in the front frame, y from the outer face backwards, and the frame index of each."""

    points: Points
    frame: np.ndarray
    rest_y: np.ndarray  # distance behind the outer face of the closed front

    def where(self, keep: np.ndarray) -> "_Cloud":
        return _Cloud(self.points[keep], self.frame[keep], self.rest_y[keep])


def measure_inside(
    leaf: Leaf,
    place: Callable[[Frame], Rigid3 | None],
    scene: Scene,
    *,
    drawn_out_m: float = 0.0,
    deepest_m: float = np.inf,
) -> Inside | None:
    """Dimensions of a front's compartment, or of the drawer that it pulls out; None where none of its boards was observed.

    `place` is world_from_front of the measured body in the frames that show its inside, None in others: a drawer's box moves
    with its front, a carcass does not. `drawn_out_m` is the maximum opening of a drawer: its rear board stays in the unit.
    The unit ends `deepest_m` behind the front.
    """
    params = tuned(Params)
    before, left, right, rear = _between_walls(leaf, place, scene, drawn_out_m, deepest_m)
    depth_m = None if rear is None else rear - leaf.thickness_m
    if drawn_out_m > 0:
        return None if depth_m is None else Inside(depth_m=depth_m)
    levels = _faces(before, 2, across=0, least_span_m=params.spans * leaf.width_m)
    most = max((count for _, count in levels), default=0)
    level = sorted(at for at, count in levels if count > params.shows * most)
    bottom, top = _ends(level, leaf.half_m[1])
    found = Inside(
        depth_m=depth_m,
        width_m=_between(left, right),
        height_m=_between(bottom, top),
        shelves_m=()
        if bottom is None
        else tuple(at - bottom for at in level if bottom + params.apart_m < at < (top or np.inf)),
    )
    return None if found == Inside() else found


def drawer_walls(
    leaf: Leaf, place: Callable[[Frame], Rigid3 | None], scene: Scene, drawn_out_m: float
) -> tuple[float | None, float | None, float | None]:
    """Inner faces of a drawer's left and right side (x) and rear board (y) in the front frame; None where not observed.

    `place` and `drawn_out_m` as for `measure_inside`.
    """
    return _between_walls(leaf, place, scene, drawn_out_m, np.inf)[1:]


def _between_walls(
    leaf: Leaf, place: Callable[[Frame], Rigid3 | None], scene: Scene, drawn_out_m: float, deepest_m: float
) -> tuple[_Cloud, float | None, float | None, float | None]:
    """Points between a compartment's front and rear board; the inner faces of its left and right side, and of that board."""
    params, half = tuned(Params), np.array(leaf.half_m)
    cloud = _behind(leaf, place, scene, min(deepest_m, params.deepest_m))
    within = (np.abs(cloud.points[:, 0]) < half[0] - params.rim_m) & (np.abs(cloud.points[:, 2]) < half[1] - params.rim_m)
    rear = _rear(cloud.where(within), leaf, drawn_out_m)
    y = cloud.points[:, 1]
    between = cloud.where((y > leaf.thickness_m + params.rim_m) & (y < (rear or np.inf) - params.rim_m))
    left, right = _ends([at for at, _ in _faces(between, 0, across=1, least_span_m=params.rim_m)], leaf.half_m[0])
    return between, left, right, rear


def front_thickness(leaf: Leaf, place: Callable[[Frame], Rigid3 | None], scene: Scene) -> float | None:
    """Thickness of a front, by how far its free edges extend behind its outer face; None where no edge shows its end.

    Depth blurs edges by a pixel: one that ends within it is a board's, of usual thickness. `place` is world_from_leaf in the
    frames that show it open. At its hinge and beyond, the unit lies behind the leaf.
    """
    params, (half_w, half_h) = tuned(Params), leaf.half_m
    cloud = _behind(leaf, place, scene, params.thickest_m + params.edge_m)
    free = cloud.where(_free(cloud, leaf, place, scene))
    x, y, z = free.points.T
    found = []
    for along, half in ((x, half_w), (-x, half_w), (z, half_h), (-z, half_h)):
        edges = np.arange(params.thin_m[0], params.thickest_m + params.bin_m, params.bin_m)
        count, _ = np.histogram(y[along > half - params.edge_m], edges)
        thin = count[edges[:-1] < params.thin_m[1]]
        ended = np.flatnonzero(count < params.ends * thin.mean())
        if thin.sum() >= params.least_points and len(ended) > 0:
            found.append((int(thin.sum()), float(edges[ended[0]])))
    thick = [each for each in found if each[1] > params.thick_m]
    if thick:
        return max(thick)[1]
    return tuned(LeafParams).thickness_m if found else None


def _free(cloud: _Cloud, leaf: Leaf, place: Callable[[Frame], Rigid3 | None], scene: Scene) -> np.ndarray:
    """Mask of the points (n,) on the part of a leaf that moves at least about as far as its centre."""
    moved = {}
    for frame in scene.frames:
        world_from_leaf = place(frame)
        if world_from_leaf is not None:
            turn = leaf.world_from_front.inverse @ world_from_leaf
            moved[frame.index] = (turn.rotation - np.eye(3), turn.translation)
    if not len(cloud.frame):
        return np.zeros(0, bool)
    turned, shifted = (np.stack([moved[int(n)][k] for n in cloud.frame]) for k in (0, 1))
    way = np.linalg.norm(np.einsum("nij,nj->ni", turned, cloud.points) + shifted, axis=1)
    return np.asarray(way > tuned(Params).free * np.linalg.norm(shifted, axis=1))


def _behind(leaf: Leaf, place: Callable[[Frame], Rigid3 | None], scene: Scene, deepest_m: float) -> _Cloud:
    found, numbers, rest = [np.zeros((0, 3))], [np.zeros(0, int)], [np.zeros(0)]
    for frame in scene.frames:
        world_from_front = place(frame)
        if world_from_front is None:
            continue
        depth = scene.depth(frame.index)
        seen = depth_points(depth, frame.depth_camera)[depth > 0].astype(np.float64)
        local = (world_from_front.inverse @ frame.world_from_camera).apply(seen)
        keep = leaf.covers(local) & (local[:, 1] > 0) & (local[:, 1] < deepest_m)
        found.append(local[keep])
        numbers.append(np.full(int(keep.sum()), frame.index))
        rest.append(leaf.world_from_front.inverse.apply(world_from_front.apply(local[keep]))[:, 1])
    return _Cloud(np.concatenate(found), np.concatenate(numbers), np.concatenate(rest))


def _rear(cloud: _Cloud, leaf: Leaf, drawn_out_m: float) -> float | None:
    """Position of the rear board's face, the farthest one perpendicular to the depth; None where depth looks past it.

    Past a drawer's rear board one sees into the unit, which stays where it is while the drawer moves.
    """
    params = tuned(Params)
    faces = _faces(cloud, 1, across=0, least_span_m=params.spans * leaf.width_m)
    if drawn_out_m > 0:
        faces = [(at, count) for at, count in faces if _comes_along(cloud, at, count, drawn_out_m)]
    rear, count = max(((at, count) for at, count in faces if at > params.shallowest_m), default=(None, 0))
    if rear is None or drawn_out_m > 0:
        return rear
    beyond = np.count_nonzero(cloud.points[:, 1] > rear + params.beside_m)
    return rear if beyond < params.beyond * count else None


def _comes_along(cloud: _Cloud, at: float, count: int, drawn_out_m: float) -> bool:
    """Whether a face has more points when it moves with the drawer than when it stays in the unit.

    Where the drawer did not move the two coincide: then only a face that lies in the unit even so counts as a rear board.
    """
    spread_m = tuned(Params).spread_m
    stands_at = np.median(cloud.rest_y[np.abs(cloud.points[:, 1] - at) < spread_m])
    stays = np.count_nonzero(np.abs(cloud.rest_y - stands_at) < spread_m)
    return bool(count > stays or (count == stays and at > drawn_out_m + tuned(Params).rim_m))


def _ends(faces: list[float], half_m: float) -> tuple[float | None, float | None]:
    """Innermost faces of the boards at both ends; None where one was not observed."""
    thinnest, thickest = tuned(Params).boards_m
    ends = [at for at in faces if half_m - thickest < abs(at) < half_m - thinnest]
    return max((at for at in ends if at < 0), default=None), min((at for at in ends if at > 0), default=None)


def _between(low: float | None, high: float | None) -> float | None:
    return None if low is None or high is None else high - low


def _faces(cloud: _Cloud, axis: int, *, across: int, least_span_m: float) -> list[tuple[float, int]]:
    """Positions and point counts of flat faces perpendicular to an axis: histogram peaks that span far enough across."""
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
