"""Measurements from masks of any segmenter: a front's rectangle and handle, the box of an appliance or other object."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import cv2
import numpy as np

from r2c2r_core.arrays import Points
from r2c2r_core.geometry.camera import pixel_rays, unproject
from r2c2r_core.geometry.masks import PackedMask, unpack_mask
from r2c2r_core.kitchen.category import Category, Kind
from r2c2r_core.kitchen.names import category_of
from r2c2r_core.model.carrier import Carrier
from r2c2r_core.model.inputs import ObjectPrompt
from r2c2r_core.model.motion import JointMotion
from r2c2r_core.model.track import FrontPanel, ThingBox
from r2c2r_core.segment.appliances.box import appliance_box
from r2c2r_core.segment.appliances.fit import fit_box
from r2c2r_core.segment.found import Found
from r2c2r_core.segment.fronts.front import Front, depth_behind, front_panel
from r2c2r_core.segment.learned.voting import Body, vote, voting_frames
from r2c2r_core.segment.mosaics.edges import panel_edges, surface_of
from r2c2r_core.segment.mosaics.handles import find_handle
from r2c2r_core.segment.mosaics.orthomosaic import Cell, joined
from r2c2r_core.segment.motion.carried import drawer_floor
from r2c2r_core.segment.motion.filmed import FilmedLeaves
from r2c2r_core.segment.motion.leaf import Leaf
from r2c2r_core.segment.planes import PlaneRegion, region_along, region_at
from r2c2r_core.segment.prepared import PreparedCapture
from r2c2r_core.segment.runs.run import Run
from r2c2r_core.segment.scene import Scene
from r2c2r_core.segment.things.boxes import box_of
from r2c2r_core.segment.things.thing import ThingConfig, sized_as, support_height
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the measurements from learned masks."""

    grid_step_m: float = param(0.01, "m", "Spacing of the votes on a plane", gt=0)
    covered: float = param(
        0.6, "share", "Minimum fraction of votes inside the masks: parts that few views add at one side are excluded"
    )
    on_plane_m: float = param(0.03, "m", "Maximum distance from a plane of surface that lies on it")
    least_on_plane: float = param(0.08, "share", "Minimum fraction of the object's surface on a clicked plane")
    mainly_on_plane: float = param(0.25, "share", "Minimum fraction of the object's surface on a plane that was not clicked")
    least_of_plane: float = param(
        0.3,
        "share",
        "Minimum fraction of a plane that is the object, for a click without depth to select it: not the wall behind",
    )
    same_panel: float = param(
        0.8,
        "share",
        "Minimum IoU of the voted rectangle with a panel cut by lines for that panel, whose edges are finer, to replace it",
    )
    point_frames: int = param(20, "count", "Maximum number of frames that contribute points", ge=1)
    widest_frames: int = param(7, "count", "Number of largest masks that determine the extent beyond the plane", ge=1)
    grid_pad_m: float = param(0.06, "m", "Extent beyond the plane that its grid covers without an extra margin")
    most_beyond_m: float = param(1.0, "m", "Maximum extent of a front beyond the observed part of its plane")
    farthest_m: float = param(10.0, "m", "Maximum distance along a click's ray")
    glass_m: float = param(1.0, "m", "Maximum distance from a ray's intersection with a plane to its observed part")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Measured:
    """Measurements that later stages need beside the masks."""

    kind: Kind
    front: FrontPanel | None = None
    box: ThingBox | None = None
    warnings: tuple[str, ...] = ()
    motions: tuple[JointMotion, ...] = ()


def measure(prepared: PreparedCapture, prompt: ObjectPrompt, masks: Mapping[int, PackedMask], body: Body) -> Measured:
    """Front or box of the object: `masks` show which part of the scan it is, `body` is that part of the fused surface."""
    category = category_of(prompt.category)
    if category.kind == "thing":
        return Measured(kind="thing", box=_thing_box(prepared.scene, prompt, masks, body, sized_as(category)))
    front = _front(prepared, prompt, masks, body, category)
    if front is None:
        said = (f"no flat front in its masks: treated as a free-standing object ({prompt.category})",)
        return Measured(kind="thing", box=_thing_box(prepared.scene, prompt, masks, body, sized_as(category)), warnings=said)
    behind = depth_behind(front, prepared.scene.capture.room, category)
    if category.kind == "front":
        leaves = FilmedLeaves(Leaf.of(front.rectangle), category, prepared.scene, behind.depth_m)
        return Measured(kind="front", front=front_panel(front), motions=leaves.motions)
    fitted = fit_box(front, prepared.scene, category, behind.wall_m)
    front = fitted.front
    panel, box = front_panel(front), appliance_box(front, depth_seen=fitted.depth_seen)
    motions = FilmedLeaves(Leaf.of(front.rectangle), category, prepared.scene, front.depth_m).motions
    return Measured(kind="appliance", front=panel, box=box, warnings=fitted.warnings(prompt.category), motions=motions)


