"""Pinhole cameras. Pixel centres lie at i + 0.5, so scaling an image scales (fx, fy, cx, cy) by the same factor."""

from dataclasses import dataclass

import numpy as np

from r2c2r_core.arrays import DepthMetres, Matrix3, PixelField, Pixels, PointField


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


def project(points_camera: PointField, camera: Intrinsics) -> PixelField:
    """Pixel positions (..., 2) of camera-frame points (..., 3); invalid where z <= 0, which the caller must check."""
    z = points_camera[..., 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.stack(
            [camera.fx * points_camera[..., 0] / z + camera.cx, camera.fy * points_camera[..., 1] / z + camera.cy], axis=-1
        )


def unproject(uv_px: PixelField, depth_m: np.ndarray, camera: Intrinsics) -> PointField:
    """Camera-frame points (..., 3) of pixels (..., 2) with z-depth (...) (paper eq. 1, with fx != fy allowed)."""
    x = (uv_px[..., 0] - camera.cx) / camera.fx * depth_m
    y = (uv_px[..., 1] - camera.cy) / camera.fy * depth_m
    return np.stack([x, y, depth_m], axis=-1)


def pixel_rays(uv_px: PixelField, camera: Intrinsics) -> PointField:
    """Camera-frame points (..., 3) at z = 1 on the rays through pixels (..., 2)."""
    return unproject(uv_px, np.ones(uv_px.shape[:-1]), camera)


def ray_slopes(columns: np.ndarray, rows: np.ndarray, camera: Intrinsics) -> tuple[np.ndarray, np.ndarray]:
    """X / z of the centres of pixel columns (w,), and y / z of those of rows (h,)."""
    return (columns + 0.5 - camera.cx) / camera.fx, (rows + 0.5 - camera.cy) / camera.fy


def pixel_centres(camera: Intrinsics) -> PixelField:
    """Continuous coordinates (h, w, 2) of all pixel centres."""
    u, v = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    return np.stack([u, v], axis=-1)


def depth_points(depth_m: DepthMetres, camera: Intrinsics) -> PointField:
    """Camera-frame points (h, w, 3) of a z-depth image."""
    return unproject(pixel_centres(camera), depth_m, camera)


def reproject_depth(depth_m: DepthMetres, source: Intrinsics, target: Intrinsics, target_at_m: np.ndarray) -> DepthMetres:
    """Reprojection of a depth image into a parallel camera at `target_at_m` (source's frame); 0 where nothing projects.

    Each pixel is splatted over the square it covers, in enough pieces to leave no gaps; the nearest depth is kept.
    """
    pieces = max(1, int(np.ceil(max(target.fx * source.width / (source.fx * target.width), 1.0) + 0.2)))
    offsets = (np.arange(pieces) + 0.5) / pieces
    rows, columns = np.nonzero(depth_m > 0)
    z = depth_m[rows, columns].astype(np.float64) - target_at_m[2]
    least = np.full(target.height * target.width, np.inf)
    for down in offsets:
        for across in offsets:
            x = (columns + across - source.cx) / source.fx * depth_m[rows, columns] - target_at_m[0]
            y = (rows + down - source.cy) / source.fy * depth_m[rows, columns] - target_at_m[1]
            column = np.floor(x / z * target.fx + target.cx).astype(np.int64)
            row = np.floor(y / z * target.fy + target.cy).astype(np.int64)
            inside = (column >= 0) & (column < target.width) & (row >= 0) & (row < target.height)
            np.minimum.at(least, row[inside] * target.width + column[inside], z[inside])
    return np.where(np.isfinite(least), least, 0.0).astype(np.float32).reshape(target.height, target.width)


def sample_nearest(image: np.ndarray, uv_px: Pixels) -> tuple[np.ndarray, np.ndarray]:
    """Values of `image` at the pixels that contain uv (n, 2), and whether each lies inside; outside gives pixel (0, 0)."""
    height, width = image.shape[:2]
    with np.errstate(invalid="ignore"):
        inside = (uv_px[:, 0] >= 0) & (uv_px[:, 1] >= 0) & (uv_px[:, 0] < width) & (uv_px[:, 1] < height)
        pixel = np.where(inside, uv_px[:, 1], 0).astype(np.int32) * width + np.where(inside, uv_px[:, 0], 0).astype(np.int32)
    return image.reshape(height * width, *image.shape[2:]).take(pixel, axis=0), inside


def sample_through(image: np.ndarray, camera: Intrinsics, other: Intrinsics) -> tuple[np.ndarray, np.ndarray]:
    """Image of `camera` sampled at the pixels of `other`, a camera with the same pose: (h, w), and whether inside."""
    uv = project(pixel_rays(pixel_centres(other), other), camera)
    values, inside = sample_nearest(image, uv.reshape(-1, 2))
    return values.reshape(other.height, other.width), inside.reshape(other.height, other.width)
