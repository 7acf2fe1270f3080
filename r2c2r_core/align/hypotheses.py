"""Pose hypotheses: the mesh's box axes aligned with the object's in all rotations of a box."""

from dataclasses import dataclass
from itertools import permutations, product
from typing import NamedTuple

import numpy as np

from r2c2r_core.align.judge import face_depth
from r2c2r_core.align.observe import Observation
from r2c2r_core.align.shape import Shape
from r2c2r_core.align.view import View, mask_box
from r2c2r_core.arrays import Matrix3, Vector3
from r2c2r_core.geometry.least_squares import geman_mcclure
from r2c2r_core.geometry.registration import umeyama_batch
from r2c2r_core.geometry.transforms import Similarity3, rotation_about_z, rotation_between
from r2c2r_core.model.track import MaskTrack
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of pose hypotheses and of their coarse alignment."""

    least_points: int = param(30, "count", "Minimum number of observed points for measuring a box", ge=1)
    cut: float = param(
        0.01, "share", "Fraction of the observed points ignored at either end of an axis, as depth has outliers", lt=0.5
    )
    mesh_cut: float = param(0.005, "share", "Fraction of the mesh's points ignored at either end of an axis", lt=0.5)
    plan_deg: float = param(3.0, "deg", "Yaw step of the search for the tightest upright box", gt=0)
    turn_deg: float = param(
        15.0, "deg", "Yaw step of the hypotheses of a free-standing object", source="coarse alignment corrects more", gt=0
    )
    alike_deg: float = param(5.0, "deg", "Maximum yaw difference of two measured boxes that count as one")
    alike_log: float = param(0.1, "log", "Maximum log ratio of the sides of two measured boxes that count as one")
    boxes: int = param(3, "count", "Maximum number of measured boxes", ge=1)
    proportion: float = param(1.4, "ratio", "Maximum ratio between the scales from a front's width and height")
    step_log: float = param(0.06, "log", "Minimum log ratio between two scales that are both tried")
    overlong: float = param(1.35, "ratio", "Maximum ratio of an observed side to the mesh's")
    facing: float = param(0.45, "cosine", "Minimum cosine to the viewing direction for a side to count as seen")
    fits: float = param(0.06, "share", "Maximum relative difference of a side at which the mesh is centred between both ends")
    narrow: float = param(
        300.0, "ratio", "Condition number of the masks' viewing rays above which the distance is undetermined"
    )
    agreed_log: float = param(0.1, "log", "Maximum median deviation of the views' log scales")
    samples: tuple[int, int, int] = param(
        (160, 250, 200), "count", "Number of points for coarse alignment, for outline hypotheses, and for outline misfit"
    )
    steps: int = param(5, "count", "Number of closest-point iterations", ge=3)
    coarse: tuple[int, int] = param(
        (2, 6), "count", "Iterations before pruning, and the multiple of the final number that survives it"
    )
    gates: tuple[float, float, float] = param(
        (0.12, 0.7, 0.02),
        "share",
        "Robust scale relative to the size (weight a quarter there): initial, shrink factor per step, minimum",
    )
    far: float = param(0.1, "share", "Distance, relative to the size, at which the cost of a point saturates")
    resized: tuple[float, float] = param((0.8, 1.25), "ratio", "Minimum and maximum rescaling during coarse alignment")
    same_deg: float = param(7.0, "deg", "Rotation difference below which aligned poses count as duplicates")
    same_log: float = param(0.04, "log", "Log scale ratio below which aligned poses count as duplicates")


class Hypothesis(NamedTuple):
    """A pose of the mesh and its source."""

    pose: Similarity3  # world_from_mesh
    up_mesh: Vector3 | None  # the mesh direction that should be vertical
    source: str  # "box" or "features"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Extents:
    """The object's box in a gravity-aligned frame; axes where `known` is False were not seen from both sides."""

    world_from_axes: Matrix3  # columns: right, into, up
    low: Vector3  # along those axes, in metres from the world's origin
    high: Vector3
    known: np.ndarray  # (3,) bool
    towards: Vector3  # mean direction to the cameras, in those axes

    @property
    def size(self) -> Vector3:
        """Side lengths."""
        return np.asarray(self.high - self.low)


def box_hypotheses(shape: Shape, observation: Observation, track: MaskTrack, room_yaw_rad: float) -> list[Hypothesis]:
    """All rotations of the mesh's box onto the measured boxes, at the scales that their sides suggest.

    Gravity fixes the world's up, not the mesh's: a mesh comes in an arbitrary frame, so each of its box directions may be up.
    Furniture shares its front's axes (24 rotations); a free-standing object may have any yaw.
    """
    boxes = measured_extents(observation, track, room_yaw_rad)
    found: list[Hypothesis] = []
    for box in boxes:
        turns = _turns(shape, box, free_yaw=track.kind == "thing")
        for rotation, up in turns:
            found.extend(Hypothesis(pose, up, "box") for pose in _scaled(shape, rotation, box, track))
        if track.kind != "front" and box is boxes[0]:
            found.extend(_by_outline(shape, turns, observation.views))
    return found


