"""Robust least-squares fit of an appliance's upright box: depth on faces, image edges, support, wall and usual sizes.

Every measurement is a residual over its standard deviation, under one robust kernel (Cauchy), for scipy's least_squares.
Edge candidates are associated by a Gaussian mixture (expectation-maximisation) whose spread shrinks from centimetres to the
noise (graduated non-convexity), from several initial depths.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from r2c2r_core.geometry.least_squares import cauchy_loss
from r2c2r_core.geometry.transforms import Rigid3, rotation_about_z
from r2c2r_core.kitchen.category import Category
from r2c2r_core.segment.appliances.edges import (
    BACK,
    BOTTOM,
    FRONT,
    LEFT,
    RIGHT,
    TOP,
    YAW,
    EdgeView,
    Photo,
    associate,
    displacements,
    edge_parts,
    look_across,
    photo_of,
    shares,
)
from r2c2r_core.segment.appliances.faces import Patches, patches_on
from r2c2r_core.segment.appliances.rear_edge import rear_edge
from r2c2r_core.segment.fronts.front import Front
from r2c2r_core.segment.mosaics.orthomosaic import Cell
from r2c2r_core.segment.scene import Scene
from r2c2r_core.segment.things.thing import ThingConfig, support_height
from r2c2r_core.segment.viewpoints import best_views
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the box fit."""

    yaw_rad: float = param(
        float(np.radians(1.5)), "rad", "Standard deviation of the initial plane's yaw, where glass leaves little depth"
    )
    front_m: float = param(0.008, "m", "Standard deviation of the initial plane's position")
    side_m: float = param(
        0.008,
        "m",
        "Standard deviation of the rectangle's left and right edges, the clearest lines on the orthomosaic",
        source="4 to 5 mm on the sample kitchens, 20 mm in one of eight",
    )
    top_m: float = param(
        0.025,
        "m",
        "Standard deviation of the rectangle's upper edge: a line of the door may be clearer",
        source="39 mm in one of eight on the sample kitchens",
    )
    bottom_m: float = param(
        0.010, "m", "Standard deviation of the rectangle's lower edge, which photographs do not refine: it lies in shadow"
    )
    support_m: float = param(0.004, "m", "Standard deviation of the support's height")
    end_m: float = param(0.005, "m", "Standard deviation of the left and right end of depth on the front")
    end_inset_m: float = param(
        0.009,
        "m",
        "Distance from the end of depth on a face to its edge",
        source="1 to 15 mm on six kitchens of both generators",
    )
    wall_m: float = param(0.010, "m", "Standard deviation of the wall behind")
    rear_m: float = param(
        0.003,
        "m",
        "Standard deviation of the ends of the interval in which depth begins to pass its sides and its top",
        source="3 mm rms on ten appliances of both generators",
    )
    distance_m: float = param(1.5, "m", "Camera distance at which the depth noise of the fused surface is evaluated")
    kernel: float = param(2.0, "σ", "Scale of the Cauchy kernel")
    spreads_m: tuple[float, ...] = param(
        (0.020, 0.010, 0.005, 0.003),
        "m",
        "Standard deviations of edge candidates per round of annealing: from the initial error of the box to the pose error",
    )
    reach_spreads: float = param(2.5, "σ", "Search distance of edge candidates, relative to that standard deviation")
    apart_m: float = param(
        0.01,
        "m",
        "Minimum difference between the depths of solutions that are refined separately",
        source="half the widest spread",
    )
    rounds: int = param(3, "count", "Number of expectation-maximisation rounds at each spread", ge=1)
    independent: float = param(
        4.0,
        "count",
        "Maximum number of photographs that count as independent about an edge: a line beside it misleads all alike",
    )
    photos: int = param(16, "count", "Maximum number of photographs used", ge=1)
    sure: float = param(
        0.5,
        "share",
        "Maximum standard deviation of a depth, relative to the spread of usual depths, for it to count as observed",
    )


_USUAL = slice(7, 10)  # residuals of usual sizes, after those of the rectangle
_STILL = 2e-4  # step (rad, m) below which the fit has converged
_SCALE = np.array([0.02, 0.01, 0.01, 0.01, 0.02, 0.01, 0.01])  # of the parameters, for the solver's trust region


