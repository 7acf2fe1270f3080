"""Shape metrics: exact solid IoU of the boxes, and the mesh's fit to the scan."""

from dataclasses import replace
from typing import Literal

import numpy as np

from r2c2r_core.evaluate.pose import yaw_between
from r2c2r_core.evaluate.records import ObjectRecord
from r2c2r_core.geometry.transforms import Rigid3, rotation_about_z
from r2c2r_core.model.report import Metric

_SCAN_METRICS: tuple[tuple[str, str, str, Literal["lower", "higher"]], ...] = (
    ("scan_to_mesh_median", "median_m", "mm", "lower"),
    ("scan_to_mesh_p95", "p95_m", "mm", "lower"),
    ("f_score_1cm", "f_score_1cm", "share", "higher"),
    ("f_score_2cm", "f_score_2cm", "share", "higher"),
)
_THINNEST_M = 1e-6  # boxes with a thinner intersection count as disjoint


def shape_errors(truth: ObjectRecord, found: ObjectRecord) -> tuple[Metric, ...]:
    """Exact solid IoU of the boxes (no voxels), and the bundle's own figures of its mesh's fit to the scan."""
    overlap = Metric(name="box_iou", value=box_iou(truth, found), unit="share", better="higher", tolerance=0.01)
    return (overlap, *(_scan_metric(found, *entry) for entry in _SCAN_METRICS))


def _scan_metric(found: ObjectRecord, name: str, key: str, unit: str, better: Literal["lower", "higher"]) -> Metric:
    value = None if found.scan_fit is None else found.scan_fit.get(key)
    return Metric(
        name=name,
        value=None if value is None else (1000.0 * value if unit == "mm" else value),
        unit=unit,
        better=better,
        tolerance=1.0 if unit == "mm" else 0.03,
        note="" if value is not None else "not reported by the bundle",
    )


def box_iou(truth: ObjectRecord, found: ObjectRecord) -> float:
    """Solid IoU of two boxes in any pose; at equal yaw for a round object, whose box has an arbitrary yaw."""
    if truth.turns_freely:
        found = _turned_to(truth, found)
    volumes = float(np.prod(truth.dimensions_m)), float(np.prod(found.dimensions_m))
    shared = min(_shared_volume(truth, found), *volumes)
    return shared / max(sum(volumes) - shared, 1e-12)


def _turned_to(truth: ObjectRecord, found: ObjectRecord) -> ObjectRecord:
    """The found object turned about the true one's vertical axis until their yaws are equal."""
    upright, pose = truth.world_from_object.rotation, found.world_from_object
    back = upright @ rotation_about_z(-yaw_between(truth, found)) @ upright.T
    return replace(found, world_from_object=Rigid3(back @ pose.rotation, pose.translation))


def _shared_volume(a: ObjectRecord, b: ObjectRecord) -> float:
    """Volume of the intersection of two boxes: the convex body inside all twelve half-spaces."""
    from scipy.optimize import linprog
    from scipy.spatial import ConvexHull, HalfspaceIntersection

    reach = (np.linalg.norm(a.dimensions_m) + np.linalg.norm(b.dimensions_m)) / 2
    if np.linalg.norm(a.world_from_object.translation - b.world_from_object.translation) >= reach:
        return 0.0
    planes = np.vstack([_half_spaces(a), _half_spaces(b)])
    # The centre of the largest ball inside all half-spaces: maximise r with n @ x + r <= -offset.
    rows = np.column_stack([planes[:, :3], np.ones(len(planes))])
    ball = linprog([0, 0, 0, -1], A_ub=rows, b_ub=-planes[:, 3], bounds=[(None, None)] * 3 + [(0, None)])
    if ball.status != 0 or ball.x[3] < _THINNEST_M:
        return 0.0
    return float(ConvexHull(HalfspaceIntersection(planes, ball.x[:3]).intersections).volume)


def _half_spaces(thing: ObjectRecord) -> np.ndarray:
    """(6, 4) rows n, offset with n @ x + offset <= 0 inside the box, world frame."""
    normals = np.vstack([thing.world_from_object.rotation.T, -thing.world_from_object.rotation.T])
    half = np.concatenate([thing.dimensions_m, thing.dimensions_m]) / 2
    return np.column_stack([normals, -(normals @ thing.world_from_object.translation) - half])
