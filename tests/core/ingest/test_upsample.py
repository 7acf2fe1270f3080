"""Depth upsampling to colour size: sharper than the sensor, no points in the air, and none without a measurement."""

import cv2
import numpy as np
import pytest

from r2c2r_core.ingest.upsample import upsample_depth

FINE = (480, 640)


def view(near: float, far: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Depth and picture of a slanted board before a slanted wall at colour size, and the sensor's depth: every fifth pixel."""
    y, x = np.mgrid[: FINE[0], : FINE[1]] + 0.5
    board = x + 0.4 * y < 420
    inverse = np.where(board, 1 / near + 0.0002 * (x - 320), 1 / far + 0.0001 * (y - 240))
    truth = (1 / inverse).astype(np.float32)
    noise = np.random.default_rng(0).normal(0, 4, (*FINE, 3))
    picture = (np.where(board[..., None], (170, 120, 80), (90, 110, 150)) + noise).clip(0, 255).astype(np.uint8)
    sensor = truth[2::5, 2::5].copy()
    return truth, picture, sensor


@pytest.mark.parametrize(("near", "far"), [(1.0, 1.5), (1.5, 3.0), (2.0, 2.3)])
def test_upsampled_edges_follow_the_image_without_flying_pixels(near, far):
    truth, picture, sensor = view(near, far)
    fine = upsample_depth(sensor, picture)
    wrong = np.abs(fine - truth) > 0.05
    nearest = cv2.resize(sensor, FINE[::-1], interpolation=cv2.INTER_NEAREST_EXACT)
    assert wrong.mean() < 0.4 * (np.abs(nearest - truth) > 0.05).mean()
    low, high = (operation(truth, np.ones((15, 15))) for operation in (cv2.erode, cv2.dilate))
    hanging = (fine > low + 0.05) & (fine < high - 0.05) & wrong
    assert hanging.sum() == 0
    cubic = cv2.resize(sensor, FINE[::-1], interpolation=cv2.INTER_CUBIC)
    assert ((cubic > low + 0.05) & (cubic < high - 0.05) & (np.abs(cubic - truth) > 0.05)).sum() > 1000


def test_upsampling_keeps_planar_surfaces_planar():
    truth, picture, sensor = view(1.0, 1.5)
    fine = upsample_depth(sensor, picture)
    inside = np.zeros(FINE, bool)
    inside[10:-10, 10:200] = True
    assert np.abs(fine - truth)[inside].max() < 1e-3


def test_unmeasured_depth_stays_unknown():
    _, picture, sensor = view(1.0, 1.5)
    sensor[20:30, 40:60] = 0
    fine = upsample_depth(sensor, picture)
    assert not fine[100:150, 200:300].any()
    fine[100:150, 200:300] = 1
    assert (fine > 0).all()
    assert not upsample_depth(np.zeros_like(sensor), picture).any()


def test_an_image_of_sensor_size_leaves_depth_nearly_unchanged():
    _, picture, sensor = view(1.0, 1.5)
    small = cv2.resize(picture, sensor.shape[::-1], interpolation=cv2.INTER_AREA)
    assert np.abs(upsample_depth(sensor, small) - sensor).max() < 0.02