class FittedBox(NamedTuple):
    """An appliance's front with its depth, and the covariance of its box."""

    front: Front
    covariance: np.ndarray  # (7, 7) of x, y, z of the centre (world, m), yaw (rad), width, depth and height (m)
    depth_seen: bool  # depth was observed, not the usual one of its category

    def warnings(self, category: str) -> tuple[str, ...]:
        """Warning about a depth that was not observed."""
        if self.depth_seen:
            return ()
        return (f"its depth was not seen: {self.front.depth_m:.2f} m is assumed, as for a {category}",)


class Evidence(NamedTuple):
    """Evidence that stays constant during the fit, in the front's frame."""

    start: np.ndarray
    kind: Category
    patches: Patches
    wall_m: float | None
    support_m: float | None
    sigma_m: float  # of a depth patch
    rear_m: np.ndarray = np.zeros((0, 2))  # intervals of y in which its top and its sides end


class _Edges(NamedTuple):
    """Target positions of edge parts in one photograph, and their weights (1/px)."""

    view: EdgeView
    target_px: np.ndarray
    weight: np.ndarray


class Solution(NamedTuple):
    box: np.ndarray
    information: np.ndarray  # (7, 7)
    cost: float  # negative log-likelihood ratio


def fit_box(front: Front, scene: Scene, kind: Category, wall_m: float | None, *, photographs: bool = True) -> FittedBox:
    """Box behind a front's rectangle, whose depth is an initial guess; `wall_m` is the distance of the wall behind it.

    Without photographs it uses depth alone, for a preview.
    """
    world_from_front, (half_w, half_h) = front.outline.world_from_front, front.outline.half_m
    middle = world_from_front.translation
    farthest = min(kind.depth.high, np.inf if wall_m is None else wall_m)
    start = np.array([0.0, -half_w, half_w, 0.0, min(kind.depth.usual, farthest), -half_h, half_h])
    deep = start.copy()
    deep[BACK] = farthest
    frames = best_views(scene, middle, tuned(Params).photos)
    support = support_height(scene, middle[None], ThingConfig(radius_m=half_w))
    evidence = Evidence(
        start,
        kind,
        patches_on(deep, scene, world_from_front),
        wall_m,
        None if support is None else support - float(middle[2]),
        float(scene.noise.sigma(tuned(Params).distance_m)),
    )
    photos = [photo_of(scene, frame) for frame in frames] if photographs else []
    found = solve(evidence, photos, world_from_front)
    turned = world_from_front @ Rigid3(rotation_about_z(float(found.box[YAW])), np.zeros(3))
    evidence = evidence._replace(rear_m=rear_edge(found.box, kind.depth, farthest, frames, scene, turned))
    if len(evidence.rear_m):
        found = refine_rear(evidence, photos, world_from_front, found.box)
    if not _possible(found.box, start):
        return FittedBox(replace(front, depth_m=float(start[BACK])), np.full((7, 7), np.nan), False)
    covariance = covariance_of(found, world_from_front)
    seen = np.sqrt(covariance[5, 5]) < tuned(Params).sure * kind.depth.usual * kind.depth.spread
    return FittedBox(_fitted_front(front, found.box), covariance, bool(seen))


def solve(evidence: Evidence, photos: Sequence[Photo], world_from_front: Rigid3) -> Solution:
    """Best box from several initial depths; its sides start from the wide spread's result and from the rectangle."""
    params = tuned(Params)

    def annealed(box: np.ndarray, spreads_m: Sequence[float]) -> Solution:
        return _annealed(evidence, photos, world_from_front, box, spreads_m)

    if not photos:  # no edge whose spread could shrink
        return min((annealed(start, params.spreads_m[:1]) for start in _starts(evidence)), key=_cost)
    coarse = sorted((annealed(start, params.spreads_m[:1]) for start in _starts(evidence)), key=_cost)
    # At the widest spread its own back and the shadow behind it are one edge: the likeliest solution per depth is refined.
    fine = min((annealed(found.box, params.spreads_m[1:]) for found in _apart(coarse, params.apart_m)), key=_cost)
    found = evidence.start[[LEFT, RIGHT]], _depth_sides(evidence.patches, fine.box)
    restarts = [np.concatenate([fine.box[:LEFT], sides, fine.box[FRONT:]]) for sides in found]
    return min(fine, *(annealed(start, params.spreads_m[2:]) for start in restarts), key=_cost)


