"""Appliance at clicks: its front's plane from a click on the front, on glass without depth, on a side or on the top."""

from dataclasses import dataclass, replace

import cv2
import numpy as np

from r2c2r_core.arrays import Mask, Points, Vector3
from r2c2r_core.geometry.visibility import look_up
from r2c2r_core.kitchen.categories import every_category
from r2c2r_core.kitchen.category import Category
from r2c2r_core.model.inputs import ObjectPrompt, PromptPoint
from r2c2r_core.segment.appliances.box import find_rectangle
from r2c2r_core.segment.appliances.fit import FittedBox, fit_box
from r2c2r_core.segment.appliances.looked_past import looked_past
from r2c2r_core.segment.fronts.clicked_open import closed_place
from r2c2r_core.segment.fronts.front import NOWHERE, Front, depth_behind, near_plane, nudged
from r2c2r_core.segment.mosaics.edges import panel_edges, surface_of
from r2c2r_core.segment.mosaics.handles import find_handle
from r2c2r_core.segment.mosaics.orthomosaic import Cell
from r2c2r_core.segment.motion.leaf import Leaf, face_points
from r2c2r_core.segment.planes import PlaneRegion, region_along, regions_at
from r2c2r_core.segment.prepared import PreparedCapture
from r2c2r_core.segment.runs.run import Run
from r2c2r_core.segment.scene import Scene
from r2c2r_core.segment.things.thing import Params as ThingParams
from r2c2r_core.segment.things.thing import ThingConfig, support_height
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the choice of the front's plane."""

    low_m: float = param(0.6, "m", "Maximum height of a category that stands on worktops")
    off_front_m: float = param(0.04, "m", "Minimum distance of a click behind the front's plane to lie on a side or the top")
    own_width: float = param(
        1.3, "ratio", "Maximum width of a plane, relative to the category's maximum, that is the appliance's own front"
    )
    in_a_run: float = param(
        2.5, "ratio", "Maximum width of a plane, relative to the category's maximum, that contains its front"
    )
    unlikelier: float = param(
        1.0, "log", "Maximum loss in size log-likelihood, against the clicked plane, for a plane to be the front of that side"
    )
    parallel_cos: float = param(0.95, "cosine", "Minimum cosine between the normals of an appliance's front and its rear board")
    prepared_margin_m: float = param(
        0.45,
        "m",
        "Maximum margin missing from an appliance for which its plane is prepared in advance",
        source="planes that miss more are many and small: cut when clicked",
    )


def appliance_front(
    prepared: PreparedCapture,
    prompt: ObjectPrompt,
    kind: Category,
    negatives: Points,
    others: Points = NOWHERE,
    *,
    glimpse: bool = False,
) -> FittedBox | None:
    """Appliance front with its depth; None where no front is found.

    `others` are clicks on other objects: those on its own plane lie beside it.

    Its glass may have no depth, so clicks are rays that meet a plane observed elsewhere on it. A glimpse skips the edges in
    the photographs and the handle, which take most of the time.
    """
    clicks = [click for click in prompt.points if click.label == 1]
    found = _plane_of(prepared, clicks[0], kind)
    if found is None:
        return None
    region, point = found
    run = prepared.run_of(region, margin_m=_margin(region, kind))
    if run is None:
        return None
    on = run.grid.cells_of(np.array([point, *_on_plane(prepared, region, clicks[1:])]))
    off = run.grid.cells_of(near_plane(run.grid, negatives))
    past = looked_past(run, prepared.scene, on[0], kind)
    beside = run.grid.cells_of(near_plane(run.grid, others))
    support_row = _support_row(prepared, run, point, kind)
    cell = _rectangle(run, on, off, beside, kind, past, support_row)
    if cell is None:
        return None
    surface = surface_of(run.mosaic, run.relief)
    cell = panel_edges(cell, surface, run.grid.cell_m)
    handle = None if glimpse else find_handle(run.odds, run.relief, _above(cell, support_row, run.grid.cell_m))
    front = Front(run, cell, handle, kind.depth.usual)
    wall = depth_behind(front, prepared.scene.capture.room, kind).wall_m
    fitted = fit_box(front, prepared.scene, kind, wall, photographs=not glimpse)
    cell = _nudged(fitted.front.cell, on[1:], off, run.grid.cell_m)
    return fitted._replace(front=replace(fitted.front, cell=cell))


