"""Free-standing objects: min-cut of the fused surface above its support at the clicks, and masks of the result."""

from dataclasses import dataclass, replace
from functools import partial
from itertools import product

import cv2
import numpy as np

from r2c2r_core.arrays import Colours, Faces, Mask, Points, Vector3
from r2c2r_core.geometry.camera import project, ray_slopes
from r2c2r_core.geometry.fusion import DepthView, fuse_depth
from r2c2r_core.geometry.graphs import components
from r2c2r_core.geometry.masks import box_around
from r2c2r_core.geometry.raster import rasterize, subdivide_long_edges
from r2c2r_core.geometry.visibility import look_up
from r2c2r_core.kitchen.category import Category
from r2c2r_core.kitchen.walls import distances_behind
from r2c2r_core.model.capture import Frame
from r2c2r_core.model.inputs import PromptPoint
from r2c2r_core.segment.occlusion import refine_border
from r2c2r_core.segment.scene import Scene
from r2c2r_core.segment.things.boxes import box_of
from r2c2r_core.segment.things.min_cut import VoxelGraph, build_graph, cut
from r2c2r_core.segment.things.pixel_cut import ColourModel
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the object segmentation."""

    support_reach_m: float = param(0.35, "m", "Maximum distance of the support from the clicks, beyond the object's radius")
    bin_m: float = param(0.005, "m", "Height of a histogram bin of level surface", gt=0)
    sectors: int = param(16, "count", "Number of directions around the clicks in which a support is checked", ge=4)
    around: float = param(
        0.4,
        "share",
        "Minimum fraction of directions in which a support continues: walls and edges bound it, neighbours stand on it",
    )
    clearance_m: float = param(0.012, "m", "Minimum height above the support for surface to belong to the object")
    seen_through_m: float = param(
        0.10, "m", "Minimum distance of measured depth behind the surface for a gap between slats, which the surface closes"
    )
    furniture_gap_m: float = param(
        0.08, "m", "Maximum gap between parts of an object on the floor: scans lose parts of legs and seats"
    )
    solid_m: float = param(0.03, "m", "Minimum distance of measured depth behind a place that is empty, beyond the noise", gt=0)
    canopy_m: float = param(0.2, "m", "Maximum gap between parts of a hood, whose canopy's top is too high to be seen")
    level_cos: float = param(0.92, "cosine", "Minimum cosine between a face normal and up for a support")
    level_area_m2: float = param(0.0005, "m²", "Minimum level area in one direction for a support to continue there")
    support_m2: float = param(0.005, "m²", "Minimum level area at one height for a support")
    support_share: float = param(
        0.15,
        "ratio",
        "Minimum level area at one height relative to the footprint of an object of the usual size, for a support",
    )
    surface_reach: float = param(
        2.2, "ratio", "Radius of the surface searched around the clicks relative to the object's radius"
    )
    surface_margin_m: float = param(0.15, "m", "Margin added to that search radius")
    seed_m: float = param(0.12, "m", "Maximum distance from a click to the surface it selects")
    off_wall_m: float = param(0.03, "m", "Maximum distance from a wall of points that belong to the wall")
    cell: float = param(0.125, "ratio", "Voxel size of the cut relative to the object's radius", gt=0)
    cells_m: tuple[float, float] = param((0.006, 0.025), "m", "Minimum and maximum voxel size of the cut")
    flat_cos: float = param(0.93, "cosine", "Minimum cosine between a normal and up for large level parts")
    upright_cos: float = param(0.25, "cosine", "Maximum cosine between a normal and up for large upright parts")
    parallel_cos: float = param(0.94, "cosine", "Minimum cosine between the normals of neighbours on one flat part")
    step_cells: float = param(0.35, "ratio", "Maximum step between neighbours on one flat part relative to the voxel size")
    structure_m2: float = param(
        0.45, "m²", "Minimum area of a flat part without a click for it to be a wall, a worktop or a table top"
    )
    before_m: float = param(
        0.05, "m", "Minimum distance of measured depth in front of the surface, beyond the noise, for an occluder"
    )
    depth_range_m: tuple[float, float] = param(
        (0.25, 4.0), "m", "Minimum and maximum distance of the views from which the surface is fused again"
    )
    farthest_m: float = param(
        1.0, "m", "Maximum radius of an object without a flat top; of larger ones, this much around a click is segmented"
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class ThingConfig:
    """Size limits and support of an object, from its category where that gives them."""

    radius_m: float  # about half its longest side
    width_m: float | None = None  # usual width, where the category gives it
    round: bool = False  # as deep as wide
    handled: bool = False  # may have a handle
    on_floor: bool = False
    flat_top: bool = False
    slab_m: float | None = None  # usual thickness of a level slab without legs
    solid_gap_m: float = 0.0  # between parts that count as joined where nothing is seen between them
    lowest_m: float = 0.0
    tallest_m: float = 1.1
    stands: bool = True  # on a support; else it hangs, or is built in
    support_z_m: float | None = None  # height of its support (world), where that is known


def sized_as(category: Category) -> ThingConfig:
    """Size limits of objects of a category."""
    return ThingConfig(
        radius_m=category.longest_m / 2 if category.flat_top else min(category.longest_m / 2, tuned(Params).farthest_m),
        width_m=category.width.usual if category.round else None,
        round=category.round,
        handled=category.open_vessel,
        on_floor=category.on_floor,
        stands=category.stands,
        solid_gap_m=tuned(Params).canopy_m if category.no_front else 0.0,
        flat_top=category.flat_top,
        slab_m=category.height.usual if category.flat_top and not category.on_floor else None,
        lowest_m=category.height.low,
        tallest_m=category.height.high,
    )


@dataclass(frozen=True, slots=True, eq=False)
class Thing:
    """Segmented surface in the world, and the height of its support."""

    vertices: Points
    faces: Faces
    support_z_m: float | None
    spacing_m: float = 0.01  # between neighbouring vertices
    pose_error_m: float = 0.02  # error of its position in a frame
    border_m: float = 0.006  # tolerance of its outline
    attached_m: float = 0.035  # distance around its outline within which missing handles and caps may lie
    colours: ColourModel | None = None  # learned from confident pixels
    clicks: tuple[PromptPoint, ...] = ()  # corrections of single pixels, valid in their own frames


def find_thing(
    scene: Scene, positives: Points, negatives: Points, config: ThingConfig, *, voxel_m: float | None = None
) -> Thing | None:
    """Min-cut of the surface at the clicks (world points); None when there is none within reach."""
    params = tuned(Params)
    reach = params.surface_reach * config.radius_m + params.surface_margin_m
    vertices, faces, colours = local_surface(scene, positives, reach, voxel_m)
    if len(faces) < 20:
        return None
    support = support_height(scene, positives, config)
    keep = np.ones(len(faces), bool)
    if support is not None:
        height = vertices[:, 2]
        keep = (height[faces[:, 0]] + height[faces[:, 1]] + height[faces[:, 2]]) / 3 > support + params.clearance_m
    if keep.sum() < 10:
        return None
    faces = faces[keep]
    size = float(np.clip(params.cell * config.radius_m, *params.cells_m))
    graph = build_graph(vertices, faces, colours, size)
    seeds = [graph.nearest(point) for point in positives]
    if np.linalg.norm(graph.positions[seeds] - positives, axis=1).min() > params.seed_m:
        return None
    refused = [voxel for voxel in (graph.nearest(point) for point in negatives) if voxel not in seeds]
    gap_m = params.furniture_gap_m if config.on_floor else config.solid_gap_m
    around_m = config.radius_m * (2 if config.solid_gap_m else 1)  # a part may be as far as the whole is long
    solid = partial(_solid, scene) if config.solid_gap_m else None
    structure = structure_of(graph, seeds)
    chosen, _ = cut(graph, seeds, refused, around_m, structure, gap_m=gap_m, solid=solid, upright=config.on_floor)
    thing = extract(vertices, faces, chosen[graph.voxel_of_face], support)
    return closed_below(thing, scene, config) if thing is not None and config.solid_gap_m else thing


def closed_below(thing: Thing, scene: Scene, config: ThingConfig) -> Thing:
    """Hood with its underside, from its front to the wall behind: it is dark, and depth seldom shows it."""
    room, cameras = scene.capture.room, [frame.world_from_camera.translation for frame in scene.frames]
    box = box_of(thing.vertices, None, room.manhattan_yaw_rad, np.mean(cameras, axis=0))
    (width, depth, height), place = box.dimensions_m, box.world_from_object
    front = place.apply(np.array([[0.0, -depth / 2, 0.0]]))[0]
    walls = [behind for behind in distances_behind(room.walls, front, -place.rotation[:, 1]) if 0 < behind < config.radius_m]
    back = max([*walls[:1], depth]) - depth / 2
    corners = np.array([[x, y, -height / 2] for x, y in product((-width / 2, width / 2), (-depth / 2, back))])
    largest_m = tuned(Params).cells_m[1]
    below, faces, _ = subdivide_long_edges(place.apply(corners), np.array([[0, 1, 2], [1, 3, 2]]), corners, largest_m)
    vertices = np.concatenate([thing.vertices, below])
    return replace(thing, vertices=vertices, faces=np.concatenate([thing.faces, faces + len(thing.vertices)]))


def thing_mask(thing: Thing, scene: Scene, frame: Frame, *, refine: bool = True) -> tuple[Mask, float]:
    """Visible pixels of the object in a frame, and the visible fraction of its projection."""
    camera = frame.rgb_camera
    size = (camera.width, camera.height)
    scale = max(1, round(camera.width / 480))
    small = camera.resized(camera.width // scale, camera.height // scale)
    raster = rasterize(
        thing.vertices, thing.faces, np.zeros((len(thing.vertices), 3), np.float32), small, frame.world_from_camera.inverse
    )
    model = raster.depth_m
    projected = model > 0
    if projected.sum() < 12:
        return np.zeros((size[1], size[0]), bool), 0.0
    depth = cv2.resize(scene.filled_depth(frame.index), (small.width, small.height), interpolation=cv2.INTER_NEAREST)
    hidden = projected & scene.noise.occluded(depth, model, tuned(Params).before_m)
    sensor = cv2.resize(scene.depth(frame.index), (small.width, small.height), interpolation=cv2.INTER_NEAREST)
    through = scene.noise.seen_through(sensor, model, tuned(Params).seen_through_m)  # between slats, which the surface closes
    shown = projected & ~hidden & ~through
    shown = cv2.morphologyEx(shown.astype(np.uint8), cv2.MORPH_OPEN, np.ones((2, 2), np.uint8))
    share = float(shown.sum() / projected.sum())
    mask = cv2.resize(shown, size, interpolation=cv2.INTER_LINEAR) > 0
    if not mask.any():
        return mask, 0.0
    return (_refined(mask, scene, frame) if refine else mask), share


def _refined(mask: Mask, scene: Scene, frame: Frame) -> Mask:
    area = box_around(mask, 24)
    band = int(np.clip(np.sqrt(mask.sum()) / 10, 2, max(4, frame.rgb_camera.width / 110)))
    result = np.zeros_like(mask)
    result[area] = refine_border(scene.balanced(frame.index)[area], mask[area], band)
    return result


def support_height(scene: Scene, positives: Points, config: ThingConfig) -> float | None:
    """World height of the object's support: the floor, or the highest level surface below that surrounds it.

    Surrounds: it continues in enough directions, farther out than the object reaches. Where no surface does, the highest large
    level one below. None where frames see that nothing stands on it: the object hangs. Bottles and glasses are seen through.
    """
    params = tuned(Params)
    if config.support_z_m is not None:
        return config.support_z_m
    if not config.stands:
        return None
    if config.on_floor:
        return 0.0 if scene.capture.room.floor_found else None
    lowest = positives[np.argmin(positives[:, 2])]
    centres, areas = _level_faces(scene, lowest, params.support_reach_m + 1.5 * config.radius_m)
    below = centres[:, 2] < lowest[2] - 0.004
    centres, areas = centres[below], areas[below]
    if len(centres) == 0:
        return None
    away = centres[:, :2] - lowest[:2]
    distance = np.hypot(away[:, 0], away[:, 1])
    height_bin = np.floor((centres[:, 2] - centres[:, 2].min()) / params.bin_m).astype(int)
    sector = np.floor((np.arctan2(away[:, 1], away[:, 0]) / (2 * np.pi) % 1.0) * params.sectors).astype(int) % params.sectors
    ring = distance > config.radius_m
    spread = np.zeros((height_bin.max() + 1, params.sectors))
    np.add.at(spread, (height_bin[ring], sector[ring]), areas[ring])
    around = (_over_bins(spread) > params.level_area_m2).mean(axis=1)
    near = distance < params.support_reach_m + config.radius_m
    profile = _over_bins(np.bincount(height_bin[near], areas[near], len(spread))[:, None])[:, 0]
    enough = max(params.support_m2, params.support_share * np.pi * (0.7 * config.radius_m) ** 2)
    peaks = [i for i in range(len(profile)) if profile[i] > enough and profile[i] == profile[max(0, i - 4) : i + 5].max()]
    if not peaks:
        return None
    reaching = [i for i in peaks if around[i] >= params.around]
    top = (reaching or peaks)[-1]
    chosen = near & (np.abs(height_bin - top) <= 2)
    height = float(np.average(centres[chosen, 2], weights=areas[chosen]))
    return None if not config.round and _is_clear(scene, lowest, height, config.radius_m) else height


def _is_clear(scene: Scene, above: Vector3, support_z_m: float, radius_m: float) -> bool:
    """Whether frames see through everything within reach just above a surface, so that the object cannot stand on it."""
    params = tuned(Params)
    if above[2] - support_z_m < params.furniture_gap_m:
        return False
    steps = np.linspace(-radius_m, radius_m, min(41, int(radius_m / 0.01) + 1))  # at 2 cm, or coarser below what is very large
    places = np.array([[above[0] + x, above[1] + y, support_z_m + 2 * params.solid_m] for x, y in product(steps, steps)])
    return not _solid(scene, places).any()


def _solid(scene: Scene, points: Points) -> np.ndarray:
    """Mask of the points that no frame sees through."""
    empty = np.zeros(len(points), bool)
    for frame in scene.frames:
        z, seen, _ = look_up(points, frame.world_from_camera, frame.depth_camera, scene.depth(frame.index))
        empty |= scene.noise.seen_through(seen, z, tuned(Params).solid_m)
    return ~empty


def _level_faces(scene: Scene, point: Vector3, reach_m: float) -> tuple[Points, np.ndarray]:
    """Centres and areas of the surface's level faces around a point, in plan."""
    parts = scene.parts
    near = parts.faces_near(point, reach_m, any_height=True)
    near = near[parts.upward[near] > tuned(Params).level_cos]
    near = near[np.linalg.norm(parts.middles[near, :2] - point[:2], axis=1) < reach_m]
    return parts.middles[near], parts.areas_m2[near]


