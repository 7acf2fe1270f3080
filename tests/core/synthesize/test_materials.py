"""Every physical parameter has a source, and the resulting masses and forces are realistic."""

import numpy as np
import pytest

from r2c2r_core.kitchen.categories import CATEGORIES
from r2c2r_core.kitchen.category import Category
from r2c2r_core.model import materials
from r2c2r_core.model.materials import JointFeel, Material
from r2c2r_core.model.scene import ConvexPiece
from r2c2r_core.synthesize.fixtures.spec import Build, Order
from r2c2r_core.synthesize.fixtures.table import fixture_of
from r2c2r_core.synthesize.physics import inertial_of_boxes, inertial_of_pieces, weighing

MATERIALS = {name: value for name, value in vars(materials).items() if isinstance(value, Material)}
FEELS = {name: value for name, value in vars(materials).items() if isinstance(value, JointFeel)}
ONE_HAND_N, LEVER_M = 22.2, 0.4  # 2010 ADA Standards 309.4; handle to hinge of a usual door
BUILT = [category for category in CATEGORIES if category.fixture is not None]


def built_of(category: Category) -> Build:
    fixture = fixture_of(category)
    assert fixture is not None
    order = Order(dimensions_m=np.array(category.usual_m), material=category.material, hinge=category.hinge, handle=None)
    return fixture.build(order)


@pytest.mark.parametrize("name", [*MATERIALS, *FEELS])
def test_every_value_names_its_source(name: str) -> None:
    source = (MATERIALS | FEELS)[name].source
    assert len(source) > 20
    assert any(ch.isdigit() for ch in source), "a source states figures that can be checked"


@pytest.mark.parametrize("category", BUILT, ids=lambda category: category.name)
def test_fixtures_use_the_feel_material_and_weight_of_the_table(category: Category) -> None:
    fixture = fixture_of(category)
    assert fixture is not None
    assert fixture.feel in FEELS.values()
    parts = built_of(category).parts
    assert {part.density_kg_m3 for part in parts} == {category.material.density_kg_m3}
    least, most = category.material.weight_kg or (0.0, np.inf)
    if category.name not in ("freezer", "side_by_side_refrigerator"):  # lower and wider than the usual unit of their material
        assert least <= sum(inertial_of_boxes(part.boxes, part.density_kg_m3).mass_kg for part in parts) <= most


@pytest.mark.parametrize("name", FEELS)
def test_joint_friction_and_damping_allow_opening_with_one_hand(name: str) -> None:
    feel = FEELS[name]
    slide = name.startswith("SLIDE")
    lever, speed = (1.0, 0.3) if slide else (LEVER_M, 0.5)  # m/s, rad/s: a drawer in 1.5 s, a door in 3 s
    assert (feel.friction + feel.damping * speed) / lever < ONE_HAND_N / 2
    assert feel.friction > 0.0
    assert feel.damping > 0.0
    assert ONE_HAND_N * lever < feel.effort < 100.0  # a limit that a hand does not reach, yet a finite one


@pytest.mark.parametrize("edge_m", [0.01, 0.09, 0.5])
def test_the_mass_of_a_thing_is_scaled_into_its_usual_range(edge_m: float) -> None:
    """The mass of a mug with too large, too small or correct colliders is scaled into the range, and inertia with it."""
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) * edge_m
    raw = inertial_of_pieces([ConvexPiece(name="lump", vertices_link=corners)], materials.MUG.density_kg_m3)
    usual = materials.MUG.weight_kg
    assert usual is not None
    inertial = weighing(raw, usual)
    assert usual[0] <= inertial.mass_kg <= usual[1]
    np.testing.assert_allclose(inertial.inertia / inertial.mass_kg, raw.inertia / raw.mass_kg, rtol=1e-9)
