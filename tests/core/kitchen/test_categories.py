"""The category table, and every name in it through every stage: all stages use the same table."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from r2c2r_core.export.manifest import manifest_of
from r2c2r_core.export.plan import plan_bundle
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.kitchen.categories import CATEGORIES
from r2c2r_core.kitchen.category import Category
from r2c2r_core.kitchen.depth import depths_behind
from r2c2r_core.kitchen.names import category_of
from r2c2r_core.model.capture import Wall
from r2c2r_core.model.inputs import Overrides
from r2c2r_core.model.rectangle import Rectangle3
from r2c2r_core.model.scene import SceneObject
from r2c2r_core.segment.geometric import finders
from r2c2r_core.segment.things.thing import sized_as
from r2c2r_core.synthesize.fixtures.spec import Order, Part
from r2c2r_core.synthesize.fixtures.table import fixture_of
from r2c2r_core.synthesize.stage import SynthesizeConfig, build_scene
from r2c2r_core.warp.stage import WarpConfig, fit_meshes
from tests.core.export.kitchen import reconstruction
from tests.core.synthesize.kitchen_units import Unit, capture, placed_unit
from tests.core.synthesize.test_build_scene import built

PAIRED = {"double_door_cabinet", "double_door_wall_cabinet", "sink_cabinet", "double_sink_cabinet"}
OPENS = {"drawer": "prismatic", "sideways": "prismatic", "side": "revolute", "pair": "revolute", "bottom": "revolute"}


def unit_called(name: str, category: Category) -> Unit:
    """An object of usual size with that name as its category."""
    kind = "thing" if category.kind == "thing" else "appliance"
    return Unit("a", name, (0, 0, 1.2), category.usual_m, kind=kind)


def built_as(name: str, category: Category) -> SceneObject:
    """The object that is built from it."""
    return built(unit_called(name, category)).objects[0]


def exported_as(name: str, category: Category) -> tuple[SceneObject, dict[str, Any]]:
    """The object as built and fitted to a mesh, and its manifest entry."""
    track, placement, asset = placed_unit(unit_called(name, category), np.random.default_rng(0))
    of = (track,), (placement,), (asset,)
    scene = build_scene(capture(()), *of, Overrides(objects={}), SynthesizeConfig(surroundings=False))
    fitted = fit_meshes(scene, *of, WarpConfig())
    alone = replace(reconstruction(fitted), tracks=(), candidates=(), placements=())
    (entry,) = manifest_of(alone, plan_bundle(fitted), None)["objects"]
    return fitted.objects[0], entry


def facts_of(item: SceneObject) -> dict[str, Any]:
    """All data of an object except its name, as plain values."""
    links = [
        (
            link.name,
            link.inertial.mass_kg,
            link.inertial.com_link,
            [(b.role, b.size_m) for b in link.boxes],
            link.visual is not None,
        )
        for link in item.links
    ]
    joints = [
        (j.name, j.type, j.parent, j.child, j.axis_object, j.origin_object, j.lower, j.upper, j.damping) for j in item.joints
    ]
    shape = (item.dimensions_m, item.dimension_sources, item.warp_residual_m, dict(item.inside_sources))
    return {
        "fixture": item.fixture,
        "movable": item.movable,
        "shape": plain(shape),
        "links": plain(links),
        "joints": plain(joints),
    }


def unnamed(entry: dict[str, Any]) -> dict[str, Any]:
    """A manifest entry without the category's name and the sentences that contain it."""
    labels = {body: {**said, "category": ""} for body, said in entry["labels"].items()}
    return {**entry, "category": "", "labels": labels, "warnings": len(entry["warnings"])}


