"""An oven's top and back by colour, in drawn photographs of a box before a tiled wall."""

import cv2
import numpy as np
import pytest

from r2c2r_core.geometry.camera import Intrinsics, project
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.geometry.visibility import DepthNoise
from r2c2r_core.segment.appliances.outline import Body, Photo, best_depth, best_top, outlined_body

CAMERA = Intrinsics(fx=700.0, fy=700.0, cx=320.0, cy=240.0, width=640, height=480)
TRUE = Body(Rigid3(np.eye(3), np.zeros(3)), 0.25, -0.15, 0.15, 0.36)
WALL_Y = 0.45
GUESSED = TRUE._replace(top_m=0.11, depth_m=0.42)  # its top at a line of its front, its back at the wall's depth
DEPTHS, TOPS = np.arange(0.24, 0.45, 0.004), GUESSED.top_m + np.arange(-0.06, 0.06, 0.003)
EYES = [(-1.2, -1.3, 0.5), (-0.8, -1.4, 0.45), (-0.5, -1.5, 0.5), (0.6, -1.4, 0.4), (0.9, -1.3, 0.5), (1.2, -1.2, 0.45)]


def looking_at_the_box(eye):
    forward = -np.array(eye) / np.linalg.norm(eye)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    return Rigid3(np.column_stack([right, np.cross(forward, right), forward]), np.array(eye))


def photo(eye, body_grey, *, side_grey=50, tiles=True, hidden=False):
    pose = looking_at_the_box(eye)
    rgb = np.full((CAMERA.height, CAMERA.width, 3), 200, np.uint8)

    def fill(corners, grey):
        uv = project(pose.inverse.apply(np.array(corners, float)), CAMERA)
        cv2.fillConvexPoly(rgb, np.round(uv).astype(np.int32), (grey,) * 3, cv2.LINE_AA)

    for k in range(-10, 10) if tiles else ():
        fill([(0.1 * k, WALL_Y, -1), (0.1 * k + 0.004, WALL_Y, -1), (0.1 * k + 0.004, WALL_Y, 1), (0.1 * k, WALL_Y, 1)], 170)
    w, top, low, d = TRUE.half_width_m, TRUE.top_m, TRUE.bottom_m, TRUE.depth_m
    side = w if eye[0] > 0 else -w
    fill([(-w, 0, top), (w, 0, top), (w, d, top), (-w, d, top)], body_grey)
    fill([(side, 0, low), (side, d, low), (side, d, top), (side, 0, top)], side_grey)
    fill([(-w, 0, low), (w, 0, low), (w, 0, top), (-w, 0, top)], body_grey)
    fill([(-w, 0, 0.108), (w, 0, 0.108), (w, 0, 0.112), (-w, 0, 0.112)], body_grey // 2)  # a line on its front
    noise = np.random.default_rng(0).normal(0.0, 3.0, rgb.shape)
    rgb = np.clip(rgb + noise, 0, 255).astype(np.uint8)
    depth = np.full((120, 160), 0.3 if hidden else 0.0, np.float32)
    return Photo(cv2.cvtColor(rgb, cv2.COLOR_RGB2LAB), CAMERA, depth, pose, DepthNoise())


def test_top_and_back_are_found_to_millimetres_from_a_guess_centimetres_off():
    photos = [photo(eye, 60) for eye in EYES]
    body, clear = outlined_body(GUESSED, photos, TOPS, DEPTHS)
    assert clear
    assert body.top_m == pytest.approx(TRUE.top_m, abs=0.003)  # a pixel at 1.5 m is 2 mm
    assert body.depth_m == pytest.approx(TRUE.depth_m, abs=0.006)  # seen at a slant


def test_a_white_oven_before_a_white_wall_has_no_clear_back():
    photos = [photo(eye, 200, side_grey=200, tiles=False) for eye in EYES]
    assert best_depth(TRUE, photos, DEPTHS) is None


def test_edges_behind_something_nearer_say_nothing():
    photos = [photo(eye, 60, hidden=True) for eye in EYES]
    assert best_depth(TRUE, photos, DEPTHS) is None
    assert best_top(TRUE, photos, TOPS) is None


def test_one_direction_is_not_enough():
    photos = [photo(EYES[0], 60)]
    assert best_depth(TRUE, photos, DEPTHS) is None
