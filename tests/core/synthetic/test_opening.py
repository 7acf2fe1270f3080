"""What stands open in the later frames stands where its joint says."""

import numpy as np
import pytest

from r2c2r_core.synthetic.build import build_kitchen
from r2c2r_core.synthetic.kitchen import Kitchen
from r2c2r_core.synthetic.layout import plan_kitchen
from r2c2r_core.synthetic.opening import opened_units


def furthest_out(kitchen: Kitchen, name: str, opened: dict[str, float]) -> float:
    """How far a unit's surfaces reach in front of its closed face, handle apart, metres."""
    number = kitchen.object_names.index(name) + 1
    unit = next(f for f in kitchen.base if f.name == name)
    patches = [p for p in build_kitchen(kitchen, opened) if p.object_id == number and not p.is_handle]
    return float(-min(p.grid[..., 1].min() for p in patches) - unit.depth_m)


@pytest.mark.parametrize("seed", [0, 3])
def test_a_drawer_and_a_door_stand_open_as_far_as_the_truth_says(seed: int) -> None:
    kitchen = plan_kitchen(seed)
    opened = opened_units(kitchen)
    units = {f.name: f for f in kitchen.base if f.name in opened}
    assert sorted(f.category for f in units.values()) == ["cabinet", "drawer"]
    for name, unit in units.items():
        leaf = unit.leaves[0]
        assert furthest_out(kitchen, name, {}) == pytest.approx(0.0, abs=1e-6)
        swings = leaf.hinge is not None
        reach = leaf.width_m * np.sin(opened[name]) if swings else opened[name]
        thickness = kitchen.style.front_thickness_m if swings else 0.0  # beyond a right angle the leaf's back is further out
        assert furthest_out(kitchen, name, opened) == pytest.approx(reach, abs=thickness + 1e-6)


def test_a_kitchen_with_nothing_opened_is_the_kitchen_it_was() -> None:
    kitchen = plan_kitchen(1)
    assert all(np.array_equal(a.grid, b.grid) for a, b in zip(build_kitchen(kitchen), build_kitchen(kitchen, {}), strict=True))
