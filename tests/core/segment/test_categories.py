import pytest

from r2c2r_core.segment.categories import hint_for
from r2c2r_core.synthesize.fixtures.table import FIXTURES

APPLIANCES = {"refrigerator", "side_by_side_refrigerator", "fridge_freezer", "freezer", "microwave", "hood"}
THINGS = {"counter", "open_shelf", "object"}


@pytest.mark.parametrize("name", [spec.name for spec in FIXTURES])
def test_every_fixture_is_looked_for_as_what_it_is(name: str) -> None:
    expected = "appliance" if name in APPLIANCES else "thing" if name in THINGS else "front"
    assert hint_for(name).kind == expected


def test_a_shelf_is_looked_for_further_from_the_click_than_a_box() -> None:
    assert hint_for("open shelves").thing.radius_m >= 2 * hint_for("box").thing.radius_m
