"""Clicks to an object: the method of the category first (front, appliance, free-standing), then the one the scan suggests."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from r2c2r_core.arrays import Mask, Points, Vector3
from r2c2r_core.errors import ObjectNotSeen
from r2c2r_core.geometry.masks import mask_iou
from r2c2r_core.kitchen.category import Category
from r2c2r_core.kitchen.names import category_of
from r2c2r_core.model.inputs import DrawnFront, ObjectPrompt, PromptPoint
from r2c2r_core.segment.appliances.find import appliance_front
from r2c2r_core.segment.appliances.fit import FittedBox, fit_box
from r2c2r_core.segment.appliances.found import FoundAppliance
from r2c2r_core.segment.found import Found
from r2c2r_core.segment.fronts.clicked_dark import best_frames, dark_beyond, dark_frames, dark_place, framing_plane
from r2c2r_core.segment.fronts.clicked_open import closed_place, was_moved
from r2c2r_core.segment.fronts.drawer_at import drawer_at
from r2c2r_core.segment.fronts.drawn import FoundDrawn, drawn_front, painted_front
from r2c2r_core.segment.fronts.found import FoundFront
from r2c2r_core.segment.fronts.front import NOWHERE, Front, depth_behind, find_front, seen_sides
from r2c2r_core.segment.fronts.sliding import sliding_chance
from r2c2r_core.segment.mosaics.handles import shared_band
from r2c2r_core.segment.mosaics.orthomosaic import make_grid
from r2c2r_core.segment.motion.carried import drawer_boards, drawer_floor, seen_from_drawer
from r2c2r_core.segment.planes import PlaneRegion, region_at, regions_at
from r2c2r_core.segment.prepared import Hits, PreparedCapture
from r2c2r_core.segment.scene import Scene
from r2c2r_core.segment.things.found import FoundCarried, FoundThing
from r2c2r_core.segment.things.painted import find_painted, level_holes, may_hold, with_clicked_parts
from r2c2r_core.segment.things.revolution import Sight, find_round
from r2c2r_core.segment.things.standing import find_standing
from r2c2r_core.segment.things.standing_mask import standing_colours
from r2c2r_core.segment.things.thing import Params as ThingParams
from r2c2r_core.segment.things.thing import ThingConfig, find_thing, sized_as
from r2c2r_core.segment.things.visual_hull import find_small, glimpse_small
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the choice of method."""

    small_m: float = param(0.25, "m", "Radius below which objects are carved by silhouettes")
    flat_m: float = param(
        0.02, "m", "Maximum of a category's smallest height for its objects to lie in a worktop, as a glass hob does"
    )
    as_painted: float = param(
        0.92, "share", "Minimum overlap with the clicked object of a painted mask that only corrects its frame", ge=0, le=1
    )


def find_object(
    prepared: PreparedCapture, prompt: ObjectPrompt, category: Category, positives: Hits, negatives: Hits, others: Points
) -> Found:
    """Object under the clicks; raises ObjectNotSeen when there is neither a front nor a free-standing object.

    `others` (n, 3) are points clicked on other objects.
    """
    if category.kind == "front":
        closed = [closed_place(prepared, p, c.frame, category) for p, c in zip(positives.points, positives.clicks, strict=True)]
        dark_in = _may_be_dark(prepared, positives, closed[0])
        found = _front(prepared, category, np.array(closed), negatives.points, others, dark_in)
        if found is not None:
            return replace(found, warnings=_handle_doubts(found.front, prompt.name))
    if category.kind == "appliance" and not category.no_front:
        appliance = _appliance(prepared, prompt, category, negatives.points, others)
        if appliance is not None:
            return appliance
    if category.kind == "front" and _on_level(prepared.scene, positives):
        raise ObjectNotSeen(
            f"{prompt.name}: the click is on a level surface, which is no front",
            hint=f"click on the front of the {category.label}, or correct its category",
        )
    thing = _loose(prepared, prompt, category, positives, negatives.points) if positives.clicks else None
    if thing is not None:
        warnings = (
            ()
            if category.kind != "front"
            else (f"no flat front under the click: treated as a free-standing object ({prompt.category})",)
        )
        return replace(thing, warnings=warnings)
    clicks = [click for click in prompt.points if click.label == 1]
    raise ObjectNotSeen(
        f"{prompt.name}: no separate surface under {len(clicks)} click(s)",
        hint=f"click on its middle, or add a second click{_without_depth(prepared.scene, clicks)}",
    )


