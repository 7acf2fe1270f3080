"""Synthetic photographs of an upright box before a tiled wall: a line on its front, no depth."""

import cv2
import numpy as np

from r2c2r_core.geometry.camera import Intrinsics, project
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.geometry.visibility import DepthNoise
from r2c2r_core.segment.appliances.edges import Photo

CAMERA = Intrinsics(fx=700.0, fy=700.0, cx=320.0, cy=240.0, width=640, height=480)
LEFT_M, RIGHT_M, BACK_M, BOTTOM_M, TOP_M = -0.25, 0.25, 0.36, -0.15, 0.15
WALL_Y = 0.45
LINE_Z = 0.11  # on its front, with more contrast than its upper edge
TRUE = np.array([0.0, LEFT_M, RIGHT_M, 0.0, BACK_M, BOTTOM_M, TOP_M])
EYES = [
    (-1.2, -1.3, 0.5),
    (-0.8, -1.4, 0.45),
    (-0.5, -1.5, 0.5),
    (-0.1, -1.4, 0.6),
    (0.2, -1.5, 0.55),
    (0.6, -1.4, 0.4),
    (0.9, -1.3, 0.5),
    (1.2, -1.2, 0.45),
]
Corners = list[tuple[float, float, float]]


def photo(
    eye: tuple[float, float, float], body_grey: int = 60, *, side_grey: int = 50, tiles: bool = True, hidden: bool = False
) -> Photo:
    """Photograph of the box from a camera at `eye`; `hidden`: depth shows an occlusion in front."""
    pose = looking_at_the_box(np.array(eye))
    rgb = np.full((CAMERA.height, CAMERA.width, 3), 200, np.uint8)

    def fill(corners: Corners, grey: int) -> None:
        uv = project(pose.inverse.apply(np.array(corners)), CAMERA)
        cv2.fillConvexPoly(rgb, np.round(uv * 16 - 8).astype(np.int32), (grey,) * 3, cv2.LINE_AA, 4)

    for k in range(-10, 10) if tiles else ():
        x = 0.1 * k
        fill([(x, WALL_Y, -1), (x + 0.004, WALL_Y, -1), (x + 0.004, WALL_Y, 1), (x, WALL_Y, 1)], 170)
    left, right, back, low, top = LEFT_M, RIGHT_M, BACK_M, BOTTOM_M, TOP_M
    side = right if eye[0] > 0 else left
    fill([(left, 0, top), (right, 0, top), (right, back, top), (left, back, top)], body_grey)
    fill([(side, 0, low), (side, back, low), (side, back, top), (side, 0, top)], side_grey)
    fill([(left, 0, low), (right, 0, low), (right, 0, top), (left, 0, top)], body_grey)
    fill([(left, 0, LINE_Z - 0.002), (right, 0, LINE_Z - 0.002), (right, 0, LINE_Z), (left, 0, LINE_Z)], body_grey // 2)
    noise = np.random.default_rng(0).normal(0.0, 3.0, rgb.shape)
    rgb = np.clip(rgb + noise, 0, 255).astype(np.uint8)
    depth = np.full((120, 160), 0.3 if hidden else 0.0, np.float32)
    return Photo(cv2.cvtColor(rgb, cv2.COLOR_RGB2LAB), CAMERA, depth, pose, DepthNoise())


def looking_at_the_box(eye: np.ndarray) -> Rigid3:
    """World pose of a camera there, looking at the box."""
    forward = -eye / np.linalg.norm(eye)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    return Rigid3(np.column_stack([right, np.cross(forward, right), forward]), eye)