def _over_bins(profile: np.ndarray) -> np.ndarray:
    """Sums over five neighbouring bins of the first axis."""
    padded = np.pad(profile, ((2, 2), (0, 0)))
    return np.asarray(sum(padded[k : k + len(profile)] for k in range(5)))


def structure_of(graph: VoxelGraph, seeds: list[int]) -> np.ndarray:
    """Mask of the voxels on large flat parts (walls, worktops, table tops) without a click."""
    params, background = tuned(Params), np.zeros(len(graph.positions), bool)
    a, b = graph.edges.T
    off = np.abs(np.einsum("nk,nk->n", graph.positions[b] - graph.positions[a], graph.normals[a]))
    parallel = np.einsum("nk,nk->n", graph.normals[a], graph.normals[b]) > params.parallel_cos
    smooth = parallel & (off < params.step_cells * graph.size_m)
    upward = np.abs(graph.normals[:, 2])
    for flat in (upward > params.flat_cos, upward < params.upright_cos):
        labels = components(len(flat), graph.edges[flat[a] & flat[b] & smooth])
        large = np.bincount(labels, graph.area_m2)[labels] > params.structure_m2
        background |= large & flat & ~np.isin(labels, labels[seeds])
    return background


def local_surface(scene: Scene, positives: Points, reach_m: float, voxel_m: float | None) -> tuple[Points, Faces, Colours]:
    """Fused scan around the clicks; fused again with finer voxels on request."""
    centre = positives.mean(axis=0)
    reach = reach_m + float(np.linalg.norm(positives - centre, axis=1).max())
    if voxel_m is None or voxel_m >= scene.capture.surface.voxel_m:
        surface = scene.capture.surface
        vertices, colours = surface.vertices_world, surface.colours
        faces = surface.faces[scene.parts.faces_near(centre, reach)]
    else:
        fine = fuse_depth(
            _views_of(scene, centre, reach), voxel_m, depth_max_m=tuned(Params).depth_range_m[1], block_count=32_000
        )
        vertices, faces, colours = fine.vertices, fine.faces, fine.colours
    used, around = _renumbered(faces, len(vertices))
    near = np.linalg.norm(vertices[used] - centre, axis=1) < reach
    used, renumbered = _renumbered(faces[near[around[:, 0]] & near[around[:, 1]] & near[around[:, 2]]], len(vertices))
    return vertices[used], renumbered, colours[used]


