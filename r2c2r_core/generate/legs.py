"""Chairs, stools and tables: a level slab on four posts, completed where a table or the slab itself occludes its support.

Seen from above, the space under a seat is hidden, and carving leaves it solid. But a slab needs support down to the floor:
posts that depth shows give their thickness and slant (masks often miss dark legs), and the other corners get the same,
mirrored, where free space allows one.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np

from r2c2r_core.arrays import Faces, Points, Vector3
from r2c2r_core.generate.carved import Carving
from r2c2r_core.generate.evidence import View
from r2c2r_core.generate.relief import BoxPart
from r2c2r_core.geometry.camera import depth_points
from r2c2r_core.geometry.least_squares import cauchy, fit_linear
from r2c2r_core.geometry.meshes import box_mesh
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of slabs on posts."""

    cell_m: float = param(0.02, "m", "Side of the cells in plan", gt=0)
    level_m: float = param(0.015, "m", "Half the height interval within which points form a level sheet")
    tilted: float = param(
        2.0,
        "ratio",
        "Tolerance of a slab's height at its ends, relative to level_m: pose errors tilt it by half a degree",
        ge=1,
    )
    least_area: float = param(0.3, "share", "Minimum fraction of the object's plan that its slab covers")
    lowest: float = param(0.3, "share", "Minimum height of the slab, relative to the object's height")
    highest_m: float = param(1.15, "m", "Maximum height of a slab")
    slab_m: float = param(0.05, "m", "Thickness of a slab where it is not observed")
    slab_range_m: tuple[float, float] = param((0.02, 0.12), "m", "Minimum and maximum thickness of a slab")
    post_m: float = param(0.045, "m", "Width of a post where it is not observed")
    post_range_m: tuple[float, float] = param((0.025, 0.11), "m", "Minimum and maximum width of a post")
    rim_m: float = param(0.03, "m", "Width of the strip along a slab's outline that counts as its edge")
    least_rim: int = param(20, "count", "Minimum number of edge points in the first height step")
    corner_m: float = param(0.10, "m", "Maximum distance of a post from its corner")
    lean: float = param(0.35, "ratio", "Maximum slant of a post, sideways to down")
    step_m: float = param(0.03, "m", "Height interval at which depth must show a post", gt=0)
    least_steps: int = param(5, "count", "Minimum number of heights that show a post")
    least_points: int = param(8, "count", "Minimum number of points of a post at each height")
    to_edge_m: float = param(0.06, "m", "Distance from the object's end within which a slab is extended to it")
    edge_m: tuple[float, float] = param(
        (0.02, 0.16),
        "m",
        "Range below a slab in which its edge is measured: the first two centimetres may be rounded",
    )
    edge_step_m: float = param(0.01, "m", "Height interval in which edge points are counted", gt=0)
    edge_ends: float = param(0.3, "share", "Fraction of the first interval's points below which the edge has ended")
    seat_m: float = param(0.002, "m", "Depth to which a post reaches into its slab")
    outside_m: float = param(0.02, "m", "Maximum distance of a post outside its slab")
    line_m: float = param(0.01, "m", "Scale of the robust kernel on distances from a post's line")
    steady_m: float = param(0.02, "m", "Maximum median distance from a post's line")
    closed: float = param(
        0.5, "share", "Fraction of the height below a slab, filled wider than a post, above which the side is closed"
    )
    inwards: tuple[float, float, float] = param(
        (0.0, 0.25, 0.5), "share", "Candidate positions of a leg, as fractions of the way from its corner to the slab's centre"
    )
    empty: float = param(0.7, "share", "Fraction of a post's height observed free above which no post is there")


class Post(NamedTuple):
    """A leg from the floor to a slab, local frame."""

    top: Vector3  # centre of its upper end
    lean: np.ndarray  # (2,) horizontal metres per metre of height
    width_m: float
    floor_m: float
    is_seen: bool

    def surface(self) -> tuple[Points, Faces]:
        """Closed surface of the post."""
        half = np.array([self.width_m / 2, self.width_m / 2])
        vertices, faces = box_mesh(np.append(self.top[:2] - half, self.floor_m), np.append(self.top[:2] + half, self.top[2]))
        vertices[:, :2] += self.lean * (vertices[:, 2:] - self.top[2])
        return vertices, faces


class Support(NamedTuple):
    """A level slab and the posts it stands on, local frame."""

    slab: BoxPart
    posts: tuple[Post, ...]


