"""Registration of depth to colour on request; nothing else changes."""

from dataclasses import replace

import numpy as np
import pytest

from r2c2r_core.geometry.camera import Intrinsics, reproject_depth
from r2c2r_core.ingest.doctor import examine
from r2c2r_core.ingest.stage import IngestConfig, read_capture

from .corruptions import Corruption, corrupt_r3d, shifted_depth
from .tiny import TinyRoom, write_r3d

# Large enough to align edges in depth with edges in colour
ROOM = TinyRoom(count=12, rgb_size=(240, 320), depth_size=(240, 320), focal=230.0)
CONFIG = IngestConfig(finest_voxel_m=0.03, coarsest_voxel_m=0.03)
ASKED = replace(CONFIG, register_depth=True)
BESIDE = Corruption(name="60 mm beside colour", depth=lambda depth, camera: shifted_depth(depth, camera, 0.06))


@pytest.fixture(scope="module")
def scan(tmp_path_factory):
    return write_r3d(tmp_path_factory.mktemp("registering") / "scan.r3d", ROOM)


def errors_m(capture) -> np.ndarray:
    """Stored depth minus what the colour camera would measure, where depth is stored."""
    errors = []
    for frame, pose in zip(capture.frames, ROOM.poses(), strict=True):
        depth = capture.images.depth(frame.index).metres
        exact = ROOM.depth(pose, ROOM.depth_camera)
        errors.append((depth - exact)[depth > 0])
    return np.concatenate(errors)


def test_misaligned_depth_is_registered_to_colour_on_request(scan, tmp_path):
    beside = corrupt_r3d(BESIDE, scan, tmp_path / "beside.r3d")
    before = read_capture(beside, tmp_path / "before", CONFIG)
    after = read_capture(beside, tmp_path / "after", ASKED)
    told = examine(before)
    assert "unregistered" in {r.cause for r in told.remarks}
    assert any("--register-depth" in reason for reason in told.reasons)
    assert not {"unregistered", "colour_focal_length"} & {r.cause for r in examine(after).remarks}
    off = [np.mean(np.abs(errors_m(capture)) > 0.1) for capture in (before, after)]  # fraction of pixels on another surface
    assert off[1] < 0.35 * off[0]
    assert after.notices[0].startswith("depth was registered to the colour images")
    assert not any("registered" in notice for notice in before.notices)
    for frame in after.frames[::4]:
        assert frame.depth_camera == frame.rgb_camera.resized(*ROOM.depth_size)


def test_already_registered_depth_is_unchanged_with_a_notice(scan, tmp_path):
    asked, plain = (read_capture(scan, tmp_path / str(k), config) for k, config in enumerate((ASKED, CONFIG)))
    assert asked.notices[0].startswith("depth was not changed")
    for frame, other in zip(asked.frames, plain.frames, strict=True):
        assert frame.rgb_camera == other.rgb_camera
        assert np.array_equal(asked.images.depth(frame.index).metres, plain.images.depth(frame.index).metres)


def test_reprojected_depth_matches_depth_rendered_in_the_target_camera():
    """A slanted plane and a target camera with 1.15 x the focal length, shifted by 40 mm and not rotated."""
    source = Intrinsics(fx=200.0, fy=200.0, cx=80.0, cy=60.0, width=160, height=120)
    target = Intrinsics(fx=230.0, fy=230.0, cx=83.0, cy=58.0, width=160, height=120)
    at = np.array([0.04, -0.01, 0.02])

    def plane(camera: Intrinsics, eye: np.ndarray) -> np.ndarray:
        columns, rows = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
        x, y = (columns - camera.cx) / camera.fx, (rows - camera.cy) / camera.fy
        normal = np.array([0.3, -0.1, 1.0])  # normal @ point = 1.5 m
        return ((1.5 - normal @ eye) / (normal[0] * x + normal[1] * y + normal[2])).astype(np.float32)

    drawn = reproject_depth(plane(source, np.zeros(3)), source, target, at)
    inner = (slice(12, -12), slice(12, -12))
    assert (drawn[inner] > 0).all()  # no gaps, though each pixel is magnified
    assert np.abs(drawn - plane(target, at))[inner].max() < 0.004  # half a pixel of the slope


def test_the_nearer_surface_occludes_the_farther_one_when_reprojected():
    camera = Intrinsics(fx=100.0, fy=100.0, cx=50.0, cy=20.0, width=100, height=40)
    depth = np.full((40, 100), 2.0, np.float32)
    depth[:, 40:60] = 1.0
    drawn = reproject_depth(depth, camera, camera, np.array([0.1, 0.0, 0.0]))
    assert (drawn[:, 30:50] == 1.0).all()  # shifted by 10 px, the surface behind it by 5
    assert set(np.unique(drawn[:, :30])) == {2.0}
    assert (drawn[:, 50:55] == 0).all()  # the area behind the near surface was not seen