def _renumbered(faces: Faces, count: int) -> tuple[np.ndarray, Faces]:
    """Indices of the vertices (of `count`) that faces use, and the faces renumbered to them."""
    used = np.zeros(count, bool)
    used[faces] = True
    return np.flatnonzero(used), (np.cumsum(used) - 1)[faces]


def _views_of(scene: Scene, centre: Vector3, reach_m: float, most: int = 40) -> list[DepthView]:
    """Sharpest and nearest depth images that see a ball, with everything outside it removed."""
    rated, (nearest, farthest) = [], tuned(Params).depth_range_m
    for frame in scene.frames:
        local = frame.world_from_camera.inverse.apply(centre)
        camera = frame.depth_camera
        if not nearest < local[2] < farthest:
            continue
        u, v = project(local, camera)
        if -0.1 * camera.width < u < 1.1 * camera.width and -0.1 * camera.height < v < 1.1 * camera.height:
            rated.append((-np.sqrt(max(frame.sharpness, 1e-3)) / local[2] ** 1.5, frame.index))
    views = []
    for _, index in sorted(rated)[:most]:
        frame = scene.frame(index)
        depth, camera = scene.depth(index), frame.depth_camera
        local = frame.world_from_camera.inverse.apply(centre)
        x, y = ray_slopes(np.arange(camera.width), np.arange(camera.height), camera)
        away = (x[None] * depth - local[0]) ** 2 + (y[:, None] * depth - local[1]) ** 2 + (depth - local[2]) ** 2
        inside = (depth > 0) & (away < reach_m**2)
        if inside.sum() < 30:
            continue
        colour = cv2.resize(scene.balanced(index), (camera.width, camera.height), interpolation=cv2.INTER_AREA)
        views.append(DepthView(np.where(inside, depth, 0).astype(np.float32), camera, frame.world_from_camera, colour))
    return views


def extract(vertices: Points, faces: Faces, chosen: np.ndarray, support: float | None) -> Thing | None:
    """Object of the chosen faces, with its support's height; None for fewer than 8."""
    kept = faces[chosen]
    if len(kept) < 8:
        return None
    used, renumbered = _renumbered(kept, len(vertices))
    return Thing(vertices[used], renumbered, support)