def _on_level(scene: Scene, positives: Hits) -> bool:
    """Whether the surface about the first click is level."""
    params, parts, point = tuned(ThingParams), scene.parts, positives.points[0]
    faces = parts.faces_near(point, params.furniture_gap_m)
    faces = faces[np.linalg.norm(parts.middles[faces] - point, axis=1) < params.furniture_gap_m]
    level = parts.upward[faces] > params.level_cos
    return bool(parts.areas_m2[faces][level].sum() > 0.5 * parts.areas_m2[faces].sum())


def _without_depth(scene: Scene, clicks: list[PromptPoint]) -> str:
    """Hint that a click lies where the sensor measured nothing; empty where all clicks have depth."""
    for click in clicks:
        if not scene.has_depth(click.frame, click.x, click.y):
            at = f"({click.x:.0f}, {click.y:.0f}) in frame {click.frame}"
            return f"; the sensor measured no depth at {at} (glass, black gloss), where only protruding objects are found"
    return ""


def find_drawn(prepared: PreparedCapture, prompt: ObjectPrompt, drawn: DrawnFront, category: Category) -> Found:
    """Front as a person drew it, and the fitted depth of an appliance. Raises ObjectNotSeen where no frame sees it."""
    scene = prepared.scene
    front = drawn_front(drawn, scene, prepared.config)
    behind = depth_behind(front, scene.capture.room, category)
    front = replace(front, depth_m=behind.depth_m)
    if category.kind == "appliance":
        fitted = fit_box(front, scene, category, behind.wall_m)
        fitted = fitted._replace(front=replace(front, depth_m=fitted.front.depth_m))
        return _found_appliance(fitted, scene, prompt, category)
    return FoundDrawn(replace(front, sides=seen_sides(front, scene)), scene, category)


def find_painted_object(
    prepared: PreparedCapture, prompt: ObjectPrompt, positives: Points, clicked: Found | None, masks: Mapping[int, Mask]
) -> Found | None:
    """Object under masks that a person painted (by frame); `clicked`, the one under the clicks, where they agree with it.

    A mask beside all clicks and one of a leaf that was filmed moving hold for their frames alone. None where neither shows any.
    """
    scene, category, least = prepared.scene, category_of(prompt.category), tuned(Params).as_painted
    painted = {index: mask for index, mask in masks.items() if may_hold(mask, scene, scene.frame(index), positives)}
    if clicked is not None:
        seen = {index: clicked.see(scene.frame(index)).mask for index in painted}
        if clicked.motions() or all(mask_iou(mask, seen[index]) >= least for index, mask in painted.items()):
            return clicked
    if isinstance(clicked, FoundFront | FoundAppliance):
        for index, mask in painted.items():
            plane, grid = framing_plane(scene, prepared.planes, scene.frame(index), mask), clicked.front.run.grid
            if plane is not None and region_at((plane,), clicked.front.outline.centre) is None:
                grid = make_grid(plane, prepared.config.cell_m)  # the clicks went through the glass of a door
            drawn = painted_front(mask, grid, scene.frame(index), scene.capture.world_from_capture)
            if drawn is not None:
                return find_drawn(prepared, prompt, drawn, category)
        if category.kind == "front":
            return clicked
    thing = find_painted(scene, painted, sized_as(category)) if painted else None
    return FoundThing(thing, scene, round=category.round) if thing is not None else clicked


def glimpse_object(
    prepared: PreparedCapture, prompt: ObjectPrompt, category: Category, positives: Hits, negatives: Hits
) -> Found | None:
    """Preview, from depth alone, of slow objects: small ones and appliances. None for the rest, which are found at once."""
    if category.kind == "appliance" and not category.no_front:
        return _appliance(prepared, prompt, category, negatives.points, glimpse=True)
    config = sized_as(category)
    if category.kind != "thing" or config.radius_m >= tuned(Params).small_m or not positives.clicks:
        return None
    if was_moved(positives.points[0], prepared.scene):  # in a drawer, perhaps, which takes as long to find as the thing
        return None
    structure = _structure_off(prepared.planes, positives.points[0])
    small = glimpse_small(prepared.scene, positives.points, negatives.points, config, structure)
    return FoundThing(small, prepared.scene, small=True, round=config.round) if small is not None else None


