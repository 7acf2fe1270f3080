"""Object under masks painted by a person: the surface that they show, cut from the surface that they leave out."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from r2c2r_core.arrays import DepthMetres, Faces, Mask, Points
from r2c2r_core.geometry.camera import depth_points, pixel_rays, project, sample_nearest, sample_through
from r2c2r_core.geometry.visibility import look_up
from r2c2r_core.model.capture import Frame
from r2c2r_core.model.inputs import PromptPoint
from r2c2r_core.segment.holes import find_hole
from r2c2r_core.segment.scene import Params as SceneParams
from r2c2r_core.segment.scene import Scene
from r2c2r_core.segment.things.min_cut import build_graph, cut
from r2c2r_core.segment.things.thing import Params as ThingParams
from r2c2r_core.segment.things.thing import (
    Thing,
    ThingConfig,
    closed_below,
    extract,
    local_surface,
    structure_of,
    support_height,
    thing_mask,
)
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of painted masks."""

    border_px: int = param(2, "px", "Distance in the depth image from a mask's border within which depth and mask blur", ge=0)
    around_m: float = param(0.2, "m", "Distance from the painted surface over which hidden surface becomes unlikely", gt=0)


def find_painted(scene: Scene, painted: Mapping[int, Mask], config: ThingConfig) -> Thing | None:
    """Surface that the masks (by frame) show, with its hidden part; None where they hold no depth.

    What a painted frame shows lies inside its mask or outside; a cut divides what none of them shows.
    """
    params, found = tuned(Params), tuned(ThingParams)
    views = [(scene.frame(index), _on_depth(mask, scene.frame(index))) for index, mask in painted.items()]
    own = _joined([_shown_surface(scene, frame, mask) for frame, mask in views])
    if not len(own[1]):
        return None
    vertices, faces, colours = local_surface(scene, own[0], found.surface_margin_m, None)
    graph = build_graph(vertices, faces, colours, 1.5 * scene.capture.surface.voxel_m)  # triangles touch at this size
    votes = np.sum([_votes(graph.positions, scene, frame, mask) for frame, mask in views], axis=0)
    inside, outside = np.flatnonzero(votes > 0).tolist(), np.flatnonzero(votes < 0).tolist()
    parts = [own]
    if inside:
        structure = structure_of(graph, inside)
        chosen, _ = cut(graph, inside, outside, params.around_m, structure, gap_m=found.furniture_gap_m)
        parts.append((vertices, faces[chosen[graph.voxel_of_face]]))
    vertices, faces = _joined(parts)
    thing = extract(vertices, faces, np.full(len(faces), fill_value=True), support_height(scene, own[0], config))
    return closed_below(thing, scene, config) if thing is not None and config.solid_gap_m else thing


def may_hold(mask: Mask, scene: Scene, frame: Frame, points: Points) -> bool:
    """Whether a mask painted in a frame holds one of the world points that the frame shows; True where it shows none."""
    z, seen, inside = look_up(points, frame.world_from_camera, frame.depth_camera, scene.depth(frame.index))
    shown = inside & ~scene.noise.occluded(seen, z, tuned(ThingParams).before_m)
    held, _ = sample_nearest(mask, project(frame.world_from_camera.inverse.apply(points), frame.rgb_camera))
    return bool(held[shown].any() or not shown.any())


def level_holes(scene: Scene, clicks: Sequence[PromptPoint]) -> dict[int, Mask]:
    """Holes of the depth images in a level surface at the clicks, by frame: a glass hob, which no frame has depth on."""
    found = {}
    for click in clicks:
        hole = find_hole(scene.frame(click.frame), scene.depth(click.frame), click.x, click.y)
        from_above = scene.ray(click.frame, click.x, click.y)[1][2] < 0
        if hole is not None and from_above and scene.level_depth(click.frame, click.x, click.y) is not None:
            found[click.frame] = hole
    return found


def with_clicked_parts(thing: Thing, scene: Scene, clicks: Sequence[PromptPoint]) -> Thing:
    """Object with the depth under those clicks that its mask misses: the fused surface lacks slanted and dark parts."""
    for click in clicks:
        frame = scene.frame(click.frame)
        if not thing_mask(thing, scene, frame)[0][int(click.y), int(click.x)]:
            part = _shown_surface(scene, frame, _part_at(thing, scene, frame, click))
            vertices, faces = _joined([(thing.vertices, thing.faces), part])
            thing = replace(thing, vertices=vertices, faces=faces)
    return thing


