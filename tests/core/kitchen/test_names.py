"""Typed names map to one line of the category table, or are reported as unknown."""

import pytest

from r2c2r_core.kitchen.categories import CATEGORIES
from r2c2r_core.kitchen.names import category_of, named

NAMES = [(name, category.name) for category in CATEGORIES for name in category.names]


@pytest.mark.parametrize(("name", "meant"), NAMES)
def test_names_are_recognised_in_any_case_and_spacing(name: str, meant: str) -> None:
    for typed in (name, name.upper(), f" {name.replace('_', ' ')} ", name.replace("_", "-").title(), f"{name}_12"):
        assert category_of(typed).name == meant, typed
        assert named(typed).notice is None


@pytest.mark.parametrize(("name", "meant"), [pair for pair in NAMES if pair[0] != "drawer"])
def test_plural_names_are_recognised(name: str, meant: str) -> None:
    ending = "es" if name.endswith(("s", "x", "ch", "sh")) else "s"
    assert category_of(name + ending).name == meant


def test_names_are_unique_without_separators() -> None:
    squeezed = [name.replace("_", "") for name, _ in NAMES]
    assert sorted(squeezed) == sorted(set(squeezed))


@pytest.mark.parametrize(
    ("typed", "meant"),
    [
        ("Double-door cabinet", "double_door_cabinet"),
        ("2-door cabinet", "double_door_cabinet"),
        ("white two-door base cabinet", "double_door_cabinet"),
        ("upper left cabinet", "wall_cabinet"),
        ("WallCabinet", "wall_cabinet"),
        ("Micro wave", "microwave"),
        ("Micro-wave Ovens 2", "microwave"),
        ("fridge-freezer", "fridge_freezer"),
        ("dish washer", "dishwasher"),
        ("kitchen sink", "sink_cabinet"),
        ("top drawer", "drawer"),
        ("kitchen drawers", "drawer_stack"),
        ("open shelves", "open_shelf"),
        ("stoves", "range"),
        ("glass of water", "glass"),
        ("coffee_mug", "mug"),
        ("plant pot", "planter"),
        ("bar stools", "stool"),
        ("dining-table", "table"),
    ],
)
def test_compound_names_are_recognised_by_head_and_modifiers(typed: str, meant: str) -> None:
    assert category_of(typed).name == meant


@pytest.mark.parametrize(
    "typed",
    [
        *("Kühlschrank", "", "  ", "7", "of", "widget", "bottle opener", "oven mitt", "table lamp", "desk-lamp", "table cloth"),
        *("dish rack", "car door", "refrigerator door", "solar panel", "mountain range", "chair_cushion", "turntable"),
        *("vegetable", "tablet", "potato", "microwave cart", "drawer knob"),
    ],
)
def test_unknown_names_become_rigid_things_with_a_notice(typed: str) -> None:
    category, notice = named(typed)
    assert (category.name, category.opens, category.kind) == ("object", "rigid", "thing")
    assert notice is not None
    assert repr(typed) in notice


@pytest.mark.parametrize(("typed", "meant"), [("mircowave", "microwave"), ("drawr", "drawer")])
def test_misspelled_names_get_a_suggestion(typed: str, meant: str) -> None:
    notice = named(typed).notice
    assert notice is not None
    assert meant in notice.partition("did you mean")[2]
