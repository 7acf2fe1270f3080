from dataclasses import replace

import numpy as np
import pytest

from r2c2r_core.kitchen.names import category_of
from r2c2r_core.model.inputs import ObjectOverride, Overrides
from r2c2r_core.synthesize.dimensions import MeasuredObject, measure_object
from r2c2r_core.synthesize.joints import choose_hinges
from tests.core.synthesize.kitchen_units import Handle, Unit, capture, placed_unit


def measured(*units: Unit) -> list[MeasuredObject]:
    rng = np.random.default_rng(0)
    return [measure_object(capture(), *placed_unit(unit, rng), category_of(unit.category), ObjectOverride()) for unit in units]


def door(name: str, x: float, handle: Handle | None, category: str = "cabinet", **more: object) -> Unit:
    return Unit(name, category, (x, 0, 0.5), (0.5, 0.58, 0.7), handle=handle, **more)  # type: ignore[arg-type]


@pytest.mark.parametrize("category", ["cabinet", "wall_cabinet", "refrigerator"])
@pytest.mark.parametrize("from_track", [True, False])
@pytest.mark.parametrize(("x", "side"), [(0.2, "left"), (-0.2, "right")])
def test_the_hinge_is_opposite_the_handle(x: float, side: str, from_track: bool, category: str) -> None:
    items = measured(door("a", 0, Handle(x, 0.1), category, with_track_handle=from_track))
    hinge = choose_hinges(items, Overrides(objects={}))["a"]
    assert (hinge.side, hinge.source) == (side, "inferred")


@pytest.mark.parametrize(
    ("category", "trusted", "side"), [("microwave", 0.3, "left"), ("microwave", 0.99, "right"), ("cabinet", 0.3, "right")]
)
def test_an_uncertain_handle_does_not_override_the_usual_hinge_side(category: str, trusted: float, side: str) -> None:
    (item,) = measured(door("a", 0, Handle(-0.2, 0.1), category))
    assert item.handle is not None
    item = replace(item, handle=replace(item.handle, confidence=trusted))
    assert choose_hinges([item], Overrides(objects={}))["a"].side == side


def test_a_hinge_set_by_a_person_overrides_the_handle() -> None:
    hinge = choose_hinges(measured(door("a", 0, Handle(0.2, 0.1))), Overrides(objects={"a": ObjectOverride(hinge="right")}))
    assert (hinge["a"].side, hinge["a"].source) == ("right", "person")


def test_two_undecided_neighbours_open_away_from_each_other() -> None:
    hinges = choose_hinges(measured(door("l", 0, None), door("r", 0.503, None)), Overrides(objects={}))
    assert (hinges["l"].side, hinges["r"].side) == ("left", "right")


def test_an_undecided_door_pairs_with_a_decided_neighbour() -> None:
    left_known = choose_hinges(measured(door("l", 0, Handle(0.2, 0.1)), door("r", 0.503, None)), Overrides(objects={}))
    right_known = choose_hinges(measured(door("l", 0, None), door("r", 0.503, Handle(-0.2, 0.1))), Overrides(objects={}))
    assert left_known["r"].side == "right"
    assert right_known["l"].side == "left"


def test_a_lone_door_without_a_handle_has_a_default_hinge_source() -> None:
    assert choose_hinges(measured(door("a", 0, None)), Overrides(objects={}))["a"].source == "default"


def test_a_wide_wall_flap_with_a_low_handle_is_hinged_at_the_top() -> None:
    flap = Unit("f", "wall_cabinet", (0, 0, 1.7), (0.8, 0.35, 0.4), handle=Handle(0, -0.15, vertical=False))
    assert choose_hinges(measured(flap), Overrides(objects={}))["f"].side == "top"


def test_an_oven_door_is_hinged_at_the_bottom() -> None:
    assert (
        choose_hinges(measured(door("o", 0, Handle(0, 0.3, vertical=False), "oven")), Overrides(objects={}))["o"].side
        == "bottom"
    )
