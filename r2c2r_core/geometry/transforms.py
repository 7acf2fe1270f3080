"""Coordinate frames of r2c2r, and the transforms between them.

| frame   | definition |
|---------|------------|
| world   | metres, right-handed, +Z up, floor at z = 0 where a floor was found (levelled at ingest) |
| capture | the recording's own world, untouched; `world_from_capture` is stored and exported |
| camera  | metres, OpenCV: +X right, +Y down, +Z forward; pixel centres at i + 0.5, so a resize is a product |
| mesh    | what a generator returns: arbitrary pose and scale; never outlives its `Placement` |
| object  | metres, origin at the box centre, front face at -Y, +Z up |
| front   | metres, origin at the centre of a front panel's outer face, +X right for a person facing it, +Y into it, +Z up |
| link    | a URDF link; joint axes are expressed here |

Transforms are named destination first, so that inner names cancel: `world_from_mesh = world_from_camera @ camera_from_mesh`.
"""

from dataclasses import dataclass, field
from typing import overload

import numpy as np

from r2c2r_core.arrays import Matrix3, Matrix4, PointField, Vector3

CAMERA_CV_FROM_GL = np.diag([1.0, -1.0, -1.0])
"""OpenCV camera axes from OpenGL / ARKit camera axes (x right, y up, z back)."""
_PARALLEL = 1e-12  # sine below which a cross product of unit vectors is mostly rounding


@dataclass(frozen=True, slots=True, eq=False)
class Rigid3:
    """A rotation followed by a translation in metres."""

    rotation: Matrix3 = field(default_factory=lambda: np.eye(3))
    translation: Vector3 = field(default_factory=lambda: np.zeros(3))

    @property
    def matrix(self) -> Matrix4:
        """The 4x4 homogeneous matrix."""
        result = np.eye(4)
        result[:3, :3] = self.rotation
        result[:3, 3] = self.translation
        return result

    @property
    def inverse(self) -> "Rigid3":
        """Inverse transform."""
        return Rigid3(self.rotation.T, -self.rotation.T @ self.translation)

    @overload
    def __matmul__(self, other: "Rigid3") -> "Rigid3": ...
    @overload
    def __matmul__(self, other: "Similarity3") -> "Similarity3": ...
    def __matmul__(self, other: "Rigid3 | Similarity3") -> "Rigid3 | Similarity3":
        rotation, translation = self.rotation @ other.rotation, self.rotation @ other.translation + self.translation
        if isinstance(other, Similarity3):
            return Similarity3(other.scale, rotation, translation)
        return Rigid3(rotation, translation)

    def apply(self, points: PointField) -> PointField:
        """Points (..., 3) of the source frame, in the destination frame."""
        return points @ self.rotation.T + self.translation

    def turn(self, directions: PointField) -> PointField:
        """Directions (..., 3) of the source frame, in the destination frame."""
        return directions @ self.rotation.T

    @staticmethod
    def from_matrix(matrix: Matrix4) -> "Rigid3":
        """From a 4x4; the rotation is re-orthonormalised (recordings are off by up to 4e-4)."""
        return Rigid3(nearest_rotation(np.asarray(matrix, dtype=np.float64)[:3, :3]), np.array(matrix, dtype=np.float64)[:3, 3])


@dataclass(frozen=True, slots=True, eq=False)
class Similarity3:
    """A uniform scale, a rotation and a translation in metres: x -> scale * rotation @ x + translation."""

    scale: float
    rotation: Matrix3
    translation: Vector3

    @property
    def matrix(self) -> Matrix4:
        """The 4x4 homogeneous matrix."""
        result = np.eye(4)
        result[:3, :3] = self.scale * self.rotation
        result[:3, 3] = self.translation
        return result

    @property
    def inverse(self) -> "Similarity3":
        """Inverse transform."""
        rotation = self.rotation.T
        return Similarity3(1.0 / self.scale, rotation, -(rotation @ self.translation) / self.scale)

    @overload
    def __matmul__(self, other: "Similarity3") -> "Similarity3": ...
    @overload
    def __matmul__(self, other: Rigid3) -> "Similarity3": ...
    def __matmul__(self, other: "Similarity3 | Rigid3") -> "Similarity3":
        scale = other.scale if isinstance(other, Similarity3) else 1.0
        moved = self.scale * self.rotation @ other.translation + self.translation
        return Similarity3(self.scale * scale, self.rotation @ other.rotation, moved)

    def apply(self, points: PointField) -> PointField:
        """Points (..., 3) of the source frame, in the destination frame."""
        return self.scale * points @ self.rotation.T + self.translation


def nearest_rotation(matrix: Matrix3) -> Matrix3:
    """The proper rotation nearest to `matrix` in the Frobenius norm (det = +1 always)."""
    u, _, vt = np.linalg.svd(matrix)
    return np.asarray(u @ np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))]) @ vt)


def rotation_about_z(angle_rad: float) -> Matrix3:
    """Rotation about +Z by the right-hand rule."""
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def rotation_about(axis: Vector3, angle_rad: float) -> Matrix3:
    """Rotation about a unit axis by the right-hand rule (Rodrigues)."""
    cross = _cross(axis)
    return np.asarray(np.eye(3) + np.sin(angle_rad) * cross + (1.0 - np.cos(angle_rad)) * cross @ cross)


def rotation_of(quat_wxyz: np.ndarray) -> Matrix3:
    """Rotation of a unit quaternion."""
    cross = _cross(quat_wxyz[1:])
    return np.asarray(np.eye(3) + 2.0 * quat_wxyz[0] * cross + 2.0 * cross @ cross)


def _cross(vector: Vector3) -> Matrix3:
    """The matrix that takes a point to its cross product with the vector, vector first."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def rotation_between(source: Vector3, target: Vector3) -> Matrix3:
    """The smallest rotation from direction `source` to direction `target`; for opposite ones, one of the half turns."""
    a, b = source / np.linalg.norm(source), target / np.linalg.norm(target)
    axis, cosine = np.cross(a, b), float(a @ b)
    sine = float(np.linalg.norm(axis))
    if sine < _PARALLEL:  # equal or opposite: any perpendicular axis serves
        axis = np.cross(a, np.eye(3)[np.argmin(np.abs(a))])
    if cosine < 0:  # near opposites the cross product is ill-conditioned: half a turn first, then the small remainder
        axis = axis - float(axis @ a) * a
        half_turn = 2.0 * np.outer(axis, axis) / float(axis @ axis) - np.eye(3)
        return np.asarray(rotation_between(-a, b) @ half_turn)
    cross = _cross(axis / np.linalg.norm(axis))
    return np.eye(3) + sine * cross + (1.0 - cosine) * cross @ cross  # Rodrigues


def joint_transform(axis: Vector3, pivot: Vector3, state: float, *, turns: bool) -> Rigid3:
    """Motion of a body from its joint's zero to a state: about the line through `pivot` along unit `axis`, or along it."""
    if not turns:
        return Rigid3(np.eye(3), axis * state)
    rotation = rotation_about(axis, state)
    return Rigid3(rotation, pivot - rotation @ pivot)


def front_rotation(outward: Vector3) -> Matrix3:
    """Rotation world_from_front (or world_from_object) of a vertical front that faces `outward`.

    Columns: +X right as seen by a person facing the front, +Y into the furniture, +Z up.
    """
    into = -np.array([outward[0], outward[1], 0.0])
    into /= np.linalg.norm(into)
    up = np.array([0.0, 0.0, 1.0])
    return np.column_stack([np.cross(into, up), into, up])
