"""Factors of the pose estimate, linearised for Gauss-Newton: point-to-plane, silhouette, keypoints, gravity, support.

Closest points alone let a flat front slide in its plane; mask outlines (and the measured panel's edges) constrain it there.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np

from r2c2r_core.align.judge import behind_face, face_depth, render_pose
from r2c2r_core.align.lift import Lifted
from r2c2r_core.align.observe import Observation
from r2c2r_core.align.shape import Shape
from r2c2r_core.align.view import Params as ViewParams
from r2c2r_core.align.view import View
from r2c2r_core.arrays import Points, Vector3
from r2c2r_core.geometry.camera import ray_slopes
from r2c2r_core.geometry.least_squares import geman_mcclure
from r2c2r_core.geometry.transforms import Similarity3
from r2c2r_core.model.track import FrontPanel, MaskTrack
from r2c2r_core.tuning import param, tuned

_CROSS = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned weights and noise levels of the factors."""

    points: float = param(
        800.0, "count", "Effective number of independent readings in all observed points, as depth errors are correlated"
    )
    outline: float = param(200.0, "count", "Maximum effective number of independent readings in all silhouette pixels")
    keypoints: float = param(150.0, "count", "Maximum effective number of independent readings in all keypoints")
    upright: float = param(100.0, "count", "Number of readings, of one degree each, that the vertical counts as")
    support: float = param(40.0, "count", "Number of readings that the support height counts as")
    panel: tuple[float, float] = param(
        (60.0, 6.0), "count", "Number of readings per panel edge: at full confidence, and minimum"
    )
    finest: tuple[float, float] = param((0.012, 0.006), "m", "Robust scale for a refined pose: per metre of size, and minimum")
    away: float = param(
        -0.1, "cosine", "Minimum cosine between normal and direction to the camera: surfaces facing away are ignored", ge=-1
    )
    noise: float = param(3.0, "σ", "Gate on the depth residual along a keypoint's ray, in standard deviations")
    keypoint_px: float = param(1.5, "px", "Standard deviation of a keypoint in the image", gt=0)
    keypoint_m: float = param(0.001, "m", "Standard deviation of a keypoint on the mesh", gt=0)
    outline_m: float = param(0.002, "m", "Minimum standard deviation of an outline", gt=0)
    support_m: tuple[float, float] = param(
        (0.008, 0.03), "m", "Standard deviation of the support height, and gap above which the object has another support"
    )
    edge_m: float = param(0.005, "m", "Standard deviation of a panel's edge", gt=0)
    edge_cut: float = param(
        0.01, "share", "Fraction of a face's points ignored at either end, so that a spike is not an edge", lt=0.5
    )
    face_m: float = param(0.012, "m", "Half thickness of the mesh's face about the front plane")
    face_cos: float = param(0.85, "cosine", "Minimum cosine between the normals of the mesh's face and the front")
    face_points: int = param(50, "count", "Minimum number of points of a face with usable edges", ge=1)
    square_deg: float = param(8.0, "deg", "Maximum angle between the front's normal and the mesh's nearest box axis")
    axis_deg: float = param(3.0, "deg", "Maximum angle between up and a box axis for the axis to be vertical")
    base_deg: float = param(1.0, "deg", "Maximum angle between up and a base's normal for the mesh to stand on it")
    held: tuple[float, float] = param(
        (0.3, 0.01),
        "share",
        "Weight of the vertical for an object on a base and without one",
        source="leaves 0.2 and 1 degrees",
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Anchors:
    """Priors besides points and masks."""

    up_mesh: Vector3 | None  # mesh direction that should be vertical
    up_weight: float  # 0..1
    front: FrontPanel | None
    support_z_m: float | None


class Rows(NamedTuple):
    """Linearised residuals: `jacobian` (n, 7) over rotation, translation, log scale; residuals in units of `weight` ** -0.5."""

    jacobian: np.ndarray
    residual: np.ndarray
    weight: np.ndarray
    frame_index: np.ndarray  # (n,) int, frame of the observation; -1 for priors


def anchors_for(track: MaskTrack, shape: Shape, up_mesh: Vector3 | None) -> Anchors:
    """Priors that apply to this kind of object."""
    return Anchors(
        up_mesh=up_mesh,
        up_weight=0.0 if up_mesh is None else _up_weight(track, shape, up_mesh),
        front=track.front if track.kind == "front" else None,
        support_z_m=track.box.support_z_m if track.box is not None and track.kind == "thing" else None,
    )


def _up_weight(track: MaskTrack, shape: Shape, up_mesh: Vector3) -> float:
    """Weight of the upright prior of a mesh direction."""
    params = tuned(Params)
    axis = float(np.abs(shape.frames[0].T @ up_mesh).max()) > np.cos(np.radians(params.axis_deg))
    base = any(float(b @ up_mesh) > np.cos(np.radians(params.base_deg)) for b in shape.bases)
    on_base, loosely = params.held
    if track.kind != "thing":
        return 1.0 if axis else loosely
    return on_base if axis or base else loosely  # the mean normal of a flat side is a degree off


def all_rows(
    pose: Similarity3, shape: Shape, observation: Observation, anchors: Anchors, lifted: Sequence[Lifted], gate: float
) -> list[Rows]:
    """Linearised residuals of every factor at a pose."""
    pivot = pivot_of(pose, shape)
    return [
        point_rows(pose, shape, observation, pivot, gate),
        outline_rows(pose, shape, observation.views, anchors.front, pivot, gate),
        keypoint_rows(pose, lifted, pivot, gate),
        anchor_rows(pose, shape, anchors, pivot),
    ]


def finest_gate(observation: Observation) -> float:
    """Scale (m) of the Geman-McClure kernel for a refined pose, half the distance at which evidence stops counting."""
    per_metre, least = tuned(Params).finest
    return max(per_metre * observation.size_m, least)


def point_rows(pose: Similarity3, shape: Shape, observation: Observation, pivot: Vector3, gate: float) -> Rows:
    """Point-to-plane residuals from observed points to the nearest mesh points that face the cameras (Geman-McClure)."""
    params, observed = tuned(Params), observation.points_world
    if not len(observed):
        return _no_rows()
    _, nearest = shape.tree.query(pose.inverse.apply(observed))
    placed = pose.apply(shape.points[nearest])
    normals = shape.normals[nearest] @ pose.rotation.T
    residual = np.einsum("nj,nj->n", normals, placed - observed)
    apart = np.linalg.norm(placed - observed, axis=1)
    weight = geman_mcclure(apart, gate) / observation.noise_m**2
    if shape.oriented:
        weight[np.einsum("nj,nj->n", normals, observation.towards_camera) < params.away] = 0.0
    weight *= params.points / len(observed)
    return Rows(_jacobian(placed - pivot, normals), residual, weight, observation.frame_index)


def outline_rows(
    pose: Similarity3, shape: Shape, views: tuple[View, ...], front: FrontPanel | None, pivot: Vector3, gate: float
) -> Rows:
    """Distances from the placed mesh's silhouette pixels to the mask's outline, in metres across the line of sight."""
    vertices = pose.apply(shape.vertices)
    behind = behind_face(pose, shape, vertices, front)
    parts = [_outline_of_view(shape, vertices, behind, view, pivot, gate) for view in views]
    parts = [p for p in parts if len(p.residual)]
    if not parts:
        return _no_rows()
    total = sum(len(p.residual) for p in parts)
    joined = Rows(*(np.concatenate([getattr(p, name) for p in parts]) for name in Rows._fields))
    return joined._replace(weight=joined.weight * min(tuned(Params).outline / total, 1.0))


def keypoint_rows(pose: Similarity3, lifted: Sequence[Lifted], pivot: Vector3, gate: float) -> Rows:
    """Point-to-ray residuals of keypoints: texture constrains the pose where shape and silhouette do not.

    Only across the ray, where a pixel is finer than depth; the depth there is already among the observed points.
    """
    matched = [m for m in lifted if len(m.points_mesh)]
    if not matched:
        return _no_rows()
    placed = pose.apply(np.concatenate([m.points_mesh for m in matched]))
    rays, pixel_m = np.concatenate([m.rays for m in matched]), np.concatenate([m.pixel_m for m in matched])
    apart = placed - np.concatenate([m.points_world for m in matched])
    along = np.einsum("nj,nj->n", apart, rays)
    across = np.linalg.norm(apart - along[:, None] * rays, axis=1)
    params = tuned(Params)
    near = np.abs(along) < params.noise * np.concatenate([m.noise_m for m in matched]) + gate
    weight = near * geman_mcclure(across, gate) / (params.keypoint_px * pixel_m + params.keypoint_m) ** 2
    weight *= min(1.0, params.keypoints / max(int(np.count_nonzero(near & (across < gate))), 1))
    helper = np.where(np.abs(rays[:, 2:]) < 0.9, [[0.0, 0.0, 1.0]], [[1.0, 0.0, 0.0]])
    first = np.cross(rays, helper)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    sides = (first, np.cross(rays, first))
    return Rows(
        np.concatenate([_jacobian(placed - pivot, side) for side in sides]),
        np.concatenate([np.einsum("nj,nj->n", apart, side) for side in sides]),
        np.tile(weight, 2),
        np.tile(np.repeat([m.frame_index for m in matched], [len(m.points_mesh) for m in matched]), 2),
    )


def anchor_rows(pose: Similarity3, shape: Shape, anchors: Anchors, pivot: Vector3) -> Rows:
    """Priors: uprightness, the measured panel's edges and direction, and the support height."""
    params, rows = tuned(Params), list[tuple[np.ndarray, float, float]]()
    if anchors.up_mesh is not None:
        up = pose.rotation @ anchors.up_mesh
        weight = params.upright * anchors.up_weight / np.radians(1.0) ** 2
        rows += [(_turn_row(up, axis), float(up @ axis), weight) for axis in np.eye(3)[:2]]
    if anchors.front is not None:
        rows += _panel_rows(pose, shape, anchors.front, pivot)
    if anchors.support_z_m is not None:
        placed = pose.apply(shape.vertices)
        lowest = placed[int(np.argmin(placed[:, 2]))]
        gap = float(lowest[2] - anchors.support_z_m)
        sigma_m, other_m = params.support_m
        if abs(gap) < other_m:
            up_axis = np.array([[0.0, 0.0, 1.0]])
            rows.append((_jacobian((lowest - pivot)[None], up_axis)[0], gap, params.support / sigma_m**2))
    if not rows:
        return _no_rows()
    jacobian, residual, weight = (np.array(column) for column in zip(*rows, strict=True))
    return Rows(jacobian, residual, weight, np.full(len(rows), -1))


def pivot_of(pose: Similarity3, shape: Shape) -> Vector3:
    """Centre of the placed mesh."""
    return np.asarray(pose.apply((shape.points.min(axis=0) + shape.points.max(axis=0)) / 2))


def _outline_of_view(shape: Shape, vertices: Points, behind: np.ndarray, view: View, pivot: Vector3, gate: float) -> Rows:
    """Silhouette residuals of one view."""
    rendered = render_pose(shape, vertices, behind, view)
    own = rendered.own.astype(np.uint8)
    rim = rendered.own & (cv2.erode(own, _CROSS) == 0)
    beside_hidden = cv2.dilate((rendered.hidden | _nearer(view, rendered.depth_m)).astype(np.uint8), _CROSS, iterations=2) > 0
    rows, columns = np.nonzero(rim & view.trusted & view.inside & ~beside_hidden)
    if len(rows) < 4:
        return _no_rows()
    depth = rendered.depth_m[rows, columns].astype(np.float64)
    metres_per_px = depth / view.camera.fx
    residual = (view.signed_px[rows, columns] + 0.5) * metres_per_px
    g = view.outwards[rows, columns].astype(np.float64)
    usable = g.any(axis=1)
    x, y = ray_slopes(columns, rows, view.camera)
    points = view.world_from_camera.apply(np.stack([x, y, np.ones(len(x))], axis=1) * depth[:, None])
    direction = np.stack([g[:, 0], g[:, 1], -g[:, 0] * x - g[:, 1] * y], axis=1)
    weight = usable * geman_mcclure(residual, gate) / np.maximum(metres_per_px, tuned(Params).outline_m) ** 2
    jacobian = _jacobian(points - pivot, view.world_from_camera.turn(direction))
    return Rows(jacobian, residual, weight, np.full(len(residual), view.frame_index))


def _nearer(view: View, rendered_depth: np.ndarray) -> np.ndarray:
    """Pixels just outside the mesh where the photo shows an occluder in front of the mesh's nearby surface."""
    grown = cv2.dilate(rendered_depth, np.ones((5, 5), np.uint8))
    return np.asarray(
        (rendered_depth == 0)
        & (grown > 0)
        & ~view.mask
        & view.noise.occluded(view.depth_m, grown, tuned(ViewParams).occluder_gap_m)
    )


def _panel_rows(pose: Similarity3, shape: Shape, front: FrontPanel, pivot: Vector3) -> list[tuple[np.ndarray, float, float]]:
    """Residuals of the mesh's front face against the measured rectangle: four edges, and the facing direction."""
    params = tuned(Params)
    to_front = front.world_from_front.inverse
    axes = front.world_from_front.rotation
    local = to_front.apply(pose.apply(shape.points))
    depth = face_depth(pose, shape, front)
    facing = to_front.turn(shape.normals @ pose.rotation.T)[:, 1] < -params.face_cos
    face = local[facing & (np.abs(local[:, 1] - depth) < params.face_m)]
    if len(face) < params.face_points:
        return []
    trust = max(params.panel[0] * front.confidence, params.panel[1])
    rows = []
    for axis, size in ((0, front.width_m), (2, front.height_m)):
        inner_low, inner_high = np.quantile(face[:, axis], [params.edge_cut, 1 - params.edge_cut])
        overhang = (
            params.edge_cut / (1 - 2 * params.edge_cut) * (inner_high - inner_low)
        )  # part of an evenly sampled face cut off by the quantiles
        for edge, wanted in ((inner_low - overhang, -size / 2), (inner_high + overhang, size / 2)):
            middle = np.median(face, axis=0)
            middle[axis] = edge
            point = front.world_from_front.apply(middle)
            rows.append(
                (_jacobian((point - pivot)[None], axes[:, axis][None])[0], float(edge - wanted), trust / params.edge_m**2)
            )
    outward = pose.rotation @ _nearest_axis(shape, pose.rotation.T @ -axes[:, 1])
    if outward @ -axes[:, 1] > np.cos(np.radians(params.square_deg)):
        rows += [(_turn_row(outward, axes[:, k]), float(outward @ axes[:, k]), trust / np.radians(1.0) ** 2) for k in (0, 2)]
    return rows


def _nearest_axis(shape: Shape, direction: Vector3) -> Vector3:
    """Box axis of the mesh nearest to a direction, with that sign."""
    along = shape.frames[0].T @ direction
    k = int(np.argmax(np.abs(along)))
    return np.asarray(shape.frames[0][:, k] * np.sign(along[k]))


def _turn_row(direction: Vector3, axis: Vector3) -> np.ndarray:
    """Derivative of `direction @ axis` by a rotation of `direction`."""
    return np.concatenate([np.cross(direction, axis), np.zeros(4)])


def _jacobian(arms: Points, directions: Points) -> np.ndarray:
    """Derivative of points at `arms` from the pivot along `directions`, by rotation (rad), translation (m) and log scale."""
    return np.column_stack([np.cross(arms, directions), directions, np.einsum("nj,nj->n", arms, directions)])


def _no_rows() -> Rows:
    return Rows(np.zeros((0, 7)), np.zeros(0), np.zeros(0), np.zeros(0, np.int64))