def _front(
    prepared: PreparedCapture,
    category: Category,
    positives: Points,
    negatives: Points,
    others: Points,
    dark_in: Sequence[int] = (),
) -> FoundFront | None:
    """Front on the nearest plane where its size fits its category, else on the nearest: at a corner, two planes are near.

    `dark_in` are frames that may lack depth at the first click: it then lies beyond its plane's observed part.
    """
    best: Front | None = None
    for region, dark_m in _planes_at(prepared, positives[0], dark_in, category):
        run = prepared.run_of(region, margin_m=dark_m)
        front = None
        if run is not None:
            front = find_front(run, positives, negatives, pair=category.may_be_pair, kind=category, others=others)
        if front is not None and (best is None or _fit(front, category) > _fit(best, category)):
            best = front
        if best is not None and _fit(best, category) == 1.0:
            break
    if best is None:
        return None
    best = replace(best, depth_m=depth_behind(best, prepared.scene.capture.room, category).depth_m)
    best = replace(best, sides=seen_sides(best, prepared.scene))
    slides = sliding_chance(best, prepared.planes) if category.opens == "side" else 0.0
    return FoundFront(best, prepared.scene, category, fit=_fit(best, category), slides=slides)


def _handle_doubts(front: Front, name: str) -> tuple[str, ...]:
    """Warning of a front without a handle in a row of fronts that have one."""
    run = front.run
    if front.handle is not None or shared_band(run.odds, run.relief, run.cells, run.handles, front.cell) is None:
        return ()
    return (f"{name} probably has a handle like its neighbours, but none was found: draw it in the elevation",)


def _may_be_dark(prepared: PreparedCapture, positives: Hits, closed: Vector3) -> Sequence[int]:
    """Frames that may lack depth at the first click: the clicked one, or those that show the closed place of an open front."""
    first, scene = positives.clicks[0], prepared.scene
    if dark_place(scene, prepared.planes, first) is not None:
        return (first.frame,)
    if np.array_equal(closed, positives.points[0]):
        return ()
    return best_frames(scene, closed)


def _planes_at(
    prepared: PreparedCapture, point: Vector3, dark_in: Sequence[int], category: Category
) -> Iterator[tuple[PlaneRegion, float]]:
    """Planes that a point may lie on, the likeliest first, each with the width of the black glass beyond its border, metres."""
    near = regions_at(prepared.planes, point)
    if not dark_in:
        yield from ((region, 0.0) for region in near)
        return
    for region in regions_at(prepared.planes, point, beside_m=category.longest_m):
        frames = dark_frames(prepared.scene, region, point, dark_in)
        if frames or any(region is each for each in near):
            yield region, dark_beyond(prepared.scene, region, point, frames, category)


def _fit(front: Front, category: Category) -> float:
    """Fit (0..1) of a front's size to its category."""
    cell_m, cell = front.run.grid.cell_m, front.cell
    return category.width.fit(cell_m * cell.width) * category.height.fit(cell_m * cell.height)


def _appliance(
    prepared: PreparedCapture,
    prompt: ObjectPrompt,
    category: Category,
    negatives: Points,
    others: Points = NOWHERE,
    *,
    glimpse: bool = False,
) -> FoundAppliance | None:
    fitted = appliance_front(prepared, prompt, category, negatives, others, glimpse=glimpse)
    return None if fitted is None else _found_appliance(fitted, prepared.scene, prompt, category)


def _found_appliance(fitted: FittedBox, scene: Scene, prompt: ObjectPrompt, category: Category) -> FoundAppliance:
    return FoundAppliance(fitted.front, scene, category, fitted.depth_seen, warnings=fitted.warnings(prompt.category))


def _loose(
    prepared: PreparedCapture, prompt: ObjectPrompt, category: Category, hits: Hits, negatives: Points
) -> FoundThing | FoundCarried | None:
    """Free-standing object; one in a drawer that stands open at the first click is found in the scene seen from that drawer."""
    drawer = drawer_at(prepared, hits.points[0], hits.clicks[0].frame) if category.kind == "thing" else None
    if drawer is None:
        config = sized_as(category)
        config = config if category.kind == "thing" else replace(config, on_floor=False)
        return _thing(prepared.scene, _structure_off(prepared.planes, hits.points[0]), prompt, config, hits, negatives)
    scene = seen_from_drawer(drawer, prepared.scene)
    clicks = tuple(click for click in prompt.points if click.frame in scene.rendered_mm)
    on, off = (_picked(scene, [click for click in clicks if click.label == label]) for label in (1, 0))
    if not on.clicks:
        return None
    config = replace(sized_as(category), on_floor=False, support_z_m=drawer_floor(drawer.front, scene))
    boards = drawer_boards(drawer, prepared.scene)
    carved = replace(prompt, points=clicks)  # drawers hold nothing too large for silhouettes
    thing = _small_thing(scene, boards, carved, config, on, off.points, by_silhouettes=True)
    return FoundCarried(thing, scene, drawer) if thing is not None else None