def find_support(carving: Carving, views: Sequence[View]) -> Support | None:
    """The observed slab and its four posts; None without a floor or a slab, with a closed side or an empty corner."""
    params = tuned(Params)
    seen, points = carving.seen, carving.seen.points
    if seen.floor is None:
        return None
    level = _slab_level(points, seen.floor, float(seen.high[2]), np.ptp(points[:, :2], axis=0))
    if level is None:
        return None
    on_slab = points[np.abs(points[:, 2] - level) < params.tilted * params.level_m, :2]
    low, high = np.percentile(on_slab, 1, axis=0), np.percentile(on_slab, 99, axis=0)
    low = np.where(low - seen.low[:2] < params.to_edge_m, seen.low[:2], low)
    high = np.where(seen.high[:2] - high < params.to_edge_m, seen.high[:2], high)
    slab = BoxPart(np.append(low, level - _thickness(points, level, low, high)), np.append(high, level))
    if _has_closed_side(points, slab, seen.floor):
        return None
    under = _points_under(slab, seen.floor, views, seen.world_from_local)
    corners = [(x, y) for x in (0, 1) for y in (0, 1)]
    seen_posts = {corner: _seen_post(under, slab, corner, seen.floor) for corner in corners}
    posts = tuple(seen_posts[corner] or _likely_post(seen_posts, slab, corner, seen.floor) for corner in corners)
    width = float(np.mean([post.width_m for post in posts]))  # each is seen from one side and partly occluded
    posts = tuple(post._replace(width_m=width) for post in posts)
    inwards = (0.0,) if any(post.is_seen for post in posts) else params.inwards
    standing = [post if post.is_seen else _where_not_empty(carving, slab, post, inwards) for post in posts]
    found = tuple(post for post in standing if post is not None)
    return Support(slab, found) if len(found) == len(posts) else None


def _slab_level(points: Points, floor: float, top: float, plan: np.ndarray) -> float | None:
    """Height at which the points cover most of the plan; None if they cover too little."""
    params = tuned(Params)
    lowest, highest = floor + params.lowest * (top - floor), min(top, floor + params.highest_m)
    best, level = params.least_area * float(np.prod(plan)), None
    for z in np.arange(lowest, highest + params.level_m, params.level_m):
        inside = points[np.abs(points[:, 2] - z) < params.level_m]
        cells = np.unique(np.floor(inside[:, :2] / params.cell_m).astype(int), axis=0)
        area = len(cells) * params.cell_m**2
        if area > best:
            best, level = area, float(np.median(inside[:, 2]))
    return level


def _thickness(points: Points, level: float, low: np.ndarray, high: np.ndarray) -> float:
    """Thickness of the slab from the points of its edge between the corners."""
    params = tuned(Params)
    near = (points[:, :2] > low - params.cell_m).all(axis=1) & (points[:, :2] < high + params.cell_m).all(axis=1)
    at_edge = ((points[:, :2] < low + params.rim_m) | (points[:, :2] > high - params.rim_m)).any(axis=1)
    in_corner = ((points[:, :2] < low + params.corner_m) | (points[:, :2] > high - params.corner_m)).all(axis=1)
    below = level - points[near & at_edge & ~in_corner, 2]
    counts = np.histogram(below, bins=np.arange(*params.edge_m, params.edge_step_m))[0]
    if counts[0] < params.least_rim:
        return params.slab_m
    ends = np.flatnonzero(counts < params.edge_ends * counts[0])
    steps = ends[0] if len(ends) else len(counts)
    return float(np.clip(params.edge_m[0] + params.edge_step_m * steps, *params.slab_range_m))


def _has_closed_side(points: Points, slab: BoxPart, floor: float) -> bool:
    """Whether the object's own points below the slab's rim, between its corners, are wider than a post at most heights.

    Without this check, a closed side that is cut off around a corner and seen at a slant is as slender as a post.
    """
    params = tuned(Params)
    from scipy import ndimage

    low, high = slab.low[:2], slab.high[:2]
    lowest, highest = floor + params.step_m, float(slab.low[2])
    if highest - lowest < params.step_m:
        return False
    corner = np.minimum(params.corner_m, (high - low) / 4)
    between = (points[:, :2] > low + corner) & (points[:, :2] < high - corner)
    wide = np.ones((round(1.5 * params.post_range_m[1] / params.cell_m), 1), bool)  # a post that noise blurs is still narrower
    for axis, edge in product((0, 1), (low, high)):
        along = 1 - axis
        side = points[between[:, along] & (np.abs(points[:, axis] - edge[axis]) < params.corner_m)]
        cells = max(int((high - low)[along] / params.cell_m), 1), int((highest - lowest) / params.step_m)
        span = [[low[along], high[along]], [lowest, highest]]
        filled = np.histogram2d(side[:, along], side[:, 2], bins=cells, range=span)[0] > 0
        if ndimage.binary_erosion(filled, wide).any(axis=0).mean() > params.closed:
            return True
    return False


def _points_under(slab: BoxPart, floor: float, views: Sequence[View], world_from_local: Rigid3) -> list[tuple[Points, Vector3]]:
    """Each view's depth points between slab and floor, regardless of the mask, and its camera centre."""
    params = tuned(Params)
    found = []
    low, high = slab.low[:2] - params.corner_m, slab.high[:2] + params.corner_m
    for view in views:
        local_from_camera = world_from_local.inverse @ view.world_from_camera
        points = local_from_camera.apply(depth_points(view.depth_m, view.depth_camera)[view.depth_m > 0])
        inside = (points[:, 2] > floor + params.step_m) & (points[:, 2] < slab.low[2])
        inside &= (points[:, :2] > low).all(axis=1) & (points[:, :2] < high).all(axis=1)
        found.append((points[inside], local_from_camera.translation))
    return found