def _rectangle(
    run: Run, on: np.ndarray, off: np.ndarray, beside: np.ndarray, kind: Category, past: Mask, support_row: float | None
) -> Cell | None:
    """Rectangle around the first click, clear of other objects' clicks; more clicks change it unless just beside its border."""
    cell = find_rectangle(run, on[:1], kind, beside, past, support_row)
    if cell is None:  # the first click may be on a dark side, whose ray meets the plane beside the front
        on = np.array([run.grid.cells_of(_support_near(run.region, run.grid.points_at(on[:1])[0])[None])[0], *on[1:]])
        cell = find_rectangle(run, on[:1], kind, beside, past, support_row)
    if cell is None:
        return None
    missed = [click for click in on[1:] if nudged(cell, click[0], click[1], 1, run.grid.cell_m) is None]
    wrong = [click for click in off if nudged(cell, click[0], click[1], 0, run.grid.cell_m) is None]
    if not missed and not wrong:
        return cell
    refused = np.array([*wrong, *beside]).reshape(-1, 2)
    return find_rectangle(run, np.array([on[0], *missed]), kind, refused, past, support_row) or cell


def _support_row(prepared: PreparedCapture, run: Run, point: Vector3, kind: Category) -> float | None:
    """Grid row of the support of a small appliance; None for tall ones, and where no support was observed."""
    if kind.height.high > tuned(Params).low_m:
        return None
    support = support_height(prepared.scene, point[None], ThingConfig(radius_m=kind.width.usual / 2))
    if support is None:
        return None
    row = float(run.grid.cells_of(np.array([[point[0], point[1], support]]))[0, 1])
    return row if row < run.grid.rows else None


def _above(cell: Cell, support_row: float | None, cell_m: float) -> Cell:
    """Part of a front that is clear of its support."""
    if support_row is None:
        return cell
    return replace(cell, bottom=min(cell.bottom, support_row - tuned(ThingParams).clearance_m / cell_m))


def _nudged(cell: Cell, on: np.ndarray, off: np.ndarray, cell_m: float) -> Cell:
    """Rectangle with its borders moved to the clicks just beside them."""
    for label, clicks in ((1, on), (0, off)):
        for column, row in clicks:
            cell = nudged(cell, column, row, label, cell_m) or cell
    return cell


def _on_plane(prepared: PreparedCapture, region: PlaneRegion, clicks: list[PromptPoint]) -> list[Vector3]:
    """Intersections of clicks with the front's plane; clicks whose depth shows a side or the top are left out."""
    params = tuned(Params)
    points = []
    for click in clicks:
        seen = prepared.scene.pick(click.frame, click.x, click.y)
        has_depth = prepared.scene.has_depth(click.frame, click.x, click.y)
        if has_depth and seen is not None and _behind(region, seen) > params.off_front_m:
            continue
        origin, ray = prepared.scene.ray(click.frame, click.x, click.y)
        met = region_along((region,), origin, ray, 10.0, 1.0)
        points += [met[1]] if met else []
    return points


def _plane_of(prepared: PreparedCapture, click: PromptPoint, kind: Category) -> tuple[PlaneRegion, Vector3] | None:
    """Plane of an appliance's front and a point on it: under the click, else beside the clicked face."""
    params = tuned(Params)
    scene = prepared.scene
    origin, ray = scene.ray(click.frame, click.x, click.y)
    point = scene.pick(click.frame, click.x, click.y)
    if scene.has_depth(click.frame, click.x, click.y) and point is not None:
        closed = closed_place(prepared, point, click.frame, kind)
        behind = None if closed is point else _region_at(prepared, closed, kind)
        if behind is not None:
            return behind, closed
        region = _region_at(prepared, point, kind)
        front = _front_before(prepared, point, kind)
        if front is not None and (region is None or _is_front_of(scene, front, region, kind)):
            return front, _support_near(front, point)
        if region is not None:
            return region, point
    farthest = float(np.linalg.norm(point - origin)) + 0.1 if point is not None else 6.0
    # A plane no wider than such an appliance is more likely its front than a run of cupboards that the ray passes over
    for widest in (params.own_width, params.in_a_run):
        planes = tuple(plane for plane in prepared.planes if plane.width_m < widest * kind.width.high)
        met = region_along(planes, origin, ray, farthest, kind.width.high)
        if met is not None:
            return _before_inside(prepared, *met, origin, ray, kind) or met
    return None


def _before_inside(
    prepared: PreparedCapture, inside: PlaneRegion, point: Vector3, origin: Vector3, ray: Vector3, kind: Category
) -> tuple[PlaneRegion, Vector3] | None:
    """The front of an appliance filmed open, from a click on its glass: there the other frames' depth shows its rear board."""
    front = _front_before(prepared, point, kind) if inside.supports(point[None], 0.0)[0] else None
    if front is None or front.outward @ inside.outward < tuned(Params).parallel_cos:
        return None
    return region_along((front,), origin, ray, 10.0, 1.0)


