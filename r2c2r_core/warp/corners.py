"""The four corners of a mesh's front face (paper section 4.8, mended).

The paper scores vertices by radius and depth, which picks handle tips, needs a centred front, and gives four points that
are not coplanar. Here: the direction most of the forward surface looks in, the foremost flat layer across it that spans the
whole front (a handle spans little, a shaker door's sunk panel lies behind its frame), then the smallest rectangle around
that plane's inliers (method.md row 22, whose RANSAC settles between frame and panel when they are millimetres apart).
"""

from dataclasses import dataclass

import numpy as np

from r2c2r_core.arrays import Faces, Points, Vector3
from r2c2r_core.geometry.boxes import smallest_rectangle
from r2c2r_core.geometry.meshes import face_normals, sample_surface
from r2c2r_core.geometry.transforms import rotation_between

_INLIER_M = 0.003
_SAMPLES = 12000
_LAYER_M = 0.002  # offsets are searched in steps of this
_SPANS = 0.8  # of the forward surface's width and of its height: what a front face reaches over
_LEAST_SHARE = 0.03  # of the forward surface: fewer points are specks
_EDGE_SHARE = 0.0005  # of the inliers left outside each side: specks of other faces
_RIM_M = 0.006
_FORWARD = np.array([0.0, -1.0, 0.0])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FrontFace:
    """The front's plane and rectangle in the mesh's canonical axes."""

    corners: Points  # (4, 3): top right, top left, bottom left, bottom right, as seen by a person facing it
    outward: Vector3
    inliers: int

    @property
    def centre(self) -> Vector3:
        """The middle of the rectangle."""
        return self.corners.mean(axis=0)

    @property
    def upright_from_mesh(self) -> np.ndarray:
        """The small rotation that makes the face vertical, facing -Y, with level edges."""
        level = rotation_between(self.outward, _FORWARD)
        right = level @ (self.corners[0] - self.corners[1])
        roll = np.arctan2(right[2], right[0])
        c, s = np.cos(roll), np.sin(roll)
        return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]]) @ level


def find_front(vertices: Points, faces: Faces, *, seed: int = 0) -> FrontFace | None:
    """The foremost large flat of the faces that look towards -Y; None when there is none."""
    rng = np.random.default_rng(seed)
    points, chosen = sample_surface(vertices, faces, _SAMPLES, rng)
    normals = face_normals(vertices, faces)[chosen]
    looking = points[normals[:, 1] < -0.7]
    if len(looking) < 60:
        return None
    normal, offset = _foremost_plane(looking, normals[normals[:, 1] < -0.7])
    inliers = looking[np.abs(looking @ normal - offset) < _INLIER_M]
    forward = faces[face_normals(vertices, faces)[:, 1] < -0.7]
    flat = forward[(np.abs(vertices[forward] @ normal - offset) < _INLIER_M).all(axis=1)]
    if len(flat):  # sampled anew, alone: among all faces a sliver along an edge may get no sample
        inliers, _ = sample_surface(vertices, flat, _SAMPLES, rng)
    rim = vertices[np.unique(forward)]
    rim = rim[np.abs(rim @ normal - offset) < _INLIER_M]
    return FrontFace(corners=_rectangle_corners(inliers, rim, normal, offset), outward=normal, inliers=len(inliers))


def _foremost_plane(points: Points, normals: Points) -> tuple[Vector3, float]:
    """Plane (outward normal, offset) of the foremost flat layer that spans the front; of the fullest where none does."""
    normal = _common_direction(normals)
    offsets = points @ normal
    across = np.stack([np.cross(normal, [0.0, 0.0, 1.0]), [0.0, 0.0, 1.0]], axis=1)
    flat = points @ across
    whole = np.ptp(np.quantile(flat, [0.005, 0.995], axis=0), axis=0)
    fullest, most = float(np.median(offsets)), 0
    for offset in np.arange(offsets.max(), offsets.min() - _LAYER_M, -_LAYER_M):
        layer = np.abs(offsets - offset) < _INLIER_M
        count = int(layer.sum())
        if count < _LEAST_SHARE * len(points):
            continue
        if (np.ptp(np.quantile(flat[layer], [0.005, 0.995], axis=0), axis=0) >= _SPANS * whole).all():
            return _refined(points, normal, _densest(offsets, offset))
        if count > most:
            fullest, most = float(offset), count
    return _refined(points, normal, fullest)


def _common_direction(normals: Points) -> Vector3:
    """The direction most normals agree on: their mean, thrice without those further off."""
    kept = normals
    for cosine in (np.cos(np.deg2rad(20.0)), np.cos(np.deg2rad(8.0)), np.cos(np.deg2rad(3.0))):
        mean = np.median(kept, axis=0)
        mean = mean / np.linalg.norm(mean)
        near = kept[kept @ mean > cosine]
        kept = near if len(near) >= 60 else kept
    mean = kept.mean(axis=0)
    return np.asarray(mean / np.linalg.norm(mean))


def _densest(offsets: np.ndarray, offset: float) -> float:
    """Where, within a layer's thickness behind its first sight, most of the points lie."""
    near = offsets[(offsets <= offset + _INLIER_M) & (offsets > offset - 2 * _INLIER_M)]
    candidates = np.arange(offset + _INLIER_M, offset - 2 * _INLIER_M, -_LAYER_M / 2)
    return float(max(candidates, key=lambda c: int((np.abs(near - c) < _INLIER_M).sum())))


def _refined(points: Points, normal: Vector3, offset: float) -> tuple[Vector3, float]:
    """Least squares on the inliers, three times."""
    for _ in range(3):
        inliers = points[np.abs(points @ normal - offset) < _INLIER_M]
        centre = inliers.mean(axis=0)
        _, _, axes = np.linalg.svd(inliers - centre, full_matrices=False)
        normal = axes[2] if axes[2][1] < 0 else -axes[2]
        offset = float(normal @ centre)
    return normal, offset


def _rectangle_corners(inliers: Points, rim: Points, normal: Vector3, offset: float) -> Points:
    """Corners, on the plane, of the smallest rectangle around the inliers.

    Specks are trimmed first; the sides then go out to the plane's own vertices, which samples fall short of.
    """
    level = rotation_between(normal, _FORWARD)
    flat, rim_flat = (inliers @ level.T)[:, [0, 2]], (rim @ level.T)[:, [0, 2]]
    beside = ((rim_flat > flat.min(axis=0) - _RIM_M) & (rim_flat < flat.max(axis=0) + _RIM_M)).all(axis=1)
    axes = smallest_rectangle(np.concatenate([flat, rim_flat[beside]])).axes
    if abs(axes[0, 0]) < np.cos(np.pi / 4):
        axes = axes[:, ::-1] * [1, -1]
    axes = axes * np.sign(axes[0, 0])
    low, high = np.quantile(flat @ axes, [_EDGE_SHARE, 1 - _EDGE_SHARE], axis=0)
    vertices = rim_flat @ axes
    near = vertices[((vertices > low - _RIM_M) & (vertices < high + _RIM_M)).all(axis=1)]
    if len(near):
        low, high = np.minimum(low, near.min(axis=0)), np.maximum(high, near.max(axis=0))
    signs = np.array([[1, 1], [0, 1], [0, 0], [1, 0]])
    corners2 = (low + signs * (high - low)) @ axes.T
    corners = np.column_stack([corners2[:, 0], np.full(4, -offset), corners2[:, 1]])
    return corners @ level