def _seen_post(under: Sequence[tuple[Points, Vector3]], slab: BoxPart, corner: tuple[int, int], floor: float) -> Post | None:
    """The post at a corner, where depth shows a slender one over most of its height."""
    params = tuned(Params)
    outer = np.array([(slab.low, slab.high)[corner[k]][k] for k in (0, 1)])
    middles, widths = [], []
    for points, eye in under:
        reach = params.corner_m + params.lean * (slab.low[2] - points[:, 2])
        near = points[(np.abs(points[:, :2] - outer) < reach[:, None]).all(axis=1)]
        away = outer - eye[:2]
        away /= max(float(np.linalg.norm(away)), 1e-9)
        across = near[:, :2] @ np.array([away[1], -away[0]])
        for z in np.arange(floor + params.step_m, slab.low[2], params.step_m):
            level = np.abs(near[:, 2] - z) < params.step_m / 2
            if np.count_nonzero(level) < params.least_points:
                continue
            width = float(np.ptp(np.percentile(across[level], [5, 95]))) / float(
                np.abs(away).sum()
            )  # width of a square post seen at an angle
            if width < params.post_range_m[1]:
                middles.append(np.append(np.median(near[level, :2], axis=0) + width / 2 * away, z))
                widths.append(width)
    line = _steady_line(np.array(middles).reshape(-1, 3))
    if line is None:
        return None
    lean, offset = line
    top = np.append(lean * slab.low[2] + offset, slab.low[2] + params.seat_m)
    inside = (top[:2] > slab.low[:2] - params.outside_m).all() and (top[:2] < slab.high[:2] + params.outside_m).all()
    width = float(np.clip(np.median(widths), *params.post_range_m))
    return Post(top, lean, width, floor, True) if inside and (np.abs(lean) < params.lean).all() else None


def _steady_line(middles: Points) -> tuple[np.ndarray, np.ndarray] | None:
    """(x, y) as a line over z by IRLS; None with too few heights or if the points do not lie on a line."""
    params = tuned(Params)
    if len(np.unique(np.round(middles[:, 2] / params.step_m))) < params.least_steps:
        return None
    system = np.column_stack([middles[:, 2], np.ones(len(middles))])
    start = np.linalg.lstsq(system, middles[:, :2], rcond=None)[0]
    solution, _ = fit_linear(system, middles[:, :2], cauchy, params.line_m, rounds=9, start=start)
    off = np.linalg.norm(system @ solution - middles[:, :2], axis=1)
    return (solution[0], solution[1]) if np.median(off) < params.steady_m else None


def _likely_post(seen: dict[tuple[int, int], Post | None], slab: BoxPart, corner: tuple[int, int], floor: float) -> Post:
    """A corner's post as the mirror image of an observed one, left-right before front-back; without one, upright."""
    params = tuned(Params)
    middle = (slab.low + slab.high)[:2] / 2
    for flip in ((1, 0), (0, 1), (1, 1)):
        twin = seen[(corner[0] ^ flip[0], corner[1] ^ flip[1])]
        if twin is not None:
            sign = 1.0 - 2.0 * np.array(flip)
            return twin._replace(
                top=np.append(middle + sign * (twin.top[:2] - middle), twin.top[2]), lean=sign * twin.lean, is_seen=False
            )
    inset = params.post_m / 2
    at = [slab.high[k] - inset if corner[k] else slab.low[k] + inset for k in (0, 1)]
    return Post(np.array([*at, slab.low[2] + params.seat_m]), np.zeros(2), params.post_m, floor, False)


def _where_not_empty(carving: Carving, slab: BoxPart, post: Post, shares: Sequence[float]) -> Post | None:
    """An unobserved post at the first candidate position that was not observed free; None if all were."""
    middle = (slab.low + slab.high)[:2] / 2
    for inwards in shares:
        moved = post._replace(top=np.append(post.top[:2] + inwards * (middle - post.top[:2]), post.top[2]))
        if not _is_empty(carving, moved):
            return moved
    return None


def _is_empty(carving: Carving, post: Post) -> bool:
    """Whether most of the post's height was observed free."""
    params = tuned(Params)
    grid = carving.grid
    z = np.arange(post.floor_m + params.step_m, post.top[2], grid.voxel_m)
    along = np.column_stack([post.top[:2] + post.lean * (z - post.top[2])[:, None], z])
    index = np.clip(((along - grid.low) / grid.voxel_m).astype(int), 0, np.array(grid.shape) - 1)
    free = (carving.votes.free_m > 0).reshape(grid.shape)[tuple(index.T)]
    return bool(free.mean() > params.empty)
