"""The four corners of a mesh's front face (paper section 4.8, mended).

The paper scores vertices by radius and depth, which picks handle tips, needs a centred front, and gives four points that
are not coplanar. Here: the front plane by RANSAC over surface points that look forwards, then the smallest rectangle
around its inliers (method.md row 22).
"""

from dataclasses import dataclass

import numpy as np

from r2c2r_core.arrays import Faces, Points, Vector3
from r2c2r_core.geometry.boxes import smallest_rectangle
from r2c2r_core.geometry.meshes import face_normals, sample_surface
from r2c2r_core.geometry.transforms import rotation_between

_INLIER_M = 0.003
_SAMPLES = 12000
_TRIALS = 200
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
    plane = _foremost_plane(looking, rng)
    if plane is None:
        return None
    normal, offset = plane
    inliers = looking[np.abs(looking @ normal - offset) < _INLIER_M]
    forward = np.unique(faces[face_normals(vertices, faces)[:, 1] < -0.7])
    rim = vertices[forward][np.abs(vertices[forward] @ normal - offset) < _INLIER_M]
    return FrontFace(corners=_rectangle_corners(inliers, rim, normal, offset), outward=normal, inliers=len(inliers))


def _foremost_plane(points: Points, rng: np.random.Generator) -> tuple[Vector3, float] | None:
    """Plane (outward normal, offset) holding at least 60 % of the best plane's points and lying furthest forward."""
    found: list[tuple[int, float, Vector3, float]] = []
    for _ in range(_TRIALS):
        a, b, c = points[rng.choice(len(points), 3, replace=False)]
        normal = np.cross(b - a, c - a)
        length = np.linalg.norm(normal)
        if length < 1e-6:
            continue
        normal = normal / length * (-1.0 if normal[1] > 0 else 1.0)
        if normal[1] > -np.cos(np.deg2rad(12.0)):
            continue
        offset = float(normal @ a)
        count = int((np.abs(points @ normal - offset) < _INLIER_M).sum())
        found.append((count, offset, normal, offset))
    if not found:
        return None
    most = max(count for count, *_ in found)
    forward = [f for f in found if f[0] >= 0.6 * most]
    _, _, normal, offset = max(forward, key=lambda f: (round(f[1] / 0.01), f[0]))
    return _refined(points, normal, offset)


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