def _picked(scene: Scene, clicks: list[PromptPoint]) -> Hits:
    """The clicks that hit a surface, and where."""
    hits = [(click, point) for click in clicks if (point := scene.pick(click.frame, click.x, click.y)) is not None]
    return Hits(tuple(click for click, _ in hits), np.array([point for _, point in hits]).reshape(-1, 3))


def _thing(
    scene: Scene, structure: tuple[PlaneRegion, ...], prompt: ObjectPrompt, config: ThingConfig, hits: Hits, negatives: Points
) -> FoundThing | None:
    """Object under the clicks; `structure` are flat parts that it may touch but does not contain."""
    flat = config.lowest_m <= tuned(Params).flat_m
    if flat and (glass := level_holes(scene, hits.clicks)):
        hob = find_painted(scene, glass, config)
        if hob is not None:
            return FoundThing(hob, scene)
    positives = _on_thing(scene, hits, config)
    if config.on_floor or config.slab_m is not None:
        standing = find_standing(scene, positives, negatives, config, structure)
        if standing is not None:
            colours = standing_colours(standing, scene, scene.frames)
            standing = replace(standing, thing=replace(standing.thing, colours=colours))
            return FoundThing(standing.thing, scene, standing=standing)
        if config.slab_m is not None:  # what is not level is no worktop
            return None
    is_small = config.radius_m < tuned(Params).small_m
    thing = _small_thing(scene, structure, prompt, config, hits, negatives, by_silhouettes=is_small)
    if thing is not None:
        return thing
    cut_out = find_thing(scene, positives, negatives, config)
    return FoundThing(with_clicked_parts(cut_out, scene, hits.clicks), scene) if cut_out is not None else None


def _small_thing(
    scene: Scene,
    structure: tuple[PlaneRegion, ...],
    prompt: ObjectPrompt,
    config: ThingConfig,
    hits: Hits,
    negatives: Points,
    *,
    by_silhouettes: bool,
) -> FoundThing | None:
    """Body of revolution, or object carved by silhouettes where it is small enough; None where neither is found."""
    positives = _on_thing(scene, hits, config)
    if config.round:
        on, off = ([Sight(*scene.ray(c.frame, c.x, c.y)) for c in prompt.points if c.label == sign] for sign in (1, 0))
        body = find_round(scene, on, off, positives[0], config, structure)
        if body is not None:
            return FoundThing(replace(body, clicks=prompt.points), scene, small=True, round=True)
    if by_silhouettes:
        small = find_small(scene, positives, negatives, config, structure)
        if small is not None:
            return FoundThing(replace(small, clicks=prompt.points), scene, small=True, round=config.round)
    return None


def _on_thing(scene: Scene, hits: Hits, config: ThingConfig) -> Points:
    """Points of the clicks; those that hit the background are moved forward to the object; farther ones are left out."""
    first = hits.points[0]
    points = [first]
    across = 1.2 * config.width_m + 0.02 if config.width_m is not None else 2.2 * config.radius_m
    for click, seen in zip(hits.clicks[1:], hits.points[1:], strict=True):
        point = seen
        if np.linalg.norm((point - first)[:2]) > across:
            origin, ray = scene.ray(click.frame, click.x, click.y)
            point = origin + ray * float((first - origin)[:2] @ ray[:2]) / max(float(ray[:2] @ ray[:2]), 1e-6)
        if np.linalg.norm((point - first)[:2]) <= across:
            points.append(point)
    return np.array(points)


def _structure_off(planes: tuple[PlaneRegion, ...], point: Vector3) -> tuple[PlaneRegion, ...]:
    """Walls and runs that an object may touch, except the plane that it lies on itself."""
    structure = tuple(plane for plane in planes if plane.area_m2 > 0.4)
    own = region_at(structure, point, 0.02)
    return tuple(plane for plane in structure if plane is not own)
