"""Every line of the fixture table end to end: built, written as URDF, MJCF and USD, linted, loaded and opened."""

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from r2c2r_core.export.cavities import cavity_open
from r2c2r_core.export.lint import lint
from r2c2r_core.geometry.meshes import box_mesh
from r2c2r_core.kitchen.categories import CATEGORIES
from r2c2r_core.kitchen.names import category_of
from r2c2r_core.model.inputs import HingeSide
from r2c2r_core.model.scene import ArticulatedScene, Box, SceneObject
from r2c2r_core.model.track import FrontHandle
from r2c2r_core.synthesize.fixtures.doors import split_handle
from r2c2r_core.synthesize.fixtures.seams import seams_between
from r2c2r_core.synthesize.fixtures.spec import Build, Order
from r2c2r_core.synthesize.fixtures.table import fixture_of
from r2c2r_core.synthesize.handles import handles_of_mesh
from r2c2r_core.synthesize.surface import sampled
from tests.core.export.conftest import write_folder
from tests.core.synthesize.kitchen_units import Handle, Unit
from tests.core.synthesize.mujoco_oracle import compile_scene, deepest_contact, reached, sweep
from tests.core.synthesize.test_build_scene import built

BUILT = [spec for spec in CATEGORIES if spec.fixture is not None]
PARTS = {
    "drawer": {"drawer"},
    "drawer_stack": {"drawer_1", "drawer_2", "drawer_3"},
    "double_door_cabinet": {"left_door", "right_door"},
    "double_door_wall_cabinet": {"left_door", "right_door"},
    "double_sink_cabinet": {"left_door", "right_door"},
    "side_by_side_refrigerator": {"left_door", "right_door"},
    "fridge_freezer": {"upper_door", "lower_door"},
    **{name: set() for name in ("counter", "hood", "open_shelf", "fixed_panel", "washing_machine")},
}


@pytest.fixture(scope="module")
def every_fixture() -> ArticulatedScene:
    """Fixtures two metres apart, each at its usual size, standing on the floor."""
    return built(
        *(Unit(s.name, s.name, (2.0 * k, 0, s.height.usual / 2), s.usual_m, kind="appliance") for k, s in enumerate(BUILT))
    )