def plain(value: Any) -> Any:
    """The value with arrays as lists."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    return [plain(each) for each in value] if isinstance(value, (tuple, list)) else value


def parts_of(category: Category) -> tuple[Part, ...]:
    fixture = fixture_of(category)
    if fixture is None:
        return ()
    order = Order(dimensions_m=np.array(category.usual_m), material=category.material, hinge=category.hinge, handle=None)
    return fixture.build(order).parts


@pytest.mark.parametrize("category", CATEGORIES, ids=lambda category: category.name)
def test_every_category_is_complete_and_consistent(category: Category) -> None:
    for size in (category.width, category.depth, category.height):
        assert 0 < size.low <= size.usual <= size.high
        assert len(size.source) > 20
    assert (category.fixture is None) == (category.opens == "rigid") == (fixture_of(category) is None)
    assert (category.hinge is not None) == (category.opens in ("side", "bottom", "sideways"))
    if category.wider is not None:
        least, other = category.wider
        assert category_of(other).opens == "pair"
        assert category_of(other).width.low <= least <= category.width.high


@pytest.mark.slow
@pytest.mark.parametrize("category", CATEGORIES, ids=lambda category: category.name)
def test_all_names_of_a_category_are_built_and_exported_the_same(category: Category) -> None:
    """Stages pass the category as text: their results must not depend on the synonym typed."""
    first, entry = exported_as(category.name, category)
    for name in category.names[1:]:
        item, said = exported_as(name, category)
        assert item.category == said["category"] == name  # as typed
        assert facts_of(item) == facts_of(first), name
        assert unnamed(said) == unnamed(entry), name


@pytest.mark.parametrize("category", CATEGORIES, ids=lambda category: category.name)
def test_all_names_of_a_category_are_segmented_and_measured_the_same(
    category: Category, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: dict[str, Any] = {}
    monkeypatch.setattr(finders, "regions_at", lambda planes, point, **_: [object()])
    monkeypatch.setattr(finders, "find_front", lambda run, on, off, **how: asked.update(how))
    bench: Any = type("Bench", (), {"planes": (), "run_of": lambda self, region, margin_m=0.0: object()})()
    item = built_as(category.name, category)
    wall = Wall(normal=np.array([0.0, -1.0, 0.0]), offset_m=-category.depth.usual, area_m2=4.0)
    front = Rectangle3(world_from_front=Rigid3(), width_m=0.6, height_m=0.6)
    for name in category.names:
        found = category_of(name)
        # segment: kind of object searched for
        finders._front(bench, found, np.zeros((1, 3)), np.zeros((0, 3)), np.zeros((0, 3)))
        assert asked["pair"] == (category.name in PAIRED or category.name.endswith("refrigerator"))
        assert asked["kind"] is category
        assert sized_as(found).radius_m == min(category.longest_m / 2, 2.0 if category.flat_top else 1.0)
        # generate: its depth, and which wall may be behind it
        depths = depths_behind(capture((wall,)), front, found)
        assert depths[-1].depth_m == pytest.approx(category.depth.usual, abs=0.006)
    # synthesize: the built parts
    assert item.fixture == (category.name if category.fixture is not None else "object")
    assert {joint.type for joint in item.joints} == ({OPENS[category.opens]} if category.opens in OPENS else set())
    density = {part.density_kg_m3 for part in parts_of(category)}
    assert density <= {category.material.density_kg_m3}


@pytest.mark.parametrize(
    ("typed", "kind", "opens", "depth_m"),
    [
        ("pantry", "front", "side", 0.58),
        ("wall_unit", "front", "side", 0.35),
        ("cooker", "front", "bottom", 0.62),
        ("extractor", "appliance", "fixed", 0.45),
        ("chest_of_drawers", "front", "drawer", 0.58),
        ("two_door_cabinet", "front", "pair", 0.58),
        ("microwave_oven", "appliance", "side", 0.38),
        ("upper_cabinet", "front", "side", 0.35),
        ("sliding wardrobe doors", "front", "sideways", 0.58),
        ("wall oven", "front", "bottom", 0.58),
        ("refrigerator", "appliance", "side", 0.65),
        ("hood", "appliance", "fixed", 0.45),
    ],
)
def test_names_resolve_to_one_category_kind_opening_and_depth(typed: str, kind: str, opens: str, depth_m: float) -> None:
    """These names once had different kinds, joints or depths in the tables of different stages."""
    category = category_of(typed)
    assert (category.kind, category.opens, category.depth.usual) == (kind, opens, depth_m)
    joints = built_as(typed, category).joints
    assert len(joints) == {"fixed": 0, "pair": 2}.get(opens, 3 if category.several_fronts else 1)


def test_a_bottle_is_recognised_and_has_a_realistic_mass() -> None:
    item = built_as("wine bottle", category_of("bottle"))
    assert item.movable
    assert item.warnings == () or "category" not in item.warnings[0]
    assert 0.2 <= item.links[0].inertial.mass_kg <= 2.2
