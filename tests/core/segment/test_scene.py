"""Surface point under a pixel without sensor depth."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from r2c2r_core.geometry.camera import unproject
from r2c2r_core.model.capture import Capture
from r2c2r_core.segment.scene import Scene, prepare_scene
from tests.core.segment.scenes import Pixels, click_on, dining

NEAR_M, FAR_M = 2.5, 2.83
STEP_COLUMN = 120  # of 256: the near side ends there
SCALE = 960 / 256


def at(column: float, *, gap: int, far_m: float = FAR_M) -> float | None:
    """Depth at a column of a depth image in which `gap` pixels are missing after the end of the near side."""
    depth = np.full((192, 256), NEAR_M, np.float32)
    depth[:, STEP_COLUMN:] = far_m
    depth[:, STEP_COLUMN : STEP_COLUMN + gap] = 0
    scene: Any = SimpleNamespace(
        depth=lambda index: depth, frame=lambda index: SimpleNamespace(rgb_camera=SimpleNamespace(width=960, height=720))
    )
    return Scene.depth_at_step(cast(Scene, scene), 0, column * SCALE, 300.0)


def test_a_gap_pixel_takes_the_depth_of_the_surface_it_is_nearer_to() -> None:
    assert at(STEP_COLUMN + 1.5, gap=5) == pytest.approx(NEAR_M)
    assert at(STEP_COLUMN + 4.0, gap=5) == pytest.approx(FAR_M)


def test_a_pixel_with_sensor_depth_is_not_filled_in() -> None:
    assert at(STEP_COLUMN - 0.5, gap=5) is None


def test_a_hole_within_one_surface_is_not_treated_as_a_gap() -> None:
    assert at(STEP_COLUMN + 1.5, gap=5, far_m=NEAR_M + 0.02) is None


def test_a_wide_hole_is_not_treated_as_a_gap() -> None:
    assert at(STEP_COLUMN + 20.0, gap=40) is None


def test_a_hole_at_the_image_corner_gives_no_depth() -> None:
    assert at(255.9, gap=136) is None


HOB_LOW, HOB_HIGH, TABLE_M = np.array([0.2, -0.15]), np.array([0.5, 0.15]), 0.73


def in_hob(points_world: np.ndarray) -> np.ndarray:
    """Mask of the points (..., 3) on a rectangle of the table's top."""
    plan = ((points_world[..., :2] > HOB_LOW) & (points_world[..., :2] < HOB_HIGH)).all(axis=-1)
    return np.asarray(plan & (np.abs(points_world[..., 2] - TABLE_M) < 0.02))


def with_hob(*, opening: bool) -> Capture:
    """The dining table with a sheet of black glass let into it, which returns no depth; or with an opening there.

    The first frame measures nothing in the opening either; the others measure the floor through it.
    """
    capture, _ = dining()
    depths = {}
    for frame in capture.frames:
        depth = capture.images.depth(frame.index).metres.copy()
        rows, columns = np.indices(depth.shape)
        pixels = np.stack([columns, rows], axis=-1) + 0.5
        on = in_hob(frame.world_from_camera.apply(unproject(pixels, depth, frame.depth_camera).reshape(-1, 3)))
        on = on.reshape(depth.shape)
        rays = unproject(pixels, np.ones_like(depth), frame.depth_camera) @ frame.world_from_camera.rotation.T
        floor = np.divide(
            -frame.world_from_camera.translation[2], rays[..., 2], out=np.zeros_like(depth), where=rays[..., 2] < 0
        )
        depth[on] = floor[on] if opening and frame.index else 0
        depths[frame.index] = depth
    surface = capture.surface
    kept = ~in_hob(surface.vertices_world)[surface.faces].any(axis=1)
    images = Pixels(cast(Pixels, capture.images).colours, depths)
    return replace(capture, images=images, surface=replace(surface, faces=surface.faces[kept]))


@pytest.mark.parametrize(("opening", "height_m"), [(False, TABLE_M), (True, 0.0)])
def test_a_glass_hob_click_hits_the_worktop_unless_frames_see_through_it(
    opening: bool, height_m: float, tmp_path: Path
) -> None:
    capture = with_hob(opening=opening)
    click = click_on(capture, (0.35, 0.0, TABLE_M), 0)
    picked = prepare_scene(capture, tmp_path).pick(click.frame, click.x, click.y)
    assert picked is not None
    assert picked[2] == pytest.approx(height_m, abs=0.02)


def test_images_have_the_common_exposure_of_the_recording(tmp_path: Path) -> None:
    capture, _ = dining()
    first = capture.frames[0]
    brighter = replace(capture, frames=(replace(first, gain=(0.5, 1.0, 1.0)), *capture.frames[1:]))
    before, after = capture.images.rgb(first.index), prepare_scene(brighter, tmp_path).balanced(first.index)
    dark = before.max(axis=2) < 200
    np.testing.assert_allclose(after[dark][:, 0], before[dark][:, 0] / 2, atol=1)
    np.testing.assert_array_equal(after[dark][:, 1:], before[dark][:, 1:])