@pytest.fixture(scope="module")
def folder(every_fixture: ArticulatedScene, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_folder(every_fixture, tmp_path_factory.mktemp("fixtures") / "bundle")


def test_every_fixture_has_the_moving_parts_of_its_name(every_fixture: ArticulatedScene) -> None:
    for item in every_fixture.objects:
        assert item.fixture == item.category
        moving = {joint.child.removeprefix(f"{item.name}_") for joint in item.joints}
        assert moving == PARTS.get(item.fixture, {"door"}), item.name


def test_every_fixture_opens_in_the_written_mjcf(folder: Path, every_fixture: ArticulatedScene) -> None:
    model = mujoco.MjModel.from_xml_path(str(folder / "scene.xml"))
    joints = {joint.name for item in every_fixture.objects for joint in item.joints}
    assert {model.joint(k).name for k in range(model.njnt)} == joints
    shares = reached(every_fixture, model, seconds=3.0)
    assert min(shares.values()) >= 0.98, shares


def test_opening_parts_give_access_to_their_cavity(folder: Path) -> None:
    model = mujoco.MjModel.from_xml_path(str(folder / "scene.xml"))
    shares = {model.joint(k).name: cavity_open(model, model.joint(k).name) for k in range(model.njnt)}
    assert min(share for share in shares.values() if share is not None) >= 0.9, shares


def test_exported_fixtures_have_no_lint_findings_except_unsure_hinges(folder: Path) -> None:
    found = [f for f in lint(folder) if "preview" not in f.message]
    assert {f.rule for f in found} == {"hinge-unsure"}  # none of the doors here has a handle


def test_fixtures_have_no_contacts_at_rest_or_during_sweeps(every_fixture: ArticulatedScene) -> None:
    model = compile_scene(every_fixture)
    assert deepest_contact(model) < 5e-4
    assert max(sweep(every_fixture, model).values()) < 1e-3


def the(scene: ArticulatedScene, name: str) -> SceneObject:
    return next(item for item in scene.objects if item.name == name)


@pytest.mark.parametrize(
    "name", ["cabinet", "wall_cabinet", "double_door_cabinet", "refrigerator", "freezer", "fridge_freezer", "open_shelf"]
)
def test_storage_fixtures_have_shelves_inside(every_fixture: ArticulatedScene, name: str) -> None:
    base = the(every_fixture, name).links[0]
    shelves = [box for box in base.boxes if box.name.startswith("shelf")]
    assert shelves
    half = the(every_fixture, name).dimensions_m / 2
    for box in shelves:
        assert (np.abs(box.link_from_box.translation) + box.size_m / 2 < half - 0.005).all()
        assert box.size_m[2] >= 0.008


@pytest.mark.parametrize("z_m", [-0.19, -0.25])
def test_a_guessed_parting_line_moves_off_the_handle_that_crosses_it(z_m: float) -> None:
    """It lies at -0.228 m: a door behind another door's handle would not open."""
    unit = Unit("a", "fridge_freezer", (0, 0, 0.875), (0.6, 0.65, 1.75), handle=Handle(0.2, z_m), kind="appliance")
    joints = built(unit).objects[0].joints
    assert [joint.upper for joint in joints] == pytest.approx([np.deg2rad(115)] * 2)


def test_drawer_tray_boards_are_at_least_8_mm_thick(every_fixture: ArticulatedScene) -> None:
    tray = [box for box in the(every_fixture, "drawer").links[1].boxes if box.name.startswith("tray")]
    assert min(box.size_m.min() for box in tray) >= 0.008 - 1e-9


def test_a_sink_cabinet_is_open_at_the_top(every_fixture: ArticulatedScene) -> None:
    boxes = the(every_fixture, "sink_cabinet").links[0].boxes
    over_the_middle = [
        b
        for b in boxes
        if (np.abs(b.link_from_box.translation[:2]) < b.size_m[:2] / 2).all() and b.link_from_box.translation[2] > 0
    ]
    assert over_the_middle == []


@pytest.mark.parametrize(
    ("category", "width", "fixture", "doors"),
    [
        ("sink cabinet", 0.6, "sink_cabinet", 1),
        ("sink cabinet", 0.8, "double_sink_cabinet", 2),
        ("fridge", 0.7, "refrigerator", 1),
        ("fridge", 0.91, "side_by_side_refrigerator", 2),
    ],
)
def test_a_wide_unit_gets_two_doors(category: str, width: float, fixture: str, doors: int) -> None:
    item = built(Unit("a", category, (0, 0, 0.9), (width, 0.6, 0.8), kind="appliance")).objects[0]
    assert (item.fixture, len(item.joints)) == (fixture, doors)


def test_a_wide_fridge_with_an_edge_handle_has_one_door() -> None:
    unit = Unit("a", "fridge", (0, 0, 0.9), (0.85, 0.6, 1.8), kind="appliance", handle=Handle(0.36, 0.1))
    assert len(built(unit).objects[0].joints) == 1


def handle_at(z: float, *, x: float = 0.0) -> FrontHandle:
    return FrontHandle(left_m=x - 0.08, right_m=x + 0.08, bottom_m=z - 0.01, top_m=z + 0.01, protrusion_m=0.03, confidence=0.9)


def grip_of(handle: FrontHandle) -> Box:
    (grip,) = [box for part in build_with("drawer", handle).parts for box in part.boxes if box.name == "handle"]
    return grip


def test_a_grip_says_what_was_measured_of_its_handle() -> None:
    grip = grip_of(handle_at(0.0))
    assert (dict(grip.sources), grip.confidence) == ({"place": "measured", "protrusion": "measured"}, 0.9)
    from_mesh = grip_of(replace(handle_at(0.0), source="inferred", protrusion_m=0.001))
    assert dict(from_mesh.sources) == {"place": "inferred", "protrusion": "default"}  # too near to be measured: clipped
    knob = grip_of(replace(handle_at(0.0), left_m=-0.01, right_m=0.01))
    assert knob.sources["thickness"] == "measured"  # down to the front


def test_the_mirrored_handle_of_a_pair_is_inferred() -> None:
    left, right = split_handle(handle_at(0.0, x=0.2), np.array([1.0, 0.6, 0.8]))
    assert left is not None
    assert right is not None
    assert (left.source, right.source) == ("inferred", "measured")


def build_with(name: str, *handles: FrontHandle, hinge: HingeSide = "left") -> Build:
    category = category_of(name)
    fixture = fixture_of(category)
    assert fixture is not None
    order = Order(
        dimensions_m=np.array(category.usual_m),
        material=category.material,
        hinge=hinge,
        handle=next(iter(handles), None),
        handles=handles,
    )
    return fixture.build(order)


@pytest.mark.parametrize("heights", [(0.24, 0.24, 0.24), (0.14, 0.29, 0.29), (0.13, 0.19, 0.19, 0.21)])
def test_seams_are_found_from_handles_in_the_middle_of_each_front(heights: tuple[float, ...]) -> None:
    tops = 0.36 - np.cumsum([0, *heights])
    middles = (tops[1:] + tops[:-1]) / 2
    np.testing.assert_allclose(seams_between(list(middles), 0.72) or [], tops[1:-1], atol=1e-9)


def test_seams_are_found_from_handles_near_the_upper_edges() -> None:
    tops = 0.36 - np.cumsum([0, 0.14, 0.29, 0.29])
    np.testing.assert_allclose(seams_between(list(tops[:-1] - 0.04), 0.72) or [], tops[1:-1], atol=1e-9)


def test_a_drawer_stack_has_one_drawer_per_row_of_handles() -> None:
    rows = (handle_at(z, x=x) for z in (0.075, -0.215) for x in (-0.1, 0.1))
    build = build_with("chest of drawers", handle_at(0.29), *rows)
    fronts = [part.boxes[0] for part in build.parts[1:]]
    np.testing.assert_allclose([box.size_m[2] for box in fronts], [0.14, 0.29, 0.29], atol=0.004)
    held = [[box.name for box in part.boxes if box.name.startswith("handle")] for part in build.parts[1:]]
    assert [len(names) for names in held] == [3, 6, 6]
    assert build.notes == ()


def test_a_drawer_stack_with_missed_handles_gets_three_drawers_by_default() -> None:
    build = build_with("drawer_stack", handle_at(0.0))
    assert len(build.motions) == 3
    assert "by default" in build.notes[0]


def test_fridge_freezer_doors_meet_between_their_handles() -> None:
    build = build_with("fridge_freezer", handle_at(0.4), handle_at(0.2))
    upper, lower = (part.boxes[0] for part in build.parts[1:])
    assert upper.link_from_box.translation[2] - upper.size_m[2] / 2 == pytest.approx(0.3, abs=0.005)
    assert lower.link_from_box.translation[2] + lower.size_m[2] / 2 == pytest.approx(0.3, abs=0.005)


def test_cabinets_open_about_the_requested_hinge_side() -> None:
    for side, axis in (("left", (0, 0, -1)), ("right", (0, 0, 1)), ("top", (-1, 0, 0)), ("bottom", (1, 0, 0))):
        for name in ("cabinet", "wall_cabinet", "sink_cabinet"):
            assert tuple(build_with(name, hinge=side).motions[0].axis_object) == axis


def test_each_protruding_bar_of_a_mesh_is_found_as_a_handle() -> None:
    boxes = [box_mesh(np.array([-0.3, -0.29, -0.36]), np.array([0.3, 0.29, 0.36]))]
    boxes += [box_mesh(np.array([-0.1, -0.325, z - 0.01]), np.array([0.1, -0.29, z + 0.01])) for z in (0.29, 0.07, -0.21)]
    vertices = np.concatenate([v for v, _ in boxes])
    faces = np.concatenate([f + 8 * k for k, (_, f) in enumerate(boxes)])
    half = np.array([0.3, 0.29, 0.36])
    handles = handles_of_mesh(sampled(vertices, faces, 6000, 0), np.eye(3), -half, half)
    np.testing.assert_allclose(sorted(h.centre[1] for h in handles), [-0.21, 0.07, 0.29], atol=0.004)
