"""Pose of a leaf in one frame without a joint constraint: its plane by robust least squares on depth, with covariance."""

from dataclasses import dataclass

import numpy as np

from r2c2r_core.arrays import Points
from r2c2r_core.geometry.camera import project, unproject
from r2c2r_core.geometry.least_squares import fit_linear, geman_mcclure
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.capture import Frame
from r2c2r_core.segment.motion.leaf import Leaf
from r2c2r_core.segment.scene import Scene
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the plane fit."""

    gates_m: tuple[float, ...] = param(
        (0.05, 0.025, 0.015), "m", "Maximum distances from the plane of depth on the leaf, in successive rounds"
    )
    inside: float = param(0.92, "share", "Fraction of a leaf's half width and height within which depth is its own")
    least_points: int = param(40, "count", "Minimum number of depth points on a plane", ge=10)
    spans: float = param(0.35, "share", "Minimum fraction of a leaf's width and height that they must span")
    near_m: float = param(
        0.035, "m", "Maximum distance of the leaf's centre from the expected one: a step of states and its thickness"
    )
    near_rad: float = param(
        float(np.deg2rad(6.0)), "rad", "Maximum slope of the plane relative to the expected one: two steps of states"
    )
    together: float = param(6.0, "ratio", "Number of correlated points that count as one independent measurement", gt=0)
    place_m: float = param(0.003, "m", "Standard deviation of a frame's position", source="ARKit over a kitchen: millimetres")
    turn_rad: float = param(float(np.deg2rad(0.15)), "rad", "Standard deviation of a frame's orientation")
    scale_m: float = param(0.004, "m", "Residual scale above which points lose weight (Geman and McClure 1987)", gt=0)


@dataclass(frozen=True, slots=True, eq=False)
class PlaneFix:
    """A leaf's plane in one frame: y = plane @ (1, x, z) in the frame of the leaf at its `expected` pose."""

    frame_index: int
    expected: Rigid3  # front_from_leaf
    plane: np.ndarray  # (3,) metres, and slopes along x and z
    covariance: np.ndarray  # (3, 3)
    is_back: bool  # whether the camera saw the inner face
    points: int


def fix_plane(leaf: Leaf, expected: Rigid3, scene: Scene, frame: Frame) -> PlaneFix | None:
    """Plane of depth near an expected pose; None where the frame shows too little of it."""
    params = tuned(Params)
    world_from_leaf = leaf.world_from_front @ expected
    local, sigma = _points_near(leaf, world_from_leaf, scene, frame)
    is_back = bool(world_from_leaf.inverse.apply(frame.world_from_camera.translation[None])[0, 1] > 0)
    y = local[:, 1] - (leaf.thickness_m if is_back else 0.0)
    design = np.stack([np.ones(len(local)), local[:, 0], local[:, 2]], axis=1)
    plane = np.zeros(3)
    information = np.eye(3)
    for gate in params.gates_m:
        off = y - design @ plane
        near = np.abs(off) < gate
        if near.sum() < params.least_points:
            return None
        scale = np.hypot(params.scale_m, sigma[near])
        plane, information = fit_linear(design[near], y[near], geman_mcclure, scale, rounds=5, start=plane)
    spans = np.ptp(np.quantile(local[near][:, [0, 2]], [0.03, 0.97], axis=0), axis=0)
    far = abs(plane[0]) > params.near_m or (np.abs(plane[1:]) > params.near_rad).any()
    if far or (spans < params.spans * np.array([leaf.width_m, leaf.height_m])).any():
        return None
    covariance = params.together * np.linalg.inv(information) + np.diag(
        [params.place_m**2, params.turn_rad**2, params.turn_rad**2]
    )
    return PlaneFix(frame.index, expected, plane, covariance, is_back, int(near.sum()))


def _points_near(leaf: Leaf, world_from_leaf: Rigid3, scene: Scene, frame: Frame) -> tuple[Points, np.ndarray]:
    """Depth points within the leaf's outline, in its frame, and the standard deviation of each along the leaf's normal."""
    params = tuned(Params)
    camera, depth = frame.depth_camera, scene.depth(frame.index)
    outline = frame.world_from_camera.inverse.apply(world_from_leaf.apply(leaf.corners_front))
    uv = project(np.maximum(outline, [-np.inf, -np.inf, 0.1]), camera)
    low = np.clip(np.floor(uv.min(axis=0)), 0, [camera.width, camera.height]).astype(int)
    high = np.clip(np.ceil(uv.max(axis=0)), 0, [camera.width, camera.height]).astype(int)
    row, column = np.nonzero(depth[low[1] : high[1], low[0] : high[0]] > 0)
    row, column = row + low[1], column + low[0]
    z = depth[row, column].astype(np.float64)
    seen = unproject(np.stack([column + 0.5, row + 0.5], axis=1), z, camera)
    leaf_from_camera = world_from_leaf.inverse @ frame.world_from_camera
    local = leaf_from_camera.apply(seen)
    half_w, half_h = leaf.half_m
    near = (np.abs(local[:, 0]) < params.inside * half_w) & (np.abs(local[:, 2]) < params.inside * half_h)
    near &= np.abs(local[:, 1]) < 2 * max(params.gates_m)
    height = abs(float(leaf_from_camera.translation[1]))
    return local[near], scene.noise.sigma(z[near]) * height / z[near]
