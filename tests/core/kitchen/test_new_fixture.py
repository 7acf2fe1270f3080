"""A new kind of unit takes one file in synthesize/fixtures and one line in the category table."""

from pathlib import Path

import numpy as np
import pytest

from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.kitchen import categories
from r2c2r_core.kitchen.category import Category, Size
from r2c2r_core.kitchen.depth import depths_behind
from r2c2r_core.kitchen.names import category_of
from r2c2r_core.model import materials
from r2c2r_core.model.rectangle import Rectangle3
from r2c2r_core.segment.things.thing import sized_as
from r2c2r_core.synthesize import fixtures
from tests.core.synthesize.kitchen_units import Unit, capture
from tests.core.synthesize.test_build_scene import built

FILE = '''"""A plate warmer: a flap that drops forward."""

from r2c2r_core.synthesize.fixtures.doors import hinged_cabinet
from r2c2r_core.synthesize.fixtures.spec import Build, Fixture, Order


def build(order: Order) -> Build:
    """One flap."""
    return hinged_cabinet(order, "bottom", upper_rad=1.0)


FIXTURE = Fixture(build=build)
'''
LINE = Category(
    name="plate_warmer",
    aliases=("warming_drawer",),
    kind="front",
    opens="bottom",
    hinge="bottom",
    fixture="plate_warmer",
    one_front=True,
    width=Size(0.5, 0.6, 0.9, "of this test"),
    depth=Size(0.4, 0.55, 0.6, "of this test"),
    height=Size(0.1, 0.14, 0.3, "of this test"),
    material=materials.OVEN,
)


@pytest.fixture
def plate_warmer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Add the file and the line."""
    (tmp_path / "plate_warmer.py").write_text(FILE, encoding="utf-8")
    monkeypatch.setattr(fixtures, "__path__", [*fixtures.__path__, str(tmp_path)])
    monkeypatch.setattr(categories, "CATEGORIES", (*categories.CATEGORIES, LINE))


@pytest.mark.usefixtures("plate_warmer")
@pytest.mark.parametrize("typed", ["plate warmer", "Warming drawers"])
def test_a_new_unit_needs_only_one_file_and_one_table_line(typed: str) -> None:
    category = category_of(typed)
    assert category is LINE
    assert sized_as(category).radius_m == 0.45
    front = Rectangle3(world_from_front=Rigid3(), width_m=0.6, height_m=0.14)
    assert depths_behind(capture(), front, category)[-1].depth_m == 0.55
    item = built(Unit("a", typed, (0, 0, 1.0), (0.6, 0.55, 0.14))).objects[0]
    assert (item.fixture, [joint.upper for joint in item.joints]) == ("plate_warmer", [1.0])
    np.testing.assert_allclose(item.dimensions_m, (0.6, 0.55, 0.14), atol=0.005)
    assert item.warnings == () or "category" not in item.warnings[0]
