"""Removal of lens distortion, so that all later stages can assume pinhole cameras."""

from functools import lru_cache

import cv2
import numpy as np

from r2c2r_core.geometry.camera import Intrinsics

Lens = tuple[float, float, float, float, float]
"""k1, k2, p1, p2, k3 of Brown's model, in OpenCV's order."""


def undistorted(image: np.ndarray, camera: Intrinsics, lens: Lens, *, nearest: bool) -> np.ndarray:
    """The undistorted image of the same camera; use `nearest` for depth, to avoid mixing. Unseen pixels become 0."""
    across, down = _maps(camera, lens)
    return np.asarray(cv2.remap(image, across, down, cv2.INTER_NEAREST if nearest else cv2.INTER_LINEAR))


@lru_cache(maxsize=2)
def _maps(camera: Intrinsics, lens: Lens) -> tuple[np.ndarray, np.ndarray]:
    matrix = camera.matrix
    matrix[:2, 2] -= 0.5  # OpenCV puts pixel centres at integers
    size = (camera.width, camera.height)
    across, down = cv2.initUndistortRectifyMap(matrix, np.array(lens), None, matrix, size, cv2.CV_32FC1)
    return across, down
