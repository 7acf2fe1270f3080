"""A body of revolution from all views at once: its axis, and the radius at each height, by dynamic programming.

Seen from any side, an upright body of revolution is the same picture about its axis. Every photograph is drawn on the upright
plane through the axis that faces its camera: there a radius and a height are one place, in all views and on both sides of the
axis. What stands elsewhere (a neighbour, a pattern of the wall, a shadow on it) lies at another place in each view. So the mean
over views of the log-odds of being the thing, by depth and by colours, and of the colour edges is the evidence for a profile,
and the most probable profile is a shortest path through heights (Viterbi), the borders costing less on colour edges.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import NamedTuple

import numpy as np

from r2c2r_core.arrays import Vector3
from r2c2r_core.segment.planes import PlaneRegion
from r2c2r_core.segment.scene import Scene
from r2c2r_core.segment.things.profile import Colours, Profile, best_profile, learn_behind, profile_evidence
from r2c2r_core.segment.things.silhouettes import usual_shift
from r2c2r_core.segment.things.strips import Grid, Site, Strips, View, draw_strips, views_of
from r2c2r_core.segment.things.support import pose_spread
from r2c2r_core.segment.things.thing import Thing, ThingConfig, support_height
from r2c2r_core.segment.viewpoints import best_views
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """How a body of revolution is found."""

    frames: int = param(18, "count", "that are asked", ge=2)
    search_frames: int = param(8, "count", "of them, among which the axis is looked for", ge=2)
    pose_share: float = param(
        0.08, "share", "of a thing's width, that frames may err by about where it is: edges of more do not meet"
    )
    cells: int = param(60, "count", "of radii, from the axis to the widest that is looked for", ge=8)
    levels: int = param(90, "count", "of heights, from the support to the tallest that is looked for", ge=8)
    coarse: float = param(3.0, "ratio", "of the cells in which the axis is looked for, to those", ge=1)
    widest: float = param(0.85, "ratio", "of the widest radius that is looked for to the usual width", gt=0)
    tallest: float = param(1.15, "ratio", "of the tallest that is looked for to the tallest of the kind", gt=0)
    off_wall_m: float = param(0.03, "m", "before what a click fell on: nearer points are its own")
    start_m: float = param(0.024, "m", "first step of the axis")
    last_m: float = param(0.0015, "m", "last step of the axis", gt=0)
    margin_m: float = param(0.006, "m", "about the border, from where no colours are learned")
    rounds: int = param(3, "count", "of a profile by colours, colours by that profile", ge=1)
    meets_m: float = param(0.008, "m", "beside the body, that a click may fall: blur and pose error")
    spacing_m: float = param(0.003, "m", "between the points of its surface", gt=0)
    pose_error_m: float = param(0.008, "m", "how far a frame may show it from where it stands: those of all views agreed")
    border_m: float = param(
        0.002,
        "m",
        "how far its outline may be off",
        source="masks of four bottles of a second generator: IoU 0.966, by 3 mm 0.952",
    )
    handle_m: float = param(0.035, "m", "about a vessel's body, where its handle may be")
    upright_cos: float = param(0.7, "cosine", "with up, of a normal on what stands, at most")
    places: int = param(2, "count", "before what a click fell on, that are tried", ge=0)
    least_share: float = param(0.2, "share", "of the width's square that the surface standing at such a place has, at least")
    before_m: float = param(0.6, "m", "before what a click fell on, where it may have been meant")


class Sight(NamedTuple):
    """The line of sight of a click, world."""

    origin: Vector3
    ray: Vector3  # unit


class Body(NamedTuple):
    """A profile about its axis."""

    foot: Vector3  # of the axis, world
    grid: Grid
    profile: Profile
    colours: Colours
    strips: Strips  # of the views it was found in, drawn about that axis

    @property
    def radii_m(self) -> np.ndarray:
        """Of the levels up to its top."""
        return np.trim_zeros(self.profile.cells, "b") * self.grid.cell_m


def find_round(
    scene: Scene,
    on: Sequence[Sight],
    off: Sequence[Sight],
    click: Vector3,
    config: ThingConfig,
    structure: tuple[PlaneRegion, ...],
) -> Thing | None:
    """The body of revolution that all sights `on` it meet and none of those `off` it; `click` is where the first one ended.

    Depth loses necks, and a click on one ends behind the body: then it is looked for before that place. None where views show
    no such body, or frames disagree about where it stands.
    """
    slack = tuned(Params).meets_m
    for point in chain([click], _standing_before(scene, on[0], click, config)):
        support = support_height(scene, point[None], config)
        body = None if support is None else find_body(scene, point, support, config, structure)
        if body is None or not all(meets(body, sight, slack) for sight in on) or any(meets(body, sight, 0.0) for sight in off):
            continue
        thing = _thing_of(body, config)
        frames = best_views(scene, thing.vertices.mean(axis=0), tuned(Params).search_frames)
        if usual_shift(thing, scene, frames) <= _borne(config):
            return thing
    return None


def find_body(
    scene: Scene, point: Vector3, support_z_m: float, config: ThingConfig, structure: tuple[PlaneRegion, ...]
) -> Body | None:
    """The body of revolution about a point of its surface (world); None where no view shows one, or their poses disagree."""
    params = tuned(Params)
    width = _width(config)
    foot = np.array([point[0], point[1], support_z_m])
    radius, tallest = params.widest * width, params.tallest * config.tallest_m
    views = list(views_of(scene, best_views(scene, point, params.frames), foot, radius, tallest))
    if len(views) < 2 or pose_spread([view.lift_m for view in views]) > _borne(config):
        return None
    site = Site(scene, structure, foot, radius, width / 2)
    fine = Grid(radius / params.cells, tallest / params.levels, params.cells, params.levels)
    coarse = Grid(
        fine.cell_m * params.coarse,
        fine.level_m * params.coarse,
        round(params.cells / params.coarse),
        round(params.levels / params.coarse),
    )
    some = views[:: max(1, round(len(views) / params.search_frames))]
    colours = _colours_by_depth(draw_strips(some, site, foot, coarse), coarse, site.radius_m)
    steps = np.arange(-2, 3) * site.radius_m / 2
    start = [foot + np.array([x, y, 0.0]) for x in steps for y in steps]
    body = max((_at(some, site, place, coarse, colours) for place in start), key=_score)
    step = params.start_m
    for _ in range(params.rounds):
        body = _best_axis(some, site, body, colours, step)
        if body.profile.score <= 0:
            return None
        colours, step = _colours(body), 2 * coarse.cell_m
    body = _at(views, site, body.foot, fine, colours)
    body = _coloured(body, _colours(body))
    return body if body.profile.score > 0 and _bounded(body) else None


def _at(views: Sequence[View], site: Site, foot: Vector3, grid: Grid, colours: Colours) -> Body:
    """The best body on a given axis."""
    return _on_strips(draw_strips(views, site, foot, grid), foot, grid, colours)


def _coloured(body: Body, colours: Colours) -> Body:
    """The best body on the same axis by other colours."""
    return _on_strips(body.strips, body.foot, body.grid, colours)


def _on_strips(strips: Strips, foot: Vector3, grid: Grid, colours: Colours) -> Body:
    return Body(foot, grid, best_profile(*profile_evidence(strips, colours)), colours, strips)


def _best_axis(views: Sequence[View], site: Site, start: Body, colours: Colours, step_m: float) -> Body:
    """Compass search: the best body about another, in ever smaller steps, its surface where the click is."""
    best = _coloured(start, colours)
    around = [np.array([np.cos(angle), np.sin(angle), 0.0]) for angle in np.arange(8) * np.pi / 4]
    while step_m >= tuned(Params).last_m:
        places = [best.foot + step_m * offset for offset in around]
        places = [place for place in places if np.hypot(*(place - site.near)[:2]) < site.reach_m]
        found = max((_at(views, site, place, best.grid, colours) for place in places), key=_score, default=best)
        if found.profile.score > best.profile.score:
            best = found
        else:
            step_m /= 2
    return best


def _score(body: Body) -> float:
    return body.profile.score


def _colours_by_depth(strips: Strips, grid: Grid, reach_m: float) -> Colours:
    """Colours of what depth shows near an axis against those of what it shows behind."""
    near = np.abs(grid.across) < reach_m
    return learn_behind(strips, (strips.depth_odds > 0) & near, strips.depth_odds < 0)


def _colours(body: Body) -> Colours:
    """Colours on the body against those around it where depth does not show something standing, as a cap it lacks."""
    strips, margin = body.strips, tuned(Params).margin_m
    on, about = (body.grid.within(body.profile.cells, by) for by in (-margin, margin))
    return learn_behind(strips, on & (strips.depth_odds >= 0), ~about & (strips.depth_odds < 0))


def _bounded(body: Body) -> bool:
    """Whether it ends within what was looked at."""
    return bool(body.profile.cells.max() < body.grid.cells - 1 and body.profile.cells[-1] == 0)


def _width(config: ThingConfig) -> float:
    """About how wide it is."""
    return config.width_m or config.radius_m


def _borne(config: ThingConfig) -> float:
    """How far frames may err about where it is, metres."""
    return tuned(Params).pose_share * _width(config)


def meets(body: Body, sight: Sight, slack_m: float) -> bool:
    """Whether a sight meets the body, or passes this near."""
    origin, ray = sight
    radii = body.radii_m
    nearest = float((body.foot - origin)[:2] @ ray[:2]) / max(float(ray[:2] @ ray[:2]), 1e-9)
    reach = (float(radii.max()) + slack_m) / max(float(np.hypot(*ray[:2])), 1e-3)
    points = origin + np.linspace(nearest - reach, nearest + reach, 41)[:, None] * ray
    height = points[:, 2] - body.foot[2]
    level = np.clip(height / body.grid.level_m, 0, len(radii) - 1).astype(int)
    near = np.hypot(*(points - body.foot).T[:2]) < radii[level] + slack_m
    return bool((near & (height > -slack_m) & (height < len(radii) * body.grid.level_m + slack_m)).any())


def _standing_before(scene: Scene, sight: Sight, hit: Vector3, config: ThingConfig) -> Iterator[Vector3]:
    """Places of the fused surface under a click's ray, before what it fell on: depth loses necks, the ray goes past them."""
    params = tuned(Params)
    (origin, ray), width = sight, _width(config)
    plan = ray[:2] / max(float(np.hypot(*ray[:2])), 1e-6)
    middle = hit - 0.5 * params.before_m * np.array([*plan, 0.0])
    faces = scene.parts.faces_near(middle, params.before_m / 2 + width, any_height=True)
    points, upward, areas = scene.parts.middles[faces], scene.parts.upward[faces], scene.parts.areas_m2[faces]
    away = (points - origin)[:, :2] @ plan
    beside = np.abs((points - origin)[:, :2] @ np.array([-plan[1], plan[0]]))
    ray_z = origin[2] + away * ray[2] / max(float(np.hypot(*ray[:2])), 1e-6)
    end = float((hit - origin)[:2] @ plan)
    upright = (beside < width / 2) & (np.abs(upward) < params.upright_cos)
    under = upright & (points[:, 2] < ray_z + params.meets_m) & (points[:, 2] > ray_z - config.tallest_m)
    under &= (away < end - params.off_wall_m) & (away > end - params.before_m)
    if not under.any():
        return
    step = width / 2
    bins = ((end - away[under]) / step).astype(int)
    found = np.bincount(bins, areas[under])
    for peak in np.argsort(-found, kind="stable")[: params.places]:
        if found[peak] > params.least_share * width**2:
            yield np.average(points[under][bins == peak], axis=0, weights=areas[under][bins == peak])


