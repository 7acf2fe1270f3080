"""Text formatting of numbers, labels and rotations for simulator formats."""

import re

import numpy as np

from r2c2r_core.arrays import Matrix3
from r2c2r_core.export.labels import Labels


def numbers(values: object) -> str:
    """Numbers separated by spaces, nine digits, without negative zeros."""
    flat = np.atleast_1d(np.asarray(values, dtype=np.float64)).ravel()
    return " ".join(f"{0.0 if abs(v) < 1e-12 else v:.9g}" for v in flat)


def words_of(labels: Labels) -> dict[str, str]:
    """Labels as attributes: dispositions separated by commas, the category on one line without `;`."""
    category = re.sub(r"[\s;]+", " ", labels.category).strip()
    return {"category": category, "part": labels.part, "disposition": ",".join(labels.disposition)}


def rpy_of(rotation: Matrix3) -> np.ndarray:
    """Roll, pitch, yaw in radians about the fixed axes x, y, z (URDF: R = Rz Ry Rx)."""
    pitch = -np.arcsin(np.clip(rotation[2, 0], -1.0, 1.0))
    if abs(rotation[2, 0]) > 1.0 - 1e-9:  # gimbal lock: only yaw - roll (or their sum) is defined, so all of it goes into yaw
        return np.array([0.0, pitch, np.arctan2(-rotation[0, 1], rotation[1, 1])])
    return np.array([np.arctan2(rotation[2, 1], rotation[2, 2]), pitch, np.arctan2(rotation[1, 0], rotation[0, 0])])


def rotation_of(rpy: object) -> Matrix3:
    """Rotation of roll, pitch, yaw in radians; the inverse of `rpy_of`."""
    r, p, y = np.asarray(rpy, dtype=np.float64)
    cr, sr, cp, sp, cy, sy = np.cos(r), np.sin(r), np.cos(p), np.sin(p), np.cos(y), np.sin(y)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def quat_wxyz_of(rotation: Matrix3) -> np.ndarray:
    """Unit quaternion, w first and not negative."""
    from scipy.spatial.transform import Rotation

    x, y, z, w = Rotation.from_matrix(rotation).as_quat(canonical=True)
    return np.array([w, x, y, z])
