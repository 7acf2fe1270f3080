"""Depths of the units of one run, at fronts that were measured exactly: all in the plane y = 0."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from r2c2r_core.kitchen.depth import DepthSource, sigma_m
from r2c2r_core.kitchen.names import category_of
from r2c2r_core.model.inputs import ObjectOverride
from r2c2r_core.synthesize.dimensions import MeasuredObject, measure_object
from r2c2r_core.synthesize.layout import arrange
from tests.core.synthesize.kitchen_units import Unit, capture, placed_unit

NOTHING = ObjectOverride()


def unit(
    place: int,
    depth_m: float,
    source: DepthSource,
    *,
    category: str = "cabinet",
    proud_m: float = 0.0,
    stacked: bool = False,
    override: ObjectOverride = NOTHING,
) -> MeasuredObject:
    """The unit at a place of the row, or of the stack of drawers, whose shape has a depth of this source."""
    centre = (0.0, 0.0, 0.2 + 0.203 * place) if stacked else (0.603 * place, 0.0, 0.5)
    size = (0.6, depth_m, 0.2 if stacked else 0.7)
    shown = Unit(f"{category}_{place}", category, (centre[0], depth_m / 2 - proud_m, centre[2]), size)
    track, placement, asset = placed_unit(shown, np.random.default_rng(place))
    asset = replace(asset, parameters={"behind_sigma_m": sigma_m(source)})
    return measure_object(capture(), track, placement, asset, category_of(category), override)


def arranged(items: Sequence[MeasuredObject]) -> tuple[MeasuredObject, ...]:
    return arrange(items, 0.0, floor_found=True).objects


def depths(items: Sequence[MeasuredObject]) -> list[float]:
    return [float(item.dimensions_m[1]) for item in arranged(items)]


def test_units_of_an_island_are_as_deep_as_its_worktop_where_some_had_only_usual_depths() -> None:
    """No wall is behind an island; its worktop ends near the largest depth of a unit: traced for some, refused for others."""
    row = [unit(0, 0.80, "worktop"), unit(1, 0.58, "category"), unit(2, 0.48, "catalogue"), unit(3, 0.78, "worktop")]
    after = arranged(row)
    assert depths(row) == pytest.approx([0.78] * 4, abs=1e-3)
    np.testing.assert_allclose([item.front_centre for item in after], [item.front_centre for item in row], atol=1e-3)
    for item in after:  # meshes and filmed motions stay at their fronts
        np.testing.assert_allclose((item.world_from_object @ item.placed_pose.inverse).matrix, np.eye(4), atol=1e-3)


def test_drawers_of_one_stack_have_one_depth() -> None:
    stack = [
        unit(0, 0.58, "category", category="drawer", stacked=True),
        unit(1, 0.58, "category", category="drawer", stacked=True),
        unit(2, 0.80, "worktop", category="drawer", stacked=True),
    ]
    assert depths(stack) == pytest.approx([0.80] * 3, abs=1e-3)


@pytest.mark.parametrize("proud_m", [0.0, 0.02])
def test_an_oven_reaches_as_far_back_as_the_units_beside_it(proud_m: float) -> None:
    """A splashback behind its hob is a lining nearer than the wall: its own front ends there."""
    row = [unit(0, 0.65, "wall"), unit(1, 0.58, "wall", category="oven", proud_m=proud_m), unit(2, 0.65, "wall")]
    assert depths(row) == pytest.approx([0.65, 0.65 + proud_m, 0.65], abs=1e-3)


def test_walls_outvote_a_worktop() -> None:
    row = [unit(0, 0.70, "worktop"), unit(1, 0.60, "wall"), unit(2, 0.70, "worktop")]
    assert depths(row) == pytest.approx([0.60] * 3, abs=1e-3)


def test_units_whose_sides_were_seen_keep_their_own_depths_and_tell_their_neighbours() -> None:
    seen = [
        replace(unit(place, depth_m, "box"), sources=("measured", "measured", "measured"))
        for place, depth_m in ((0, 0.45), (3, 0.45), (5, 0.37))
    ]
    row = [*seen, unit(1, 0.60, "wall"), unit(2, 0.58, "category"), unit(4, 0.58, "category")]
    assert depths(row) == pytest.approx([0.45, 0.45, 0.37, 0.45, 0.45, 0.45], abs=1e-3)


def test_what_a_person_gave_stays_and_tells_the_neighbours() -> None:
    sized = unit(1, 0.58, "category", override=ObjectOverride(dimensions_m=np.array([0.6, 0.5, 0.7])))
    chosen = unit(3, 0.62, "catalogue", override=ObjectOverride(candidate="c2"))
    row = [unit(0, 0.58, "category"), sized, unit(2, 0.58, "category")]
    assert depths(row) == pytest.approx([0.5] * 3, abs=1e-3)
    assert depths([unit(2, 0.58, "wall"), chosen, unit(4, 0.58, "wall")])[1] == pytest.approx(0.62, abs=1e-3)
    pose = np.eye(4)
    pose[:3, 3] = (0.603, 0.29, 0.5)
    placed = unit(1, 0.58, "category", override=ObjectOverride(pose=pose))
    assert depths([unit(0, 0.65, "wall"), placed, unit(2, 0.65, "wall")]) == pytest.approx([0.65, 0.58, 0.65], abs=1e-3)


@pytest.mark.parametrize("other", [unit(2, 0.58, "category"), unit(1, 0.58, "category", proud_m=0.1)])
def test_a_unit_apart_or_in_another_plane_keeps_its_depth(other: MeasuredObject) -> None:
    assert depths([unit(0, 0.70, "worktop"), other]) == pytest.approx([0.70, 0.58], abs=1e-3)


def test_a_unit_is_not_made_deeper_than_its_kind_can_be() -> None:
    assert depths([unit(0, 0.75, "wall"), unit(1, 0.35, "category", category="wall_cabinet")]) == pytest.approx([0.75, 0.35])
