"""Rotation of a recording to upright: no point of the world moves, and every frame is upright."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from r2c2r_core.geometry.camera import Intrinsics, depth_points
from r2c2r_core.geometry.transforms import Rigid3, rotation_about_z
from r2c2r_core.ingest.files import FolderFiles
from r2c2r_core.ingest.readers.protocol import RawDepth, RawFrame, Recording
from r2c2r_core.ingest.upright import upright

CAMERA = Intrinsics(fx=50.0, fy=60.0, cx=21.0, cy=13.5, width=40, height=30)
LEVEL = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])  # world (+Z up) from a camera that looks along +Y
UP = np.array([0.0, 0.0, 1.0])


def recording(tmp_path: Path, rolls_deg: list[float], up=UP) -> Recording:
    """Frames whose cameras are rolled about their viewing direction; pixels contain their own index."""
    frames = tuple(
        RawFrame(
            index=3 * k,
            timestamp_s=None,
            rgb_camera=CAMERA,
            depth_camera=CAMERA.resized(20, 15),
            capture_from_camera=Rigid3(LEVEL @ rotation_about_z(np.radians(roll)), np.array([0.1 * k, 0.0, 1.2])),
            rgb_name="rgb",
            depth_name="depth",
        )
        for k, roll in enumerate(rolls_deg)
    )
    colour = np.random.default_rng(1).integers(0, 255, (30, 40, 3)).astype(np.uint8)
    depth = np.random.default_rng(2).uniform(1, 2, (15, 20)).astype(np.float32)
    confidence = np.random.default_rng(3).integers(0, 3, (15, 20)).astype(np.uint8)
    return Recording(
        format="made",
        files=FolderFiles(tmp_path),
        frames=frames,
        colour_of=lambda frame: colour,
        depth_of=lambda frame: RawDepth(depth, confidence),
        up_capture=up,
    )


def world_points(made: Recording, position: int) -> np.ndarray:
    """(n, 4): position of each depth pixel, and its confidence; sorted."""
    frame = made.frames[position]
    metres, confidence, _ = made.depth_of(frame)
    points = frame.capture_from_camera.apply(depth_points(metres, frame.depth_camera).reshape(-1, 3))
    rows = np.column_stack([points, confidence.ravel()])
    return rows[np.lexsort(np.round(rows, 6).T)]


@pytest.mark.parametrize("roll_deg", [0.0, 90.0, 180.0, 270.0, 75.0, 200.0])
def test_rotating_images_upright_keeps_all_world_points(roll_deg, tmp_path):
    made = recording(tmp_path, [roll_deg] * 3)
    turned = upright(made)
    frame = turned.frames[1]
    assert -(frame.capture_from_camera.rotation.T @ UP)[1] > np.cos(np.radians(45.1))
    assert np.allclose(world_points(turned, 1), world_points(made, 1), atol=1e-6)
    assert turned.colour_of(frame).shape == (frame.rgb_camera.height, frame.rgb_camera.width, 3)
    assert (turned is made) == (roll_deg == 0.0)


def test_a_rotated_colour_pixel_keeps_its_world_ray(tmp_path):
    made = recording(tmp_path, [90.0])
    turned = upright(made)
    for one in (made, turned):
        colour, frame = one.colour_of(one.frames[0]), one.frames[0]
        row, column = np.argwhere((colour == made.colour_of(made.frames[0])[4, 31]).all(axis=2))[0]
        camera = frame.rgb_camera
        ray = np.array([(column + 0.5 - camera.cx) / camera.fx, (row + 0.5 - camera.cy) / camera.fy, 1.0])
        seen = frame.capture_from_camera.rotation @ ray
        assert np.allclose(seen, made.frames[0].capture_from_camera.rotation @ np.array([10.5 / 50, -9 / 60, 1.0]))


def test_images_are_rotated_only_by_majority(tmp_path):
    assert upright(recording(tmp_path, [90, 90, 90, 90, 0])).frames[0].rgb_camera.width == 30
    undecided = recording(tmp_path, [90, 90, 0, 0, 180])
    assert upright(undecided) is undecided


def test_without_gravity_or_poses_no_image_is_rotated(tmp_path):
    unknown = recording(tmp_path, [90.0] * 3, up=None)
    assert upright(unknown) is unknown
    lost = recording(tmp_path, [90.0] * 3)
    lost = replace(lost, frames=tuple(replace(f, capture_from_camera=None) for f in lost.frames))
    assert upright(lost) is lost