def _is_front_of(scene: Scene, front: PlaneRegion, clicked: PlaneRegion, kind: Category) -> bool:
    """Whether a plane in front of the clicked one is more likely the front: faced more squarely, with a plausible size."""
    likelier = _size_likelihood(clicked, kind) - _size_likelihood(front, kind)
    return likelier < tuned(Params).unlikelier and _faced(scene, front) > _faced(scene, clicked) + 0.2


def _size_likelihood(plane: PlaneRegion, kind: Category) -> float:
    return kind.width.log_likelihood(plane.width_m) + kind.height.log_likelihood(plane.height_m)


def _region_at(prepared: PreparedCapture, point: Vector3, kind: Category) -> PlaneRegion | None:
    """Plane under a point; beside one much smaller than the category, as on a rounded edge, the one faced most squarely.

    The surface is fused from some of the frames: a corner that only others show is missing from the plane's observed part.
    """
    near = regions_at(prepared.planes, point) or regions_at(prepared.planes, point, beside_m=kind.width.low / 2)
    if not near or not _misses_much(near[0], kind):
        return near[0] if near else None
    whole = [plane for plane in near if not _misses_much(plane, kind)]
    return max(whole, key=lambda plane: _faced(prepared.scene, plane), default=near[0])


def _front_before(prepared: PreparedCapture, point: Vector3, kind: Category) -> PlaneRegion | None:
    """Plane close in front of a point on a side or the top of a box of this category; the one faced most squarely."""
    params = tuned(Params)
    planes = [
        plane
        for plane in prepared.planes
        if plane.width_m < params.own_width * kind.width.high
        and not _misses_much(plane, kind)
        and params.off_front_m < _behind(plane, point) < kind.depth.usual + 0.1
        and plane.supports(point[None], 0.12)[0]
    ]
    return max(planes, key=lambda plane: _faced(prepared.scene, plane), default=None)


def _behind(plane: PlaneRegion, point: Vector3) -> float:
    return -float((point - plane.world_from_plane.translation) @ plane.outward)


def _faced(scene: Scene, plane: PlaneRegion) -> float:
    """Mean cosine between a plane's normal and the directions to the cameras, over its points that each of them sees."""
    points = plane.world_from_plane.apply(face_points(Leaf.of(plane.bounds)))
    total, count = 0.0, 0
    for frame in scene.frames:
        z, seen, _ = look_up(points, frame.world_from_camera, frame.depth_camera, scene.depth(frame.index))
        towards = frame.world_from_camera.translation - points[scene.noise.agrees(seen, z, tuned(Params).off_front_m)]
        total += float((towards @ plane.outward / np.linalg.norm(towards, axis=1)).sum())
        count += len(towards)
    return total / max(count, 1)


def _support_near(plane: PlaneRegion, point: Vector3) -> Vector3:
    """Observed point of a plane near another point."""
    seen = plane.points
    order = np.argsort(np.linalg.norm(seen - point, axis=1))
    return np.asarray(seen[order[: max(1, round(0.06**2 / plane.cell_m**2))]].mean(axis=0))


def _margin(region: PlaneRegion, kind: Category) -> float:
    """Margin by which the front may extend beyond its observed part, metres."""
    is_alone = region.width_m < kind.width.high and region.height_m < kind.height.high
    return _beyond(max(_missing_m(region, kind), _hollow_m(region) if is_alone else 0.0))


def _missing_m(region: PlaneRegion, kind: Category) -> float:
    """Length that a plane lacks of the category's usual size."""
    return max(kind.width.usual - region.width_m, kind.height.usual - region.height_m, 0.0)


def _hollow_m(region: PlaneRegion) -> float:
    """Largest distance of a place within a plane's bounds from its observed part: glass that no depth shows."""
    return float(cv2.distanceTransform((~region.support).astype(np.uint8), cv2.DIST_L2, 5).max()) * region.cell_m


def _beyond(missing_m: float) -> float:
    return round(missing_m + 0.05, 2) if missing_m > 0.08 else 0.0


def _misses_much(region: PlaneRegion, kind: Category) -> bool:
    return _beyond(_missing_m(region, kind)) > tuned(Params).prepared_margin_m


def appliance_margins(region: PlaneRegion) -> tuple[float, ...]:
    """Run margins that clicks may request around a plane, which may be part of an appliance of known size."""
    params = tuned(Params)
    kinds = [kind for kind in every_category() if kind.kind == "appliance"]
    larger = [kind for kind in kinds if region.width_m < kind.width.high and region.height_m < kind.height.high]
    margins = {_margin(region, kind) for kind in larger}
    return tuple(sorted(margin for margin in margins if 0 < margin <= params.prepared_margin_m))
