"""Where a box's side ends is read from photographs: depth smears it."""

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.capture import Frame
from r2c2r_core.segment.appliances.back_edges import depth_at_back_edge
from r2c2r_core.segment.fronts.front import Front
from r2c2r_core.segment.runs.orthomosaic import Cell, PlaneGrid
from r2c2r_core.segment.scene import Scene
from tests.core.segment.scenes import look_at

WIDTH_M, HEIGHT_M, DEPTH_M = 0.5, 0.4, 0.36
CAMERA = Intrinsics(fx=400.0, fy=400.0, cx=240.0, cy=180.0, width=480, height=360)
CELL_M = 0.005


@dataclass
class Photographs:
    """A box's right side (x = 0, front at y = 0) as cameras see it: to its end one colour, beyond it another."""

    beyond_rgb: tuple[int, int, int]
    frames: tuple[Frame, ...]

    def frame(self, index: int) -> Frame:
        return self.frames[index]

    def rgb(self, index: int) -> np.ndarray:
        y, _ = self._met(index)
        noise = np.random.default_rng(index).normal(0, 1.0, (*y.shape, 3))
        return (np.where(y[..., None] < DEPTH_M, (150, 150, 155), self.beyond_rgb) + noise).clip(0, 255).astype(np.uint8)

    def depth(self, index: int) -> np.ndarray:
        return self._met(index)[1].astype(np.float32)

    def _met(self, index: int) -> tuple[np.ndarray, np.ndarray]:
        """y and camera depth of where each pixel's ray meets the side's plane."""
        pose = self.frames[index].world_from_camera
        u, v = np.meshgrid(np.arange(CAMERA.width) + 0.5, np.arange(CAMERA.height) + 0.5)
        rays = np.stack([(u - CAMERA.cx) / CAMERA.fx, (v - CAMERA.cy) / CAMERA.fy, np.ones_like(u)], axis=-1)
        world = rays @ pose.rotation.T
        z = np.where(world[..., 0] < -1e-6, -pose.translation[0] / np.minimum(world[..., 0], -1e-6), 0.0)
        return pose.translation[1] + z * world[..., 1], z


def depth_found(beyond_rgb: tuple[int, int, int], about_m: float) -> float | None:
    frames = tuple(
        Frame(
            index=k,
            timestamp_s=None,
            rgb_camera=CAMERA,
            depth_camera=CAMERA,
            world_from_camera=look_at(np.array([0.8, -0.6 - 0.1 * k, 0.3]), np.array([0.0, 0.2, 0.0])),
            sharpness=1.0,
        )
        for k in range(4)
    )
    pose = Rigid3(np.eye(3), np.array([-WIDTH_M / 2, 0.0, 0.0]))
    columns, rows = round(WIDTH_M / CELL_M), round(HEIGHT_M / CELL_M)
    grid = PlaneGrid(world_from_plane=pose, left_m=-WIDTH_M / 2, top_m=HEIGHT_M / 2, cell_m=CELL_M, columns=columns, rows=rows)
    front = Front(cast(Any, SimpleNamespace(grid=grid)), Cell(0.0, 0.0, float(columns), float(rows)), None, 0.4)
    return depth_at_back_edge(front, cast(Scene, Photographs(beyond_rgb, frames)), about_m, 0.6)


@pytest.mark.parametrize("about_m", [0.33, 0.36, 0.40])
def test_the_depth_is_where_the_side_ends_however_far_off_the_surface_was(about_m: float) -> None:
    assert depth_found((90, 92, 96), about_m) == pytest.approx(DEPTH_M, abs=0.005)  # three steps of the search


def test_a_side_that_ends_in_its_own_colour_says_nothing() -> None:
    assert depth_found((150, 150, 155), 0.36) is None
