"""Sliding doors: one before the adjacent panel slides; one beside a blind panel at its own thickness, or a run, does not."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from r2c2r_core.geometry.transforms import Rigid3, front_rotation
from r2c2r_core.segment.fronts.front import Front
from r2c2r_core.segment.fronts.sliding import sliding_chance
from r2c2r_core.segment.mosaics.handles import GridHandle
from r2c2r_core.segment.mosaics.orthomosaic import Cell, PlaneGrid
from r2c2r_core.segment.planes import PlaneRegion

WIDTH, HEIGHT, CELL_M = 0.5, 0.7, 0.0025
OUTWARD = np.array([0.0, -1.0, 0.0])


def door(handle_x_m: float | None = 0.04) -> Front:
    """A door from x = 0 to 0.5 m in the plane y = 0, of uniform colour, its pull that far from its left edge."""
    rotation = front_rotation(OUTWARD)
    grid = PlaneGrid(
        world_from_plane=Rigid3(rotation, np.zeros(3)), left_m=0.0, top_m=HEIGHT, cell_m=CELL_M, columns=400, rows=280
    )
    region: Any = SimpleNamespace(world_from_plane=Rigid3(rotation, np.zeros(3)))
    run: Any = SimpleNamespace(grid=grid, region=region, mosaic=np.full((280, 400, 3), 120, np.uint8))
    at = None if handle_x_m is None else handle_x_m / CELL_M
    handle = None if at is None else GridHandle(left=at - 4, top=80, right=at + 4, bottom=140, confidence=0.9)
    return Front(run, Cell(0, 0, WIDTH / CELL_M, HEIGHT / CELL_M), handle, 0.58)


def panel(back_m: float, height_m: float = HEIGHT) -> PlaneRegion:
    """A panel from x = 0.5 to 1 m, that far behind the door's plane, about its middle height."""
    middle = np.array([0.75, back_m, HEIGHT / 2])
    support = np.ones((round(height_m / 0.02), 25), bool)
    return PlaneRegion(Rigid3(front_rotation(OUTWARD), middle), 0.5, height_m, support, 0.02, 0.5 * height_m)


def test_a_door_one_track_before_a_panel_is_a_sliding_door() -> None:
    assert sliding_chance(door(), (panel(0.04),)) > 0.9


@pytest.mark.parametrize(
    "beside",
    [(), (panel(0.02),), (panel(0.0),), (panel(0.3),), (panel(0.04, height_m=1.4),)],
    ids=["nothing", "a blind panel", "the next door", "a shelf's back", "what is higher"],
)
def test_doors_without_a_panel_one_track_behind_are_not_sliding_doors(beside: tuple[PlaneRegion, ...]) -> None:
    assert sliding_chance(door(), beside) < 0.7


def test_a_pull_near_the_adjacent_panel_lowers_the_sliding_probability() -> None:
    away, none, near = (sliding_chance(door(x), (panel(0.04),)) for x in (0.04, None, 0.46))
    assert away > none > near