def refine_rear(evidence: Evidence, photos: Sequence[Photo], world_from_front: Rigid3, box: np.ndarray) -> Solution:
    """Box refined with the ends of its sides, which are measured on its fitted faces; from its own back and from theirs."""
    behind = box.copy()
    behind[BACK] = evidence.rear_m.mean()
    spreads = tuned(Params).spreads_m[2:] if photos else tuned(Params).spreads_m[:1]
    return min((_annealed(evidence, photos, world_from_front, start, spreads) for start in (box, behind)), key=_cost)


def _depth_sides(patches: Patches, box: np.ndarray) -> np.ndarray:
    """Left and right side of the box, each at least as far out as depth on the front says."""
    inset = tuned(Params).end_inset_m
    left, right = patches.ends.get(LEFT, np.inf) - inset, patches.ends.get(RIGHT, -np.inf) + inset
    return np.array([min(box[LEFT], left), max(box[RIGHT], right)])


def _apart(solutions: Sequence[Solution], apart_m: float) -> list[Solution]:
    """First of the solutions whose backs lie within `apart_m` of each other."""
    kept: list[Solution] = []
    for solution in solutions:
        if all(abs(solution.box[BACK] - other.box[BACK]) > apart_m for other in kept):
            kept.append(solution)
    return kept


def _cost(solution: Solution) -> float:
    return solution.cost


def _starts(evidence: Evidence) -> list[np.ndarray]:
    """Initial boxes with several depths possible for the category in front of the wall."""
    size, first = evidence.kind.depth, float(evidence.start[BACK])
    farthest = size.high if evidence.wall_m is None else evidence.wall_m
    others = [(size.low + size.usual) / 2, (size.usual + size.high) / 2]
    depths = [first, *(depth for depth in others if size.low <= depth <= farthest)]
    return [np.concatenate([evidence.start[:BACK], [depth], evidence.start[BACK + 1 :]]) for depth in depths]


def _annealed(
    evidence: Evidence,
    photos: Sequence[Photo],
    world_from_front: Rigid3,
    box: np.ndarray,
    spreads_m: Sequence[float],
) -> Solution:
    """Box after expectation-maximisation at each spread in turn."""
    params = tuned(Params)
    from scipy.optimize import least_squares

    for spread in spreads_m:
        views = look_across(box, photos, world_from_front, params.reach_spreads * spread)
        counted = shares(views, params.independent)
        for _ in range(params.rounds):
            parts = edge_parts(box)
            found = [associate(displacements(parts, view), view, spread) for view in views]
            edges = [
                _Edges(view, at.target_px, at.weight * np.sqrt(n)) for view, at, n in zip(views, found, counted, strict=True)
            ]
            loss = _loss(len(_residuals(box, evidence, edges)))
            solved = least_squares(_residuals, box, args=(evidence, edges), loss=loss, x_scale=_SCALE, max_nfev=8)
            moved, box = np.abs(solved.x - box).max(), solved.x
            if moved < _STILL or not views:
                break
    parts = edge_parts(box)
    gain = sum(
        float(n @ associate(displacements(parts, view), view, spread).gain) for view, n in zip(views, counted, strict=True)
    )
    known = _residuals(box, evidence, []) ** 2
    return Solution(box, solved.jac.T @ solved.jac, float(0.5 * _loss(len(known))(known)[0].sum() - gain))


def _loss(count: int) -> Callable[[np.ndarray], np.ndarray]:
    """Cauchy loss of `count` residuals; those of usual sizes are purely quadratic."""
    scale = np.full(count, tuned(Params).kernel)
    scale[_USUAL] = np.inf
    return cauchy_loss(scale)