def _part_at(thing: Thing, scene: Scene, frame: Frame, click: PromptPoint) -> Mask:
    """Pixels of the depth image connected to a click, up to steps and to fused surface that is not the object's."""
    from scipy.spatial import cKDTree

    depth, near_m = scene.depth(frame.index), tuned(SceneParams).level_m
    points = frame.world_from_camera.apply(depth_points(depth, frame.depth_camera).reshape(-1, 3))
    vertices, _, _ = local_surface(scene, thing.vertices, tuned(ThingParams).surface_margin_m, None)
    off = vertices[cKDTree(thing.vertices).query(vertices)[0] > near_m]
    beside = (cKDTree(off).query(points, distance_upper_bound=near_m)[0] < near_m).reshape(depth.shape) if len(off) else False
    around = np.ones((3, 3), np.uint8)
    step = cv2.dilate(depth, around) - cv2.erode(np.where(depth > 0, depth, np.inf), around) > scene.noise.reach(
        depth, tuned(SceneParams).step_m
    )
    _, labels = cv2.connectedComponents(((depth > 0) & ~beside & ~step).astype(np.uint8), connectivity=4)
    scale = depth.shape[1] / frame.rgb_camera.width
    label = labels[int(click.y * scale), int(click.x * scale)]
    return np.asarray((labels == label) & (label > 0))


def _on_depth(mask: Mask, frame: Frame) -> Mask:
    """Mask of a frame, at any size, at its depth image's pixels."""
    values, inside = sample_through(mask, frame.rgb_camera.resized(*mask.shape[::-1]), frame.depth_camera)
    return values & inside


def _votes(points: Points, scene: Scene, frame: Frame, mask: Mask) -> np.ndarray:
    """1 for points that a frame shows in its mask, -1 for those that it shows outside, 0 for hidden ones and for the border."""
    around = np.ones((2 * tuned(Params).border_px + 1,) * 2, np.uint8)
    label = cv2.erode(mask.astype(np.int16), around) + cv2.dilate(mask.astype(np.int16), around) - 1
    z, seen, _ = look_up(points, frame.world_from_camera, frame.depth_camera, scene.depth(frame.index))
    said, _ = sample_nearest(label, project(frame.world_from_camera.inverse.apply(points), frame.depth_camera))
    return np.where(scene.noise.agrees(seen, z, tuned(SceneParams).level_m), said, 0)


def _shown_surface(scene: Scene, frame: Frame, mask: Mask) -> tuple[Points, Faces]:
    """Triangles of a frame's depth in its mask: the fused surface lacks thin, dark and slanted parts."""
    depth = _filled(scene, frame, mask)
    used = depth > 0
    number = np.cumsum(used).reshape(used.shape) - 1
    corners, numbers = (np.stack([grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]]) for grid in (depth, number))
    nearest = corners.min(axis=0)
    flat = (nearest > 0) & (np.ptp(corners, axis=0) < scene.noise.reach(nearest, tuned(SceneParams).step_m))
    quads = numbers[:, flat].T
    points = frame.world_from_camera.apply(depth_points(depth, frame.depth_camera)[used])
    return points, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def _filled(scene: Scene, frame: Frame, mask: Mask) -> DepthMetres:
    """Depth in a mask, 0 outside: in a hole in a level surface (a glass hob) that surface's, beside a step the nearest."""
    depth, reach_px = np.where(mask, scene.depth(frame.index), 0.0), tuned(SceneParams).step_px
    hole = cv2.distanceTransform(np.pad(mask & (depth == 0), 1).astype(np.uint8), cv2.DIST_L2, 5)[1:-1, 1:-1]
    row, column = np.unravel_index(int(hole.argmax()), hole.shape)
    scale = frame.rgb_camera.width / depth.shape[1]
    at = np.array([column + 0.5, row + 0.5]) * scale
    level = scene.level_depth(frame.index, *at) if hole[row, column] > reach_px else None
    if level is not None:
        rays = depth_points(np.ones_like(depth), frame.depth_camera) @ frame.world_from_camera.rotation[2]
        height = level * float(pixel_rays(at, frame.rgb_camera) @ frame.world_from_camera.rotation[2])
        depth = np.where(mask & (depth == 0), height / rays, depth)
    known = depth > 0
    away, nearest = cv2.distanceTransformWithLabels((~known).astype(np.uint8), cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL)
    values = np.zeros(int(nearest.max()) + 1)
    values[nearest[known]] = depth[known]
    return np.where(mask & (away < reach_px), values[nearest], 0.0)


def _joined(parts: list[tuple[Points, Faces]]) -> tuple[Points, Faces]:
    """Triangle surfaces as one."""
    starts = np.cumsum([0, *(len(points) for points, _ in parts)])
    faces = [faces + start for (_, faces), start in zip(parts, starts[:-1], strict=True)]
    return np.concatenate([points for points, _ in parts]), np.concatenate(faces)
