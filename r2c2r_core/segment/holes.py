"""Holes in a depth image, where no light returned, and the measured rim around them."""

from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np

from r2c2r_core.arrays import DepthMetres, Mask, Points
from r2c2r_core.geometry.camera import unproject
from r2c2r_core.model.capture import Frame
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of holes and rims."""

    thin_px: int = param(5, "px", "Minimum width of a hole: narrower ones are outlines between two depths", ge=1)
    about_px: int = param(7, "px", "Size of the dilation of a hole whose ring is its rim", ge=3)


class Rim(NamedTuple):
    """Depth measured just outside a hole."""

    at: tuple[int, int]  # (column, row) in the depth image of the queried pixel
    pixels: np.ndarray  # (n, 2) columns and rows of the depth image
    points: Points  # (n, 3) world

    def encloses(self, chosen: Mask) -> bool:
        """Whether the queried pixel is in the convex hull of a part of the rim (n,).

        A hole at the image border continues out of view, and is not enclosed there.
        """
        hull = self.pixels[chosen].astype(np.int32)
        return len(hull) > 0 and cv2.pointPolygonTest(cv2.convexHull(hull), self.at, measureDist=False) >= 0


def find_hole(frame: Frame, depth_m: DepthMetres, x_px: float, y_px: float) -> Mask | None:
    """Hole in a depth image at a pixel of its colour image; None where depth was measured, or only an outline lacks it."""
    params, (column, row) = tuned(Params), _depth_pixel(frame, depth_m, x_px, y_px)
    height, width = depth_m.shape
    if not (0 <= column < width and 0 <= row < height) or depth_m[row, column] > 0:
        return None
    unknown = cv2.morphologyEx(
        (depth_m == 0).astype(np.uint8), cv2.MORPH_OPEN, np.ones((params.thin_px, params.thin_px), np.uint8)
    )
    if not unknown[row, column]:
        return None
    _, labels = cv2.connectedComponents(unknown)
    return np.asarray(labels == labels[row, column])


def find_rim(frame: Frame, depth_m: DepthMetres, x_px: float, y_px: float) -> Rim | None:
    """Rim of the hole at a pixel of a frame's colour image; None where there is no hole."""
    hole, about_px = find_hole(frame, depth_m, x_px, y_px), tuned(Params).about_px
    if hole is None:
        return None
    wide = cv2.dilate(hole.astype(np.uint8), np.ones((about_px, about_px), np.uint8)) > 0
    return measured(frame, depth_m, wide & ~hole, _depth_pixel(frame, depth_m, x_px, y_px))


def measured(frame: Frame, depth_m: DepthMetres, part: Mask, at: tuple[int, int]) -> Rim:
    """Depth in a part of a frame's depth image, as around a pixel of it."""
    rows, columns = np.nonzero(part & (depth_m > 0))
    pixels = np.stack([columns, rows], axis=1)
    seen = unproject(pixels + 0.5, depth_m[rows, columns].astype(np.float64), frame.depth_camera)
    return Rim(at, pixels, frame.world_from_camera.apply(seen))


def _depth_pixel(frame: Frame, depth_m: DepthMetres, x_px: float, y_px: float) -> tuple[int, int]:
    """Column and row in the depth image of a pixel of the colour image."""
    height, width = depth_m.shape
    return int(x_px * width / frame.rgb_camera.width), int(y_px * height / frame.rgb_camera.height)
