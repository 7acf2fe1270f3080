"""Furniture fronts and appliances: a box with flat faces, its front on the measured plane, with handle and relief."""

from dataclasses import replace

import numpy as np

from r2c2r_core.arrays import Points, Vector3
from r2c2r_core.errors import GenerationFailed
from r2c2r_core.generate.evidence import Evidence, View, masked_points
from r2c2r_core.generate.priors import DepthBehind, category_depth, depth_behind
from r2c2r_core.generate.rear_edge import rear_edge
from r2c2r_core.generate.relief import BoxPart, find_steps, handle_parts, measure_heights, measured_protrusion
from r2c2r_core.generate.shape import Shape
from r2c2r_core.generate.variation import Variation
from r2c2r_core.geometry.meshes import box_mesh, unite
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.track import FrontHandle, FrontPanel, ThingBox

_FRONT_ZONE_M = 0.03  # faces this near to the outer face belong to the front
_LEAST_FACE_POINTS = 200
_LOOKED_AT = 0.3  # cosine: a face seen at a flatter angle is not measured


def front_shape(evidence: Evidence, variation: Variation) -> Shape:
    """A front's panel extruded to the wall or its category's depth; frame `front`."""
    track, front = evidence.track, evidence.track.front
    if front is None:
        raise GenerationFailed(f"{track.name}: no front rectangle was measured", hint="add a click that faces it")
    behind = depth_behind(evidence.capture, front.world_from_front, front.width_m, front.height_m, track.category)
    depth = _assumed_depth(behind, variation)
    low = np.array([-front.width_m / 2, 0.0, -front.height_m / 2])
    high = np.array([front.width_m / 2, depth, front.height_m / 2])
    shape = _box_with_front(BoxPart(low, high), front.world_from_front, front, variation)
    centres_y = shape.vertices_local[shape.faces][:, :, 1].max(axis=1)
    return replace(shape, maskable=centres_y < _FRONT_ZONE_M, parameters={**shape.parameters, "depth_m": depth})


def appliance_shape(evidence: Evidence, variation: Variation) -> Shape:
    """An appliance's box, its seen faces measured again on these frames; frame `object`."""
    track, box = evidence.track, evidence.track.box
    if box is None:
        raise GenerationFailed(f"{track.name}: no box was measured", hint="add a click on a frame that shows it whole")
    world_from_local = box.world_from_object
    low, high = _measured_box(box, variation)
    if track.front is not None:
        low[1] = float(world_from_local.inverse.apply(track.front.world_from_front.translation[None])[0, 1])
    high[1] = rear_edge(low, high, evidence.pool, world_from_local)
    high[1] = low[1] + _appliance_depth(evidence, variation, box, float(high[1] - low[1]))
    return _box_with_front(BoxPart(low, high), world_from_local, _local_front(track.front, box), variation)


def _box_with_front(box: BoxPart, world_from_local: Rigid3, front: FrontPanel | None, variation: Variation) -> Shape:
    """The box, with the handle and the steps of `front`; the front's own frame must be parallel to the local frame."""
    added, removed = [box], []
    parameters = {}
    if front is not None:
        points = [front.world_from_front.inverse.apply(masked_points(v, variation.erosion_px)) for v in variation.views]
        footprint = _depth_footprint(variation.views, front.world_from_front.translation)
        heights = measure_heights(points, front.width_m, front.height_m, max(0.006, 1.5 * footprint))
        raised, sunk = find_steps(heights, front.handle)
        pieces = raised
        if front.handle is not None:
            handle = replace(front.handle, protrusion_m=measured_protrusion(heights, front.handle, footprint))
            pieces = [*raised, *handle_parts(_plausible(handle), as_bar=variation.carve_votes > 1)]
        offset = world_from_local.inverse.apply(front.world_from_front.translation[None])[0]
        added += [BoxPart(part.low + offset, part.high + offset) for part in pieces]
        removed = [BoxPart(part.low + offset, part.high + offset) for part in sunk]
        parameters = {"raised_steps": float(len(raised)), "sunk_steps": float(len(sunk))}
    vertices, faces = unite([box_mesh(*part) for part in added], [box_mesh(*part) for part in removed])
    return Shape(
        vertices_local=vertices,
        faces=faces,
        world_from_local=world_from_local,
        front_y_m=float(box.low[1]),
        maskable=np.ones(len(faces), dtype=bool),
        parameters=parameters,
        warnings=(),
    )


