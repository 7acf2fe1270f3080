"""Pinhole cameras. Pixel centres lie at i + 0.5, so scaling an image scales (fx, fy, cx, cy) by the same factor."""

from dataclasses import dataclass

import numpy as np

from r2c2r_core.arrays import DepthMetres, Matrix3, Pixels, Points


@dataclass(frozen=True, slots=True, kw_only=True)
class Intrinsics:
    """A pinhole camera without distortion; lengths in pixels, continuous image coordinates (0,0) = top-left corner."""

    fx: float
    fy: float
    cx: float
    cy: float
    width: int
    height: int

    @property
    def matrix(self) -> Matrix3:
        """The 3x3 calibration matrix."""
        return np.array([[self.fx, 0.0, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])

    def resized(self, width: int, height: int) -> "Intrinsics":
        """The same camera for an image resized to width x height."""
        sx, sy = width / self.width, height / self.height
        return Intrinsics(fx=self.fx * sx, fy=self.fy * sy, cx=self.cx * sx, cy=self.cy * sy, width=width, height=height)


def project(points_camera: Points, camera: Intrinsics) -> Pixels:
    """Pixel positions (n, 2) of camera-frame points; inf or nonsense where z <= 0: check z yourself."""
    z = points_camera[:, 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.stack(
            [camera.fx * points_camera[:, 0] / z + camera.cx, camera.fy * points_camera[:, 1] / z + camera.cy], axis=1
        )


def unproject(uv_px: Pixels, depth_m: np.ndarray, camera: Intrinsics) -> Points:
    """Camera-frame points (n, 3) of pixels with z-depth (n,) (paper eq. 1, with fx != fy allowed)."""
    x = (uv_px[:, 0] - camera.cx) / camera.fx * depth_m
    y = (uv_px[:, 1] - camera.cy) / camera.fy * depth_m
    return np.stack([x, y, depth_m], axis=1)


def pixel_centres(camera: Intrinsics) -> np.ndarray:
    """Continuous coordinates (h, w, 2) of all pixel centres."""
    u, v = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    return np.stack([u, v], axis=-1)


def depth_points(depth_m: DepthMetres, camera: Intrinsics) -> np.ndarray:
    """Camera-frame points (h, w, 3) of a z-depth image."""
    uv = pixel_centres(camera)
    x = (uv[..., 0] - camera.cx) / camera.fx * depth_m
    y = (uv[..., 1] - camera.cy) / camera.fy * depth_m
    return np.stack([x, y, depth_m], axis=-1)


def sample_nearest(image: np.ndarray, uv_px: Pixels) -> tuple[np.ndarray, np.ndarray]:
    """Values of `image` at the pixels that contain uv (n, 2), and whether each lies inside; outside gives pixel (0, 0)."""
    height, width = image.shape[:2]
    with np.errstate(invalid="ignore"):
        inside = (uv_px[:, 0] >= 0) & (uv_px[:, 1] >= 0) & (uv_px[:, 0] < width) & (uv_px[:, 1] < height)
        column = np.where(inside, uv_px[:, 0], 0).astype(np.int64)
        row = np.where(inside, uv_px[:, 1], 0).astype(np.int64)
    return image[row, column], inside


def sample_through(image: np.ndarray, camera: Intrinsics, other: Intrinsics) -> tuple[np.ndarray, np.ndarray]:
    """What each pixel of `other`, a camera at the same place, sees in `camera`'s image: (h, w), and whether it lies inside."""
    centres = pixel_centres(other).reshape(-1, 2)
    scale = np.array([camera.fx / other.fx, camera.fy / other.fy])
    uv = (centres - [other.cx, other.cy]) * scale + [camera.cx, camera.cy]
    values, inside = sample_nearest(image, uv)
    return values.reshape(other.height, other.width), inside.reshape(other.height, other.width)