def measure_carried(
    drawer: Carrier, scene: Scene, prompt: ObjectPrompt, masks: Mapping[int, PackedMask], body: Body
) -> Measured:
    """Box of a thing in a drawer, closed; `scene`, and the masks and the surface in it, are as seen from that drawer."""
    config = replace(sized_as(category_of(prompt.category)), support_z_m=drawer_floor(drawer.front, scene))
    box = _thing_box(scene, prompt, masks, body, config)
    return Measured(kind="thing", box=None if box is None else replace(box, carrier=drawer))


def measured_as(found: Found) -> Measured:
    """Measurements of the weight-free segmenter."""
    return Measured(kind=found.kind, front=found.panel(), box=found.box(), warnings=found.warnings, motions=found.motions())


def _front(
    prepared: PreparedCapture, prompt: ObjectPrompt, masks: Mapping[int, PackedMask], body: Body, category: Category
) -> Front | None:
    region = _front_plane(prepared, prompt, body)
    run = prepared.run_of(region, _beyond(region, prepared.scene, masks)) if region is not None else None
    if run is None:
        return None
    voted = _voted_rectangle(run, prepared.scene, masks, body)
    if voted is None:
        return None
    cell = _as_cut(run, voted)
    cell = panel_edges(cell, surface_of(run.mosaic, run.relief), run.grid.cell_m)
    handle = find_handle(run.odds, run.relief, cell)
    return Front(run, cell, handle, category.depth.usual)


def _front_plane(prepared: PreparedCapture, prompt: ObjectPrompt, body: Body) -> PlaneRegion | None:
    """Clicked plane among those the object lies on (its side may be larger, where glass has no depth), or the largest."""
    params = tuned(Params)
    shares = [(plane, _share_on(plane, body)) for plane in prepared.planes] if body.exists else []
    on_body = tuple(plane for plane, share in shares if share > params.least_on_plane)
    mostly_body = tuple(plane for plane, share in shares if share * body.area_m2 > params.least_of_plane * plane.area_m2)
    for click in prompt.points:
        if click.label != 1:
            continue
        point = prepared.scene.pick(click.frame, click.x, click.y)
        if point is not None and prepared.scene.has_depth(click.frame, click.x, click.y):
            clicked = region_at(on_body, point)
        else:
            met = region_along(
                mostly_body, *prepared.scene.ray(click.frame, click.x, click.y), params.farthest_m, params.glass_m
            )
            clicked = met[0] if met is not None else None
        if clicked is not None:
            return clicked
    plane, share = max(shares, key=lambda entry: entry[1], default=(None, 0.0))
    return plane if share > params.mainly_on_plane else None


def _share_on(plane: PlaneRegion, body: Body) -> float:
    """Fraction of an object's surface that lies on a plane."""
    off = np.abs(plane.world_from_plane.inverse.apply(body.vertices)[:, 1])
    return float(((off < tuned(Params).on_plane_m) & plane.supports(body.vertices, 0.02)).mean())


def _beyond(region: PlaneRegion, scene: Scene, masks: Mapping[int, PackedMask]) -> float:
    """Extent of the masks beyond the observed part of the plane, metres: glass and gloss have no depth."""
    params = tuned(Params)
    largest = sorted(masks, key=lambda index: -masks[index].area_px)[: params.widest_frames]
    reaches = []
    for index in largest:
        mask, frame = masks[index], scene.frame(index)
        columns = np.array([0, mask.box_width, mask.box_width, 0]) + mask.left
        rows = np.array([0, 0, mask.box_height, mask.box_height]) + mask.top
        rays = pixel_rays(np.stack([columns, rows], axis=1).astype(np.float64), frame.rgb_camera)
        inward = region.world_from_plane.inverse.rotation @ frame.world_from_camera.rotation
        eye = region.world_from_plane.inverse.apply(frame.world_from_camera.translation)
        rays = rays @ inward.T
        if (rays[:, 1] < 0.15).any():  # too flat a view to tell where a ray meets the plane
            continue
        met = eye - rays * (eye[1] / rays[:, 1])[:, None]
        over = np.abs(met[:, [0, 2]]) - [region.width_m / 2, region.height_m / 2]
        reaches.append(float(over.max()))
    reach = float(np.quantile(reaches, 0.25)) if reaches else 0.0  # from the side, the mask includes the object's side
    return round(min(reach + 0.05, params.most_beyond_m), 2) if reach > params.grid_pad_m else 0.0