def _assumed_depth(behind: DepthBehind, variation: Variation) -> float:
    """A measured wall is varied little, a category's depth by its full spread."""
    spread = 0.2 if behind.source == "wall" else 1.0
    return behind.depth_m * (1.0 + spread * (variation.depth_scale - 1.0))


def _appliance_depth(evidence: Evidence, variation: Variation, box: ThingBox, measured_m: float) -> float:
    """The measured depth where a side shows it; the category's or the wall's where only the front was seen."""
    usual = category_depth(evidence.track.category)
    if measured_m > 0.6 * usual and _side_seen(box, variation.views):
        return measured_m
    rear = Rigid3(
        box.world_from_object.rotation, box.world_from_object.apply(np.array([[0.0, -float(box.dimensions_m[1]) / 2, 0.0]]))[0]
    )
    width, _, height = (float(v) for v in box.dimensions_m)
    behind = depth_behind(evidence.capture, rear, width, height, evidence.track.category)
    return max(_assumed_depth(behind, variation), measured_m)


def _measured_box(box: ThingBox, variation: Variation) -> tuple[Vector3, Vector3]:
    """Corners of the box in its own frame, each face that cameras look at moved to the median of its points."""
    half = np.asarray(box.dimensions_m, dtype=np.float64) / 2
    low, high = -half, half.copy()
    for axis in range(3):
        for sign, corner in ((-1.0, low), (1.0, high)):
            found = [_face_points(v, box, half, axis, sign, variation.erosion_px) for v in variation.views]
            points = np.concatenate(found)
            if len(points) >= _LEAST_FACE_POINTS:
                limit = 0.04 * 2 * half[axis]
                corner[axis] += float(np.clip(np.median(points) - corner[axis], -limit, limit))
    return low, high


def _face_points(view: View, box: ThingBox, half: Vector3, axis: int, sign: float, erosion_px: float) -> np.ndarray:
    """Coordinates along `axis` of the view's points on one face, where the view looks at that face."""
    eye = box.world_from_object.inverse.apply(view.eye_world[None])[0]
    towards = eye - np.where(np.arange(3) == axis, sign * half, 0.0)
    if sign * towards[axis] < _LOOKED_AT * np.linalg.norm(towards):
        return np.zeros(0)
    points: Points = box.world_from_object.inverse.apply(masked_points(view, erosion_px))
    near = np.abs(points[:, axis] - sign * half[axis]) < max(0.03, 0.06 * half[axis])
    others = [k for k in range(3) if k != axis]
    within = (np.abs(points[:, others]) < 0.85 * half[others]).all(axis=1)
    return np.asarray(points[near & within, axis])


def _side_seen(box: ThingBox, views: tuple[View, ...]) -> bool:
    """Whether a camera looks at the left, right or top face, which show the depth."""
    half = np.asarray(box.dimensions_m) / 2
    eyes = box.world_from_object.inverse.apply(np.array([v.eye_world for v in views]))
    outside = np.abs(eyes[:, [0, 2]]) - half[[0, 2]]
    distance = np.linalg.norm(eyes, axis=1, keepdims=True)
    seen = np.column_stack([outside[:, :1], np.sign(eyes[:, 2:]) * outside[:, 1:]]) > 0.2 * distance
    return bool(seen.any())


def _local_front(front: FrontPanel | None, box: ThingBox) -> FrontPanel | None:
    """The appliance's front, turned parallel to its box; None where it faces elsewhere."""
    if front is None:
        return None
    turn = box.world_from_object.rotation.T @ front.world_from_front.rotation
    if turn[1, 1] < np.cos(np.radians(15.0)):
        return None
    return replace(front, world_from_front=Rigid3(box.world_from_object.rotation, front.world_from_front.translation))


def _depth_footprint(views: tuple[View, ...], target_world: Vector3) -> float:
    """Size of a depth pixel on the object, metres, at the median distance."""
    sizes = [float(np.linalg.norm(v.eye_world - target_world)) / v.depth_camera.fx for v in views]
    return float(np.median(sizes))


def _plausible(handle: FrontHandle) -> FrontHandle:
    """Hands need 1 cm to 9 cm."""
    return replace(handle, protrusion_m=float(np.clip(handle.protrusion_m, 0.01, 0.09)))