def signed_permutations() -> list[Matrix3]:
    """The 24 rotations of a cube (the paper's eq. 11-12 mean these: no reflections)."""
    turns = []
    for order in permutations(range(3)):
        for signs in product((1.0, -1.0), repeat=3):
            matrix = np.zeros((3, 3))
            matrix[range(3), order] = signs
            if np.linalg.det(matrix) > 0:
                turns.append(matrix)
    return turns


def measured_extents(observation: Observation, track: MaskTrack, room_yaw_rad: float) -> list[Extents]:
    """The object's box by the segmenter's measurements and by the visible points."""
    boxes = []
    if track.front is not None:
        front = track.front
        rotation = front.world_from_front.rotation
        low, high = _span(observation, rotation)
        centre, half = rotation.T @ front.centre, front.corners_front[1]
        known = np.array([True, False, True])
        low = np.where(known, centre - half, np.minimum(low, centre))
        high = np.where(known, centre + half, np.maximum(high, centre))
        boxes.append(_extents(observation, rotation, low, high, known))
    if track.box is not None and track.kind != "front":
        rotation = track.box.world_from_object.rotation
        centre, half = rotation.T @ track.box.world_from_object.translation, track.box.dimensions_m / 2
        boxes.append(_extents(observation, rotation, centre - half, centre + half, np.ones(3, dtype=bool)))
    if track.kind != "front" or not boxes:
        for rotation in (_plan_axes(observation), rotation_about_z(room_yaw_rad)):
            if len(observation.points_world) >= tuned(Params).least_points:
                low, high = _span(observation, rotation)
                boxes.append(_extents(observation, rotation, low, high, np.ones(3, dtype=bool)))
    return _distinct(boxes)


def settle(
    hypotheses: list[Hypothesis], shape: Shape, observation: Observation, keep: int, *, outlines: bool
) -> list[Hypothesis]:
    """Coarse alignment: batched robust ICP of all hypotheses on few points; keeps the best-fitting distinct ones.

    With `outlines` the bounding boxes of the masks count too: they constrain the size where depth is missing.
    """
    params, points = tuned(Params), observation.points_world
    if len(points) < params.least_points or not hypotheses:
        return hypotheses[:keep]
    sample = points[np.linspace(0, len(points) - 1, min(params.samples[0], len(points))).astype(np.int64)]
    which = np.arange(len(hypotheses))
    scales = np.array([h.pose.scale for h in hypotheses])
    rotations = np.stack([h.pose.rotation for h in hypotheses])
    shifts = np.stack([h.pose.translation for h in hypotheses])
    widest, shrunk, finest = params.gates
    first_scales, gate = scales.copy(), widest * observation.size_m
    for step in range(params.steps + 1):
        local = ((sample - shifts[:, None]) @ rotations) / scales[:, None, None]
        raw, nearest = shape.tree.query(local.reshape(-1, 3))
        distance = raw.reshape(local.shape[:2]) * scales[:, None]
        cost = np.minimum(distance / (params.far * observation.size_m), 1.0).mean(axis=1)
        if step == params.steps:
            break
        matched = shape.points[nearest].reshape(local.shape)
        if step == params.coarse[0]:  # prune the hundreds of hypotheses that are far off
            few = np.sort(np.argsort(cost, kind="stable")[: params.coarse[1] * keep])
            which, scales, rotations, shifts, first_scales, distance, matched = (
                values[few] for values in (which, scales, rotations, shifts, first_scales, distance, matched)
            )
        weight = geman_mcclure(distance, gate)
        target = np.broadcast_to(sample[None], matched.shape)
        scales, rotations, shifts = umeyama_batch(matched, target, weight)
        bounded = np.clip(scales, params.resized[0] * first_scales, params.resized[1] * first_scales)
        centre = np.einsum("kn,knj->kj", weight / weight.sum(axis=1, keepdims=True), matched)
        turned = np.einsum("kij,kj->ki", rotations, centre)
        shifts = shifts + (scales - bounded)[:, None] * turned
        scales, gate = bounded, max(shrunk * gate, finest * observation.size_m)
    if outlines:
        cost = cost + _outline_misfit(shape, scales, rotations, shifts, observation.views)
    order = np.argsort(cost, kind="stable")
    kept: list[int] = []
    for k in order:
        if len(kept) == keep:
            break
        if all(not _same(scales, rotations, int(k), j) for j in kept):
            kept.append(int(k))
    return [
        Hypothesis(Similarity3(float(scales[k]), rotations[k], shifts[k]), hypotheses[which[k]].up_mesh, "box") for k in kept
    ]