def _voted_rectangle(run: Run, scene: Scene, masks: Mapping[int, PackedMask], body: Body) -> Cell | None:
    """Rectangle of a run's plane (grid cells) that most masks cover, where the object's surface is."""
    params = tuned(Params)
    step = max(1, round(params.grid_step_m / run.grid.cell_m))
    columns, rows = np.arange(step / 2, run.grid.columns, step), np.arange(step / 2, run.grid.rows, step)
    at = np.stack([grid.ravel() for grid in np.meshgrid(columns, rows)], axis=1)
    inside, seen = vote(scene, _frontal(masks, run.region, scene), run.grid.points_at(at))
    covered = ((seen > 0) & (inside > params.covered * seen)).reshape(len(rows), len(columns)).astype(np.uint8)
    count, labels, stats, _ = cv2.connectedComponentsWithStats(covered, connectivity=4)
    if count <= 1:
        return None
    part = labels == _part_of(labels, stats, body, run, step)
    across, down = part.sum(axis=0), part.sum(axis=1)
    wide, tall = np.flatnonzero(across > 0.5 * across.max()), np.flatnonzero(down > 0.5 * down.max())
    if len(wide) < 3 or len(tall) < 3:
        return None
    return Cell(*(float(step * edge) for edge in (wide[0], tall[0], wide[-1] + 1, tall[-1] + 1)))


def _frontal(masks: Mapping[int, PackedMask], region: PlaneRegion, scene: Scene) -> dict[int, PackedMask]:
    """The half of the masks with the most frontal views: from the side, a box's mask includes its side."""

    def facing(index: int) -> float:
        towards = scene.frame(index).world_from_camera.translation - region.world_from_plane.translation
        return float(towards @ region.outward / np.linalg.norm(towards))

    return {index: masks[index] for index in sorted(masks, key=facing)[len(masks) // 2 :]}


def _part_of(labels: np.ndarray, stats: np.ndarray, body: Body, run: Run, step: int) -> int:
    """Label containing most of the object's surface on the plane, else the largest."""
    on_plane = body.vertices[np.abs(run.grid.world_from_plane.inverse.apply(body.vertices)[:, 1]) < tuned(Params).on_plane_m]
    column, row = (run.grid.cells_of(on_plane) / step).astype(int).T
    inside = (column >= 0) & (row >= 0) & (column < labels.shape[1]) & (row < labels.shape[0])
    held = np.bincount(labels[row[inside], column[inside]], minlength=len(stats))
    held[0] = 0
    return int(np.argmax(held)) if held.any() else 1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA]))


def _as_cut(run: Run, voted: Cell) -> Cell:
    """Panel, or adjacent panels, cut by the run's lines there; the voted rectangle where none fits."""
    within = [cell for cell in run.cells if _overlap(cell, voted) > 0.6 * cell.width * cell.height]
    if not within:
        return voted
    cut = joined(within)
    shared = _overlap(cut, voted)
    union = cut.width * cut.height + voted.width * voted.height - shared
    return cut if shared > tuned(Params).same_panel * union else voted


def _overlap(a: Cell, b: Cell) -> float:
    wide = min(a.right, b.right) - max(a.left, b.left)
    tall = min(a.bottom, b.bottom) - max(a.top, b.top)
    return max(wide, 0.0) * max(tall, 0.0)


def _thing_box(
    scene: Scene, prompt: ObjectPrompt, masks: Mapping[int, PackedMask], body: Body, config: ThingConfig
) -> ThingBox | None:
    """Box of an object's points on its support; None where depth never observed it."""
    points = _points(scene, masks, body)
    if len(points) < 20:
        return None
    clicks = [click for click in prompt.points if click.label == 1 and click.frame in scene.rendered_mm]
    clicked = [scene.pick(click.frame, click.x, click.y) for click in clicks]
    hits = np.array([point for point in clicked if point is not None]).reshape(-1, 3)
    support = support_height(scene, hits if len(hits) else points.mean(axis=0)[None], config)
    if support is not None and (points[:, 2] > support).sum() >= 20:
        points = points[points[:, 2] > support]
    centres = np.stack([frame.world_from_camera.translation for frame in scene.frames])
    yaw = scene.capture.room.manhattan_yaw_rad
    return box_of(points, support, yaw, centres.mean(axis=0), round_thing=config.round)


def _points(scene: Scene, masks: Mapping[int, PackedMask], body: Body) -> Points:
    """World points of depth pixels well inside the masks, near the object's surface where there is one."""
    params = tuned(Params)
    found = [np.zeros((0, 3))]
    for index in voting_frames(masks, params.point_frames):
        frame, depth = scene.frame(index), scene.depth(index)
        mask = unpack_mask(masks[index]).astype(np.uint8)
        small = cv2.resize(mask, (depth.shape[1], depth.shape[0]), interpolation=cv2.INTER_AREA)
        inner = cv2.erode(small, np.ones((3, 3), np.uint8)) if small.sum() > 200 else small
        row, column = np.nonzero((inner > 0) & (depth > 0))
        uv = np.stack([column + 0.5, row + 0.5], axis=1)
        found.append(frame.world_from_camera.apply(unproject(uv, depth[row, column].astype(np.float64), frame.depth_camera)))
    points = np.concatenate(found)
    if not body.exists or not len(points):
        return points
    from scipy.spatial import cKDTree

    away, _ = cKDTree(body.vertices).query(points, distance_upper_bound=2.5 * scene.capture.surface.voxel_m)
    return points[np.isfinite(away)]
