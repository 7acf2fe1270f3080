"""What lies under a pixel where the sensor has no depth."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from r2c2r_core.segment.scene import Scene

NEAR_M, FAR_M = 2.5, 2.83
STEP_COLUMN = 120  # of 256: the near side ends there
SCALE = 960 / 256


def at(column: float, *, gap: int, far_m: float = FAR_M) -> float | None:
    """Depth at a column of a depth image in which `gap` pixels are missing from the end of the near side on."""
    depth = np.full((192, 256), NEAR_M, np.float32)
    depth[:, STEP_COLUMN:] = far_m
    depth[:, STEP_COLUMN : STEP_COLUMN + gap] = 0
    scene: Any = SimpleNamespace(
        depth=lambda index: depth, frame=lambda index: SimpleNamespace(rgb_camera=SimpleNamespace(width=960, height=720))
    )
    return Scene.depth_at_step(cast(Scene, scene), 0, column * SCALE, 300.0)


def test_a_pixel_in_the_gap_between_two_surfaces_is_of_the_nearer_one() -> None:
    assert at(STEP_COLUMN + 1.5, gap=5) == pytest.approx(NEAR_M)
    assert at(STEP_COLUMN + 4.0, gap=5) == pytest.approx(FAR_M)


def test_a_pixel_that_has_depth_asks_nobody() -> None:
    assert at(STEP_COLUMN - 0.5, gap=5) is None


def test_a_hole_in_one_surface_is_no_gap_between_two() -> None:
    assert at(STEP_COLUMN + 1.5, gap=5, far_m=NEAR_M + 0.02) is None


def test_a_wide_hole_returns_no_light() -> None:
    assert at(STEP_COLUMN + 20.0, gap=40) is None


def test_the_corner_of_a_picture_is_answered() -> None:
    assert at(255.9, gap=136) is None