def _thing_of(body: Body, config: ThingConfig) -> Thing:
    """Its surface as points."""
    params = tuned(Params)
    spacing = max(body.grid.cell_m, params.spacing_m)
    radii, level_m = body.radii_m, body.grid.level_m
    rings = [*zip(radii, (np.arange(len(radii)) + 0.5) * level_m, strict=True)]
    borders = zip([0.0, *radii], [*radii, 0.0], np.arange(len(radii) + 1) * level_m, strict=True)
    for below, above, height in borders:  # lids and shoulders
        low, high = sorted((below, above))
        rings += [(radius, height) for radius in [*np.arange(low, high, spacing), high]]
    circles = []
    for radius, height in rings:
        angles = np.linspace(0.0, 2 * np.pi, max(1, round(2 * np.pi * radius / spacing)), endpoint=False)
        circles.append(np.column_stack([radius * np.cos(angles), radius * np.sin(angles), np.full(len(angles), height)]))
    return Thing(
        np.concatenate(circles) + body.foot,
        np.zeros((0, 3), np.int64),
        float(body.foot[2]),
        spacing,
        pose_error_m=params.pose_error_m,
        border_m=params.border_m,
        attached_m=params.handle_m if config.handled else 2 * params.border_m,
        colours=body.colours.all,
    )