def _residuals(box: np.ndarray, evidence: Evidence, edges: Sequence[_Edges]) -> np.ndarray:
    """All residuals divided by their standard deviations."""
    params = tuned(Params)
    _, left, right, front, back, bottom, top = box
    thought = [params.yaw_rad, params.side_m, params.side_m, params.front_m, np.inf, params.bottom_m, params.top_m]
    sizes = zip(
        (right - left, back - front, top - bottom),
        (evidence.kind.width, evidence.kind.depth, evidence.kind.height),
        strict=True,
    )
    limits = []
    if evidence.wall_m is not None:
        limits.append(max(back - evidence.wall_m, 0.0) / params.wall_m)
    if evidence.support_m is not None:
        limits.append((bottom - evidence.support_m) / params.support_m)
    beyond = {face: (-1.0 if face == LEFT else 1.0) * (box[face] - at) for face, at in evidence.patches.ends.items()}
    limits += [min(past - params.end_inset_m, 0.0) / params.end_m for past in beyond.values()]
    limits += list((back - np.clip(back, *evidence.rear_m.T)) / params.rear_m)
    turned = rotation_about_z(float(box[YAW]))
    patches = evidence.patches
    off = (patches.points @ turned)[np.arange(len(patches.axis)), patches.axis] - box[patches.face]
    parts = edge_parts(box)
    matched = [(displacements(parts, edge.view) - edge.target_px) * edge.weight for edge in edges]
    return np.concatenate(
        [
            (box - evidence.start) / thought,
            [float(size.deviation(max(value, 0.02))) for value, size in sizes],
            limits,
            off / evidence.sigma_m,
            *matched,
        ]
    )


def _possible(box: np.ndarray, start: np.ndarray) -> bool:
    """Whether the fit kept at least half the rectangle and a depth of more than 5 cm."""
    width, height = box[RIGHT] - box[LEFT], box[TOP] - box[BOTTOM]
    return bool(width > start[RIGHT] and height > start[TOP] and box[BACK] - box[FRONT] > 0.05 and np.isfinite(box).all())


def _fitted_front(front: Front, box: np.ndarray) -> Front:
    """Front rotated about the vertical axis through its centre, moved, and with its edges at the box's."""
    middle, run, cell, cell_m = front.outline.centre, front.run, front.cell, front.run.grid.cell_m
    column, row = (cell.left + cell.right) / 2, (cell.top + cell.bottom) / 2
    moved = Cell(column + box[LEFT] / cell_m, row - box[TOP] / cell_m, column + box[RIGHT] / cell_m, row - box[BOTTOM] / cell_m)

    def placed(world_from_plane: Rigid3) -> Rigid3:
        turned = Rigid3(rotation_about_z(float(box[YAW])), middle) @ Rigid3(np.eye(3), -middle) @ world_from_plane
        return Rigid3(turned.rotation, turned.translation + box[FRONT] * turned.rotation[:, 1])

    grid = replace(run.grid, world_from_plane=placed(run.grid.world_from_plane))
    region = replace(run.region, world_from_plane=placed(run.region.world_from_plane))
    return replace(front, cell=moved, depth_m=float(box[BACK] - box[FRONT]), run=replace(run, grid=grid, region=region))


def covariance_of(solution: Solution, world_from_front: Rigid3) -> np.ndarray:
    """Covariance (7, 7) of the box's centre in the world, its yaw, width, depth and height."""
    box = solution.box
    middle = np.array([box[LEFT] + box[RIGHT], box[FRONT] + box[BACK], box[BOTTOM] + box[TOP]]) / 2
    turned = world_from_front.rotation @ rotation_about_z(float(box[YAW]))
    change = np.zeros((7, 7))
    change[:3, YAW] = turned @ np.array([-middle[1], middle[0], 0.0])
    for axis, pair in enumerate(((LEFT, RIGHT), (FRONT, BACK), (BOTTOM, TOP))):
        change[:3, pair] = turned[:, [axis]] / 2
        change[4 + axis, pair] = -1.0, 1.0
    change[3, YAW] = 1.0
    return np.asarray(change @ np.linalg.pinv(solution.information) @ change.T)
