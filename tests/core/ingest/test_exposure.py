"""Exposure compensation: pictures of one surface are brought to a common exposure; constant exposure is unchanged."""

from dataclasses import replace

import numpy as np
import pytest

from r2c2r_core.geometry.light import NO_GAIN, balanced
from r2c2r_core.ingest.exposure import Looks, balance_exposure, see, solve_gains, spread
from r2c2r_core.ingest.stage import IngestConfig, read_capture
from r2c2r_core.model.capture import Capture, Depth

from .tiny import TinyRoom, write_r3d

ROOM = TinyRoom(count=16, rgb_size=(240, 320), depth_size=(120, 160), focal=230.0)


class Exposed:
    """Images of a capture, each with its own gain."""

    def __init__(self, capture: Capture, gains: np.ndarray) -> None:
        self._images = capture.images
        self._gains = {f.index: g for f, g in zip(capture.frames, gains, strict=True)}

    def rgb(self, index: int) -> np.ndarray:
        return np.clip(self._images.rgb(index) * self._gains[index], 0, 255).astype(np.uint8)

    def depth(self, index: int) -> Depth:
        return self._images.depth(index)


@pytest.fixture(scope="module")
def capture(tmp_path_factory):
    folder = tmp_path_factory.mktemp("exposure")
    return read_capture(write_r3d(folder / "scan.r3d", ROOM), folder / "store", IngestConfig(finest_voxel_m=0.02))


def balance(capture: Capture, images):
    plain = [replace(f, gain=NO_GAIN) for f in capture.frames]
    surface = capture.surface
    rng = np.random.default_rng(0)
    return balance_exposure(plain, images, surface.vertices_world, surface.faces, capture.depth_noise, rng)


def test_constant_exposure_is_left_unchanged(capture):
    assert {f.gain for f in capture.frames} == {NO_GAIN}


def test_changing_exposure_and_white_balance_are_compensated(capture):
    time = np.linspace(0, 3 * np.pi, ROOM.count)
    shone = np.stack([0.85 + 0.2 * np.sin(time), 0.9 + 0.1 * np.cos(time), 0.8 + 0.25 * np.sin(time + 1)], axis=1)
    images = Exposed(capture, shone)
    found = balance(capture, images)
    gains = np.array([f.gain for f in found])
    left = np.log(gains * shone)
    assert np.abs(left - np.median(left, axis=0)).max() < 0.06  # of exposures that differ by a factor of 1.9
    points = capture.surface.vertices_world[
        :: max(1, len(capture.surface.vertices_world) // 500)
    ]  # not those it was estimated on
    looks = see(found, images, points, capture.depth_noise)
    assert spread(looks, np.log(gains)) < 0.5 * spread(looks, np.zeros_like(gains))


def test_outlier_points_do_not_bias_the_frame_gains():
    rng = np.random.default_rng(0)
    true = rng.normal(0, 0.2, (12, 3))
    colour = rng.uniform(3.5, 5.0, (300, 3))
    point, frame = (part.ravel() for part in np.meshgrid(np.arange(300), np.arange(12)))
    log_rgb = colour[point] - true[frame] + rng.normal(0, 0.02, (len(point), 3))
    odd = rng.random(len(point)) < 0.25 * (frame < 4)  # a quarter of the points in a third of the frames
    log_rgb[odd] += 0.5
    found = solve_gains(Looks(point, frame, log_rgb), 12)
    error = found - true
    assert np.abs(error - np.median(error, axis=0)).max() < 0.03


def test_a_frame_with_too_few_points_keeps_its_exposure():
    point, frame = (part.ravel() for part in np.meshgrid(np.arange(300), np.arange(3)))
    keep = (frame < 2) | (point < 20)
    log_rgb = np.full((len(point), 3), 4.0) + 0.3 * (frame == 2)[:, None]
    looks = Looks(point[keep], frame[keep], log_rgb[keep])
    assert np.allclose(solve_gains(looks, 3)[2], 0.0)


def test_gain_keeps_white_at_255_and_is_monotonic():
    ramp = np.repeat(np.arange(256, dtype=np.uint8), 3).reshape(1, 256, 3)
    for gain in ((0.5, 0.6, 0.7), (1.5, 1.2, 1.8)):
        out = balanced(ramp, gain)[0].astype(int)
        assert (out[255] == 255).all()
        assert np.allclose(out[:140], np.minimum(np.arange(140)[:, None] * gain, 255), atol=1)
        assert (np.diff(out, axis=0) >= -1).all()
    assert balanced(ramp, NO_GAIN) is ramp


def test_a_pixel_with_one_clipped_channel_takes_the_gain_of_all() -> None:
    lavender = np.full((1, 1, 3), (190, 195, 250), np.uint8)
    assert balanced(lavender, (0.8, 0.8, 0.65)).ravel().tolist() == [152, 156, 162]