def _by_outline(shape: Shape, turns: list[tuple[Matrix3, Vector3]], views: tuple[View, ...]) -> list[Hypothesis]:
    """Rotations at the scale and position from the masks' bounding boxes alone, where the views agree on them."""
    params = tuned(Params)
    boxes = np.array([mask_box(v) for v in views])
    eyes = np.array([v.world_from_camera.translation for v in views])
    middle = np.column_stack([(boxes[:, 0] + boxes[:, 2]) / 2, (boxes[:, 1] + boxes[:, 3]) / 2, np.ones(len(views))])
    rays = np.stack([v.world_from_camera.rotation @ m for v, m in zip(views, middle, strict=True)])
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    across = np.eye(3)[None] - rays[:, :, None] * rays[:, None, :]
    normal = across.sum(axis=0)
    if np.linalg.cond(normal) > params.narrow:  # all views from one side: the distance is undetermined
        return []
    centre = np.linalg.solve(normal, (across @ eyes[:, :, None]).sum(axis=0)[:, 0])
    distance = np.linalg.norm(eyes - centre, axis=1)
    sample = shape.points[:: max(len(shape.points) // params.samples[1], 1)]
    found = []
    for rotation, up in turns:
        turned = sample @ rotation.T
        seen = np.stack([turned @ v.world_from_camera.rotation[:, :2] for v in views])  # (views, n, 2)
        spread = np.ptp(seen, axis=1)
        ratio = np.log((boxes[:, 2:] - boxes[:, :2]) * distance[:, None] / np.maximum(spread, 1e-9))
        if np.median(np.abs(ratio - np.median(ratio))) < params.agreed_log:
            scale = float(np.exp(np.median(ratio)))
            pivot = (turned.min(axis=0) + turned.max(axis=0)) / 2
            found.append(Hypothesis(Similarity3(scale, rotation, centre - scale * pivot), up, "box"))
    return found


def _outline_misfit(
    shape: Shape, scales: np.ndarray, rotations: np.ndarray, shifts: np.ndarray, views: tuple[View, ...]
) -> np.ndarray:
    """1 minus the mean IoU of the projected samples' bounding box with the mask's, per hypothesis."""
    sample = shape.points[:: max(len(shape.points) // tuned(Params).samples[2], 1)]
    world = scales[:, None, None] * (sample @ rotations.transpose(0, 2, 1)) + shifts[:, None]
    overlap = np.zeros(len(scales))
    for view in views:
        camera = (world - view.world_from_camera.translation) @ view.world_from_camera.rotation
        uv = camera[..., :2] / np.maximum(camera[..., 2:], 0.05)
        limit = view.camera.cx / view.camera.fx
        low, high = np.clip(uv.min(axis=1), -limit, limit), np.clip(uv.max(axis=1), -limit, limit)
        box = mask_box(view)
        common = np.maximum(np.minimum(high, box[2:]) - np.maximum(low, box[:2]), 0.0).prod(axis=1)
        union = (high - low).prod(axis=1) + (box[2:] - box[:2]).prod() - common
        overlap += common / np.maximum(union, 1e-12)
    return np.asarray(1.0 - overlap / max(len(views), 1))


def _same(scales: np.ndarray, rotations: np.ndarray, a: int, b: int) -> bool:
    """Whether two aligned hypotheses count as duplicates."""
    params = tuned(Params)
    turn = np.trace(rotations[a].T @ rotations[b])
    close = turn > 1.0 + 2.0 * np.cos(np.radians(params.same_deg))
    return bool(close and abs(np.log(scales[a] / scales[b])) < params.same_log)


def _turns(shape: Shape, box: Extents, *, free_yaw: bool) -> list[tuple[Matrix3, Vector3]]:
    """Candidate rotations world_from_mesh, each with the mesh direction that it makes vertical."""
    if not free_yaw:
        return [
            (box.world_from_axes @ turn @ frame.T, (turn @ frame.T).T @ np.array([0.0, 0.0, 1.0]))
            for frame in shape.frames[:2]
            for turn in signed_permutations()
        ]
    turns, step_deg = [], tuned(Params).turn_deg
    for up in shape.ups:
        upright = rotation_between(up, np.array([0.0, 0.0, 1.0]))
        sides = shape.frames[0] - np.outer(up, up @ shape.frames[0])
        side = upright @ sides[:, int(np.argmax(np.linalg.norm(sides, axis=0)))]
        first = float(np.arctan2(box.world_from_axes[1, 0], box.world_from_axes[0, 0]) - np.arctan2(side[1], side[0]))
        yaws = first + np.radians(np.arange(0.0, 360.0, step_deg))
        turns += [(rotation_about_z(float(yaw)) @ upright, up) for yaw in yaws]
    return turns


def _scaled(shape: Shape, rotation: Matrix3, box: Extents, track: MaskTrack) -> list[Similarity3]:
    """Poses of the rotated mesh at the scales that its visible sides suggest, positioned at the box."""
    params = tuned(Params)
    turned = shape.points[::3] @ rotation.T @ box.world_from_axes
    low, high = np.quantile(turned, params.mesh_cut, axis=0), np.quantile(turned, 1 - params.mesh_cut, axis=0)
    ratio = box.size / np.maximum(high - low, 1e-9)
    if not box.known[1]:
        pair = ratio[[0, 2]]
        if pair.max() / pair.min() > params.proportion:
            return []
        scales = [float(np.sqrt(pair.prod()))]
    else:
        scales = _distinct_scales([float(np.median(ratio)), float(ratio[2]), float(ratio.max())], ratio)
    return [_stand(shape, rotation, scale, low, high, box, track) for scale in scales]


def _distinct_scales(scales: list[float], ratio: np.ndarray) -> list[float]:
    """Scales that clearly differ and leave no visible side much longer than the mesh's."""
    params, kept = tuned(Params), list[float]()
    for scale in scales:
        if ratio.max() / scale < params.overlong and all(abs(np.log(scale / k)) > params.step_log for k in kept):
            kept.append(scale)
    return kept


def _stand(
    shape: Shape, rotation: Matrix3, scale: float, low: Vector3, high: Vector3, box: Extents, track: MaskTrack
) -> Similarity3:
    """Pose with the side that faces the cameras aligned to the box's, or the centres where neither side does."""
    params = tuned(Params)
    facing = np.where(np.abs(box.towards) > params.facing, np.sign(box.towards), 0.0)
    facing[box.known & (np.abs(scale * (high - low) - box.size) < params.fits * box.size)] = 0.0
    mesh_anchor = scale * ((low + high) / 2 + facing * (high - low) / 2)
    box_anchor = (box.low + box.high) / 2 + facing * box.size / 2
    pose = Similarity3(scale, rotation, box.world_from_axes @ (box_anchor - mesh_anchor))
    if track.front is None or box.known[1]:
        return pose
    shift = -face_depth(pose, shape, track.front)
    return Similarity3(scale, rotation, pose.translation + shift * track.front.world_from_front.rotation[:, 1])


def _extents(observation: Observation, rotation: Matrix3, low: Vector3, high: Vector3, known: np.ndarray) -> Extents:
    """Extents with the mean direction towards the cameras."""
    cameras = np.array([v.world_from_camera.translation for v in observation.views]) - observation.centre_world
    towards = (cameras / np.linalg.norm(cameras, axis=1, keepdims=True)).mean(axis=0) @ rotation
    return Extents(world_from_axes=rotation, low=low, high=high, known=known, towards=towards)


def _span(observation: Observation, rotation: Matrix3) -> tuple[Vector3, Vector3]:
    """Minimum and maximum of the visible points along the axes, without outliers."""
    cut, points = tuned(Params).cut, observation.points_world @ rotation
    if not len(points):
        return np.full(3, np.inf), np.full(3, -np.inf)
    return np.quantile(points, cut, axis=0), np.quantile(points, 1 - cut, axis=0)


def _plan_axes(observation: Observation) -> Matrix3:
    """Axes of the tightest upright box around the visible points."""
    angles = np.radians(np.arange(0.0, 90.0, tuned(Params).plan_deg))
    areas = []
    for angle in angles:
        low, high = _span(observation, rotation_about_z(float(angle)))
        areas.append(float(np.prod(high[:2] - low[:2])))
    return rotation_about_z(float(angles[int(np.argmin(areas))]))


def _distinct(boxes: list[Extents]) -> list[Extents]:
    """The first boxes that differ in yaw (modulo a quarter turn) or size."""
    kept: list[Extents] = []
    for box in boxes:
        if all(_differs(box, k) for k in kept):
            kept.append(box)
    return kept[: tuned(Params).boxes]


def _differs(a: Extents, b: Extents) -> bool:
    params = tuned(Params)
    relative = np.abs(a.world_from_axes.T @ b.world_from_axes)[:2, :2]
    turned = relative.max(axis=1).min() < np.cos(np.radians(params.alike_deg))
    same_order = relative[0, 0] > relative[0, 1]
    size = b.size if same_order else b.size[[1, 0, 2]]
    resized = (np.abs(np.log(np.maximum(a.size, 1e-3) / np.maximum(size, 1e-3))) > params.alike_log).any()
    return bool(turned or resized)
