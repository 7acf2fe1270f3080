"""Body of revolution from all views at once: its axis, and its radius at each height, by dynamic programming.

An upright body of revolution looks the same about its axis from every side. Each photograph is warped onto the vertical plane
through the axis that faces its camera: there a radius and a height are one place, in all views and on both sides of the
axis. Everything off the axis (a neighbour, a pattern or a shadow on the wall) lies at another place in each view. The evidence
for a profile is therefore the mean over views of the log-odds of the object, by depth and by colour, and of the colour edges;
the most probable profile is a shortest path through heights (Viterbi) in which borders cost less on colour edges.
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
    """Tuned parameters of the search for a body of revolution."""

    frames: int = param(18, "count", "Maximum number of frames used", ge=2)
    search_frames: int = param(8, "count", "Maximum number of those frames used in the search for the axis", ge=2)
    pose_share: float = param(
        0.08,
        "share",
        "Maximum pose error between frames, as a fraction of the object's width, for edges of different views to meet",
    )
    cells: int = param(60, "count", "Number of radius cells, from the axis to the largest radius searched", ge=8)
    levels: int = param(90, "count", "Number of height cells, from the support to the largest height searched", ge=8)
    coarse: float = param(3.0, "ratio", "Size of the cells of the axis search relative to the final cells", ge=1)
    widest: float = param(0.85, "ratio", "Largest radius searched relative to the usual width", gt=0)
    tallest: float = param(1.15, "ratio", "Largest height searched relative to the maximum height of the category", gt=0)
    off_wall_m: float = param(
        0.03,
        "m",
        "Minimum distance in front of the surface that a click hit for another surface on the ray: nearer points belong to it",
    )
    start_m: float = param(0.024, "m", "First step of the axis search")
    last_m: float = param(0.0015, "m", "Last step of the axis search", gt=0)
    margin_m: float = param(0.006, "m", "Margin on either side of the border in which no colours are learned")
    rounds: int = param(3, "count", "Number of alternations between fitting the profile and learning its colours", ge=1)
    meets_m: float = param(0.008, "m", "Maximum distance of a click's ray from the body: blur and pose error")
    spacing_m: float = param(0.003, "m", "Minimum distance between points of the sampled surface", gt=0)
    pose_error_m: float = param(0.008, "m", "Remaining pose error of the body in a frame, once all views agreed")
    border_m: float = param(
        0.002,
        "m",
        "Tolerance of the outline",
        source="masks of four bottles of a second generator: IoU 0.966, against 0.952 at 3 mm",
    )
    handle_m: float = param(0.035, "m", "Distance around a vessel's body within which its handle may lie")
    upright_cos: float = param(
        0.7, "cosine", "Maximum absolute cosine between a face normal and up for the face to belong to an upright surface"
    )
    places: int = param(
        2, "count", "Maximum number of places in front of the surface that a click hit where the body is tried", ge=0
    )
    least_share: float = param(0.2, "share", "Minimum upright surface area at such a place, as a fraction of the squared width")
    before_m: float = param(0.6, "m", "Maximum distance of such a place in front of the surface that the click hit")


class Sight(NamedTuple):
    """Line of sight of a click, in the world."""

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
        """Radii of the levels up to the top of the body."""
        return np.trim_zeros(self.profile.cells, "b") * self.grid.cell_m


def find_round(
    scene: Scene,
    on: Sequence[Sight],
    off: Sequence[Sight],
    click: Vector3,
    config: ThingConfig,
    structure: tuple[PlaneRegion, ...],
) -> Thing | None:
    """Body of revolution met by all sights `on` it and by none `off` it; `click` is where the first sight hit the surface.

    Depth loses thin necks, so a click on one hits the surface behind the body: then places in front of it are tried. None where
    the views show no such body, or where frames disagree about its position.
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
    """Body of revolution about a surface point (world); None where no view shows one, or where the frame poses disagree."""
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
    """Best body on a given axis."""
    return _on_strips(draw_strips(views, site, foot, grid), foot, grid, colours)


def _coloured(body: Body, colours: Colours) -> Body:
    """Best body on the same axis with other colour models."""
    return _on_strips(body.strips, body.foot, body.grid, colours)


def _on_strips(strips: Strips, foot: Vector3, grid: Grid, colours: Colours) -> Body:
    return Body(foot, grid, best_profile(*profile_evidence(strips, colours)), colours, strips)


def _best_axis(views: Sequence[View], site: Site, start: Body, colours: Colours, step_m: float) -> Body:
    """Compass search for the axis in ever smaller steps, within reach of the click."""
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
    """Colour models from depth alone: surface near an axis against surface behind it."""
    near = np.abs(grid.across) < reach_m
    return learn_behind(strips, (strips.depth_odds > 0) & near, strips.depth_odds < 0)


def _colours(body: Body) -> Colours:
    """Colour models of the body against its surroundings, without upright surface near it, such as a cap the profile lacks."""
    strips, margin = body.strips, tuned(Params).margin_m
    on, about = (body.grid.within(body.profile.cells, by) for by in (-margin, margin))
    return learn_behind(strips, on & (strips.depth_odds >= 0), ~about & (strips.depth_odds < 0))


def _bounded(body: Body) -> bool:
    """Whether the profile ends within the searched radii and heights."""
    return bool(body.profile.cells.max() < body.grid.cells - 1 and body.profile.cells[-1] == 0)


def _width(config: ThingConfig) -> float:
    """Usual width of the object, metres."""
    return config.width_m or config.radius_m


def _borne(config: ThingConfig) -> float:
    """Maximum pose error between frames, metres."""
    return tuned(Params).pose_share * _width(config)


def meets(body: Body, sight: Sight, slack_m: float) -> bool:
    """Whether a line of sight passes within `slack_m` of the body."""
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
    """Places on the fused surface under a click's ray, in front of where it hit: depth loses necks, so the ray passes them."""
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
    """Surface of the body as points."""
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
