"""Depth cleaning on exact scenes with a mixed edge: kept and dropped pixels."""

import cv2
import numpy as np
import pytest

from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.ingest.depth import decode_depth, encode_depth, fill_for_display, flying_pixels, ridges, usable_depth

CAMERA = Intrinsics(fx=193.0, fy=193.0, cx=96.0, cy=128.0, width=192, height=256)  # a phone's LiDAR


def mixed(fine: np.ndarray, noise: float = 0.004) -> np.ndarray:
    """The sensor's view of a scene drawn at four times its resolution: edge pixels are means of both sides."""
    coarse = cv2.resize(fine, (192, 256), interpolation=cv2.INTER_AREA)
    rng = np.random.default_rng(0)
    return (coarse * (1 + noise * rng.standard_normal(coarse.shape))).astype(np.float32)


def scene(background: float, near: float, inside: np.ndarray) -> np.ndarray:
    return np.where(inside, near, background).astype(np.float32)


def grid():
    return np.mgrid[:1024, :768].astype(np.float32)


@pytest.mark.parametrize(("near", "far"), [(1.0, 1.6), (1.5, 2.1), (2.5, 3.3)])
def test_flying_pixels_between_surfaces_are_removed_and_surfaces_are_kept(near, far):
    y, x = grid()
    depth = mixed(scene(far, near, x + 0.35 * y < 560))
    between = (depth > near + 0.05) & (depth < far - 0.08)
    flying = flying_pixels(depth, CAMERA)
    assert between.sum() > 150
    assert (flying & between).sum() > 0.9 * between.sum()
    assert (flying & ~between).mean() < 0.002


@pytest.mark.parametrize("distance", [0.8, 1.2, 1.8])
def test_a_12_mm_bar_handle_is_not_removed_as_flying_pixels(distance):
    _, x = grid()
    bar = np.abs(x - 380) < 0.006 / distance * 193 * 4
    depth = mixed(scene(distance, distance - 0.04, bar))
    on_bar = depth < distance - 0.02
    assert on_bar.sum() > 200
    assert (flying_pixels(depth, CAMERA) & on_bar).sum() < 0.03 * on_bar.sum()


@pytest.mark.parametrize("width_m", [0.02, 0.028])
def test_a_thin_bottle_neck_keeps_its_medium_confidence_depth(width_m):
    """A phone's LiDAR reports medium confidence near depth edges: on a neck 28 mm wide, for every pixel."""
    _, x = grid()
    neck = np.abs(x - 380) < width_m / 2 / 1.4 * 193 * 4
    depth = mixed(scene(1.7, 1.4, neck), noise=0.002)
    unsure = cv2.dilate((np.abs(np.gradient(depth, axis=1)) > 0.02).astype(np.uint8), np.ones((3, 3))) > 0
    confidence = np.where(unsure, 1, 2).astype(np.uint8)
    usable = usable_depth(depth, confidence, CAMERA, least_confidence=2, near_m=0.1, far_m=8.0)
    assert ((usable > 0) & (usable < 1.6)).any(axis=1).mean() > 0.95


def test_the_edge_of_a_wide_object_is_not_a_ridge():
    """Low confidence there concerns only the edge position; a confident pixel beside it measures the surface."""
    _, x = grid()
    depth = mixed(scene(2.0, 1.4, x < 380))
    assert ridges(depth).mean() < 1e-3


def test_a_chair_leg_in_front_of_a_far_wall_is_kept():
    _, x = grid()
    leg = np.abs(x - 381) < 0.02 / 1.4 * 193 * 4
    depth = mixed(scene(2.6, 1.4, leg))
    core = depth < 1.45
    assert core.sum() > 500
    assert (flying_pixels(depth, CAMERA) & core).sum() < 0.02 * core.sum()


def test_a_worktop_at_grazing_angles_of_15_degrees_or_more_is_kept():
    y, _ = grid()
    slope = (y / 4 - 128) / 193  # a level plane 0.6 m below the camera
    fine = np.where(slope > 0.1, 0.6 / np.maximum(slope, 0.1), 0).astype(np.float32)
    depth = np.where(cv2.resize((fine > 0).astype(np.float32), (192, 256)) == 1, mixed(fine, 0.0), 0)
    rejected = flying_pixels(depth, CAMERA)
    seen_at_15_deg_or_steeper = (depth > 0) & (depth < 0.6 / np.tan(np.radians(15)))
    assert rejected[seen_at_15_deg_or_steeper].mean() < 0.01


def test_invalid_low_confidence_and_out_of_range_pixels_become_zero():
    metres = np.full((256, 192), 1.5, np.float32)
    metres[0, :5] = (np.nan, np.inf, -np.inf, 0.01, 20.0)
    confidence = np.full(metres.shape, 2, np.uint8)
    confidence[1, :2] = (0, 1)
    depth = usable_depth(metres, confidence, CAMERA, least_confidence=2, near_m=0.1, far_m=8.0)
    assert not depth[0, :5].any()
    assert not depth[1, :2].any()
    assert (depth > 0).sum() == metres.size - 7


def test_stored_depth_is_exact_to_an_eighth_of_a_millimetre():
    depth = np.linspace(0.1, 16.0, 192 * 256, dtype=np.float32).reshape(256, 192)
    depth[0, 0] = 0
    back = decode_depth(encode_depth(depth))
    assert back[0, 0] == 0
    assert np.abs(back - depth).max() < 0.000126


def test_hole_filling_uses_the_nearest_known_depth_and_keeps_known_values():
    depth = np.zeros((9, 9), np.float32)
    depth[:, 0], depth[:, 8] = 1.0, 2.0
    filled = fill_for_display(depth)
    assert (filled[:, :4] == 1.0).all()
    assert (filled[:, 5:] == 2.0).all()
