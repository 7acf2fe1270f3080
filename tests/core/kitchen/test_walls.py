"""Segment, generate and synthesize use the same wall behind a front, at the same distance."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from r2c2r_core.geometry.transforms import Rigid3, rotation_about_z
from r2c2r_core.kitchen.depth import depths_behind, front_depth
from r2c2r_core.kitchen.names import category_of
from r2c2r_core.kitchen.walls import depths_in, distances_behind
from r2c2r_core.model.capture import Wall
from r2c2r_core.model.rectangle import Rectangle3
from r2c2r_core.segment.fronts.front import depth_behind as depth_behind_front
from r2c2r_core.synthesize.dimensions import depth_behind as depth_behind_box
from tests.core.synthesize.kitchen_units import capture

OUTWARD = np.array([0.0, -1.0, 0.0])
MIDDLE = np.array([1.0, 0.5, 0.6])


def wall_at(distance_m: float, *, off_deg: float = 0.0) -> Wall:
    """A wall that far behind the front's centre, along its normal, and turned about the vertical."""
    normal = rotation_about_z(np.deg2rad(off_deg)) @ OUTWARD
    return Wall(normal=normal, offset_m=float(normal @ (MIDDLE - distance_m * OUTWARD)), area_m2=4.0)


def asked(walls: tuple[Wall, ...], category: str) -> list[float | None]:
    """Distance that each stage finds."""
    kind, scan = category_of(category), capture(walls)
    face = Rectangle3(world_from_front=Rigid3(np.eye(3), MIDDLE), width_m=0.6, height_m=0.6)
    front: Any = SimpleNamespace(outline=face)
    half = np.array([0.3, 0.25, 0.3])
    low, high = MIDDLE - half * [1, 0, 1], MIDDLE + half * [1, 2, 1]
    generated = next((d.depth_m for d in depths_behind(scan, face, kind) if d.source == "wall"), None)
    return [
        depth_behind_front(front, scan.room, kind).wall_m,
        None if generated is None else generated + 0.005,  # objects keep a gap to the wall
        depth_behind_box(scan, np.eye(3), low, high, kind.depth).wall_m,
    ]


@pytest.mark.parametrize("category", ["cabinet", "wall_cabinet", "refrigerator", "microwave"])
@pytest.mark.parametrize("share", [0.8, 1.0, 1.1])
@pytest.mark.parametrize("off_deg", [0.0, 9.0, -9.0])
def test_all_stages_use_the_same_wall_behind_a_front(category: str, share: float, off_deg: float) -> None:
    distance = share * category_of(category).depth.usual
    wall = wall_at(distance, off_deg=off_deg)
    assert asked((wall, wall_at(3.0)), category) == [pytest.approx(distance, abs=1e-9)] * 3


@pytest.mark.parametrize(
    "wall", [wall_at(0.58, off_deg=11.0), wall_at(0.58, off_deg=90.0), wall_at(-0.5), wall_at(2.5), wall_at(0.1)]
)
def test_no_stage_uses_an_unsuitable_wall(wall: Wall) -> None:
    assert asked((wall,), "cabinet") == [None] * 3


def test_the_nearest_plausible_wall_is_used() -> None:
    walls = (wall_at(0.7), wall_at(0.1), wall_at(0.55))
    assert front_depth(walls, MIDDLE, OUTWARD, category_of("cabinet").depth).depth_m == pytest.approx(0.55)
    np.testing.assert_allclose(distances_behind(walls, MIDDLE, OUTWARD), [0.1, 0.55, 0.7])


def test_a_front_without_a_wall_has_the_usual_depth_of_its_category() -> None:
    depth = category_of("cabinet").depth
    assert front_depth((), MIDDLE, OUTWARD, depth).wall_m is None
    assert front_depth((wall_at(2.5),), MIDDLE, OUTWARD, depth).depth_m == depth.usual


def test_a_wall_lining_counts_only_for_positions_before_its_span() -> None:
    along = float(np.cross([0.0, 0.0, 1.0], OUTWARD) @ MIDDLE)
    before = replace(wall_at(0.55), span_m=(along - 0.2, along + 0.5))
    beside = replace(wall_at(0.55), span_m=(along + 0.2, along + 0.9))
    assert distances_behind((wall_at(0.63), before), MIDDLE, OUTWARD) == pytest.approx([0.55, 0.63])
    assert distances_behind((wall_at(0.63), beside), MIDDLE, OUTWARD) == pytest.approx([0.63])


def test_the_depth_of_points_inside_a_wall_is_in_metres() -> None:
    points = MIDDLE - np.outer([0.2, 0.6], OUTWARD)
    np.testing.assert_allclose(depths_in((wall_at(0.5), wall_at(0.9)), points), [0.1, -0.3])
