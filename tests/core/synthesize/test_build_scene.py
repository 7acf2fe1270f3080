from dataclasses import replace
from typing import Any

import mujoco
import numpy as np
import pytest

from r2c2r_core.errors import StageError
from r2c2r_core.geometry.transforms import Rigid3, rotation_about
from r2c2r_core.kitchen.categories import CATEGORIES
from r2c2r_core.model.capture import Capture, Wall
from r2c2r_core.model.inputs import JointLimits, ObjectOverride, Overrides
from r2c2r_core.model.materials import HEAVY_DOOR_FEEL, SLIDE_FEEL
from r2c2r_core.model.motion import Inside
from r2c2r_core.model.scene import ArticulatedScene, SceneObject
from r2c2r_core.model.track import MaskTrack
from r2c2r_core.synthesize import stage
from r2c2r_core.synthesize.stage import SynthesizeConfig, build_scene
from tests.core.motions import motion
from tests.core.synthesize.kitchen_units import Handle, Unit, capture, placed_unit
from tests.core.synthesize.mujoco_oracle import compile_scene, deepest_contact, reached, sweep

KITCHEN = [
    Unit("cab_l", "cabinet", (0, 0, 0.5), (0.6, 0.58, 0.7), handle=Handle(0.24, 0.2)),
    Unit("cab_r", "cabinet", (0.602, 0.004, 0.5), (0.6, 0.58, 0.7), handle=Handle(-0.24, 0.2)),
    Unit("drawer_1", "drawer", (1.2, 0, 0.75), (0.59, 0.58, 0.2), handle=Handle(0, 0, vertical=False)),
    Unit("drawer_2", "drawer", (1.2, -0.005, 0.5), (0.59, 0.58, 0.298), handle=Handle(0, 0.02, vertical=False)),
    Unit("pair", "double-door cabinet", (2.0, 0, 0.5), (0.8, 0.58, 0.7)),
    Unit("wall", "wall_cabinet", (0, 0.1, 1.7), (0.6, 0.35, 0.7), handle=Handle(0.24, -0.2)),
    Unit("fridge", "fridge", (-0.85, -0.03, 0.9), (0.6, 0.7, 1.8), handle=Handle(-0.24, 0.2, length=0.4), kind="appliance"),
    Unit("dish", "dishwasher", (2.75, 0, 0.5), (0.6, 0.58, 0.78), handle=Handle(0, 0.3, length=0.4, vertical=False)),
    Unit("oven", "range", (3.4, 0, 0.5), (0.6, 0.58, 0.72), handle=Handle(0, 0.22, length=0.4, vertical=False)),
    Unit("micro", "microwave", (1.2, 0.05, 1.08), (0.5, 0.36, 0.28), yaw=0.05, handle=Handle(0.14, 0), kind="appliance"),
    Unit("top", "counter", (1.7, -0.01, 0.915), (4.1, 0.62, 0.04), kind="thing"),
    Unit("bottle", "bottle", (0.3, 0, 1.058), (0.08, 0.08, 0.24), kind="thing"),
]


def built(*units: Unit, overrides: Overrides | None = None, walls: tuple[Wall, ...] = ()) -> ArticulatedScene:
    rng = np.random.default_rng(0)
    tracks, placements, assets = zip(*[placed_unit(u, rng) for u in units], strict=True)
    return build_scene(capture(walls), tracks, placements, assets, overrides or Overrides(objects={}), SynthesizeConfig())


@pytest.fixture(scope="module")
def kitchen() -> ArticulatedScene:
    return built(*KITCHEN)


def the(scene: ArticulatedScene, name: str) -> SceneObject:
    return next(o for o in scene.objects if o.name == name)


def test_an_object_whose_measurement_fails_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    measure = stage.measure_object

    def measured(capture: Capture, track: MaskTrack, *further: Any, **settings: Any) -> Any:
        if track.name in ("cab_r", "bottle"):
            raise np.linalg.LinAlgError("SVD did not converge")
        return measure(capture, track, *further, **settings)

    monkeypatch.setattr(stage, "measure_object", measured)
    units = [unit for unit in KITCHEN if unit.name in ("cab_l", "cab_r", "bottle", "micro")]
    scene = built(*units)
    assert {item.name for item in scene.objects} - {"plinth_1"} == {"cab_l", "micro"}  # the plinth has no clicks
    assert set(scene.failures) == {"cab_r", "bottle"}
    assert scene.failures["cab_r"].startswith("synthesize: cab_r: LinAlgError: SVD did not converge")
    with pytest.raises(StageError, match="no object could be measured"):
        built(*[unit for unit in units if unit.name == "bottle"])


def test_an_object_whose_construction_fails_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    find = stage.fixture_of

    def found(spec: Any) -> Any:
        if spec.name == "microwave":
            raise IndexError("index 0 is out of bounds")
        return find(spec)

    def flat(*_: Any, **__: Any) -> Any:
        raise RuntimeError("QH6154 initial simplex is flat")

    monkeypatch.setattr(stage, "fixture_of", found)
    monkeypatch.setattr(stage, "convex_pieces", flat)
    units = [unit for unit in KITCHEN if unit.name in ("cab_l", "cab_r", "bottle", "micro")]
    scene = built(*units)
    assert {item.name for item in scene.objects} - {"plinth_1"} == {"cab_l", "cab_r"}
    assert scene.failures["micro"].startswith("synthesize: micro: IndexError: index 0 is out of bounds")
    assert scene.failures["bottle"].startswith("synthesize: bottle: RuntimeError: QH6154")
    with pytest.raises(StageError, match="no object could be built"):
        built(*[unit for unit in units if unit.name == "bottle"])


def test_the_kitchen_has_no_contacts_at_rest(kitchen: ArticulatedScene) -> None:
    assert deepest_contact(compile_scene(kitchen)) < 5e-4


def test_free_joint_sweeps_have_no_penetration(kitchen: ArticulatedScene) -> None:
    depths = sweep(kitchen, compile_scene(kitchen))
    assert len(depths) == 11
    assert max(depths.values()) < 1e-3


def test_every_joint_opens_under_the_force_of_a_hand(kitchen: ArticulatedScene) -> None:
    shares = reached(kitchen, compile_scene(kitchen))
    assert min(shares.values()) >= 0.98, shares


def test_every_inertia_is_physical(kitchen: ArticulatedScene) -> None:
    for item in kitchen.objects:
        for link in item.links:
            moments = np.linalg.eigvalsh(link.inertial.inertia)
            assert moments[0] > 0
            assert moments[0] + moments[1] >= moments[2] * (1 - 1e-9)
            com = link.object_from_link.apply(link.inertial.com_link)
            assert (np.abs(com) <= item.dimensions_m / 2 + 0.06).all()
            assert 0.01 <= link.inertial.mass_kg < 120


def test_masses_are_in_the_range_of_real_furniture(kitchen: ArticulatedScene) -> None:
    fridge = sum(link.inertial.mass_kg for link in the(kitchen, "fridge").links)
    assert 45 < fridge < 100
    assert 3 < the(kitchen, "cab_l").links[1].inertial.mass_kg < 8


def test_joint_types_follow_the_category(kitchen: ArticulatedScene) -> None:
    types = {o.name: {j.type for j in o.joints} for o in kitchen.objects}
    assert types["drawer_1"] == {"prismatic"}
    assert types["pair"] == types["micro"] == types["dish"] == {"revolute"}
    assert types["top"] == types["bottle"] == set()


def test_positive_joint_values_open_outwards(kitchen: ArticulatedScene) -> None:
    """The middle of each moving part moves towards -y of the object when its joint value increases."""
    for item in kitchen.objects:
        for joint in item.joints:
            link = next(k for k in item.links if k.name == joint.child)
            middle = link.object_from_link.apply(link.boxes[0].link_from_box.translation)
            arm = middle - joint.origin_object
            velocity = joint.axis_object if joint.type == "prismatic" else np.cross(joint.axis_object, arm)
            assert velocity[1] < 0, joint.name


def test_a_side_hinged_axis_is_the_outer_vertical_edge_of_the_front(kitchen: ArticulatedScene) -> None:
    item = the(kitchen, "cab_l")
    half = item.dimensions_m / 2
    np.testing.assert_allclose(item.joints[0].origin_object[:2], [-half[0], -half[1]], atol=1e-9)
    np.testing.assert_allclose(item.links[1].object_from_link.translation, item.joints[0].origin_object)


def test_a_drawer_has_a_floor_and_sides(kitchen: ArticulatedScene) -> None:
    assert sum(box.name.startswith("tray") for box in the(kitchen, "drawer_1").links[1].boxes) == 4


def test_a_handle_is_at_least_8_mm_thick(kitchen: ArticulatedScene) -> None:
    grip = next(box for box in the(kitchen, "cab_l").links[1].boxes if box.name == "handle")
    assert grip.size_m.min() >= 0.008
    assert grip.size_m.max() == pytest.approx(0.16)


def test_limits_and_hinge_set_by_a_person_are_kept() -> None:
    asked = Overrides(objects={"cab_l": ObjectOverride(joint_upper=1.0, hinge="right")})
    joint = built(KITCHEN[0], overrides=asked).objects[0].joints[0]
    assert joint.upper == 1.0
    assert joint.axis_object[2] == 1.0
    assert (joint.sources["limits"], joint.sources["axis"]) == ("person", "person")


def test_limits_apply_to_the_named_joint_and_unknown_names_are_reported() -> None:
    pair = next(unit for unit in KITCHEN if unit.name == "pair")
    asked = {"left_door": JointLimits(None, 1.0), "pair_right_door_joint": JointLimits(0.1, None), "lid": JointLimits(0.0, 1.0)}
    item = built(pair, overrides=Overrides(objects={"pair": ObjectOverride(joints=asked)})).objects[0]
    usual = {joint.name: joint.upper for joint in built(pair).objects[0].joints}
    left, right = sorted(item.joints, key=lambda joint: joint.name)
    assert (left.lower, left.upper, left.sources["limits"]) == (0.0, 1.0, "person")
    assert "lower" not in left.sources  # closed at 0 by definition: no default to check
    assert (right.lower, right.sources["lower"]) == (0.1, "person")
    assert (right.lower, right.upper, right.sources["limits"]) == (0.1, usual[right.name], "default")
    assert any("corrections of a joint lid were not used: its joints are left_door, right_door" in w for w in item.warnings)


def test_unnamed_limits_are_ignored_with_several_joints() -> None:
    pair = next(unit for unit in KITCHEN if unit.name == "pair")
    item = built(pair, overrides=Overrides(objects={"pair": ObjectOverride(joint_lower=0.0, joint_upper=0.3)})).objects[0]
    assert all(joint.upper > 0.3 and joint.sources["limits"] != "person" for joint in item.joints)
    assert any("joint_limits is for an object of one joint and was not used" in w for w in item.warnings)


def test_a_lower_limit_set_by_a_person_keeps_the_filmed_upper_limit() -> None:
    track, placement, asset = placed_unit(Unit("a", "drawer", (0, 0, 0.5), (0.5, 0.58, 0.3)), np.random.default_rng(0))
    track = replace(track, motions=(motion({5: 0.56}),))
    asked = Overrides(objects={"a": ObjectOverride(joint_lower=0.05)})
    joint = build_scene(capture(), [track], [placement], [asset], asked, SynthesizeConfig()).objects[0].joints[0]
    assert (joint.lower, joint.sources["lower"], joint.sources["limits"]) == (0.05, "person", "at_least")
    assert joint.upper == pytest.approx(0.56, abs=1e-6)


def test_a_wall_beside_the_hinge_limits_the_door() -> None:
    wall = Wall(normal=np.array([1.0, 0.0, 0.0]), offset_m=-0.31, area_m2=6.0)
    scene = built(KITCHEN[0], walls=(wall,))
    joint = scene.objects[0].joints[0]
    assert np.deg2rad(75) < joint.upper < np.deg2rad(100)
    assert joint.sources["limits"] == "inferred"
    assert any("a wall blocks it" in w for w in scene.objects[0].warnings)


@pytest.mark.parametrize(("seen_m", "source"), [(0.12, "default"), (0.56, "at_least"), (0.9, "default"), (None, "default")])
def test_drawer_travel_is_at_least_the_filmed_opening(seen_m: float | None, source: str) -> None:
    """Where it is larger than the category's; travel beyond the unit's depth is ignored."""
    track, placement, asset = placed_unit(Unit("a", "drawer", (0, 0, 0.5), (0.5, 0.58, 0.3)), np.random.default_rng(0))
    if seen_m is not None:
        track = replace(track, motions=(motion({4: 0.05, 5: seen_m}),))
    scene = build_scene(capture(), [track], [placement], [asset], Overrides(objects={}), SynthesizeConfig())
    joint = scene.objects[0].joints[0]
    assert joint.sources["limits"] == source
    if source != "default":
        assert joint.upper == pytest.approx(seen_m, abs=1e-6)
    assert any("seen open" in w for w in scene.objects[0].warnings) == (source == "at_least")
    assert (joint.motion is not None) == (seen_m is not None)


def test_the_drawer_of_a_refrigerator_slides_like_a_drawer_and_its_doors_turn_like_heavy_doors() -> None:
    """Damping of a hinge is in N m s/rad, of a slide in N s/m: with a heavy door's value the drawer would coast."""
    unit = Unit("a", "fridge", (0, 0, 0.9), (0.6, 0.7, 1.8), kind="appliance")
    track, placement, asset = placed_unit(unit, np.random.default_rng(0))
    assert track.front is not None
    below = Rigid3(track.front.world_from_front.rotation, track.front.world_from_front.apply(np.array([0.0, 0.0, -0.6])))
    track = replace(track, motions=(motion({4: 0.3}, world_from_front=below, part="drawer"),))
    item = build_scene(capture(), [track], [placement], [asset], Overrides(objects={}), SynthesizeConfig()).objects[0]
    feels = {"revolute": HEAVY_DOOR_FEEL, "prismatic": SLIDE_FEEL}
    assert {joint.type for joint in item.joints} == feels.keys()
    for joint in item.joints:
        feel = feels[joint.type]
        assert joint.damping == feel.damping
        assert (joint.effort, joint.velocity) == (feel.effort, feel.velocity)


@pytest.mark.parametrize(
    ("way", "angle_deg", "source"),
    [("right", 55.0, "default"), ("right", 118.0, "at_least"), ("top", 55.0, "default"), ("bottom", 118.0, "at_least")],
)
def test_hinge_and_limit_come_from_the_filmed_opening_of_a_door(way: str, angle_deg: float, source: str) -> None:
    """Independently of its handle."""
    unit = Unit("a", "cabinet", (0, 0, 0.5), (0.5, 0.58, 0.7), handle=Handle(0.2, 0.2))
    track, placement, asset = placed_unit(unit, np.random.default_rng(0))
    assert track.front is not None
    angle = np.deg2rad(angle_deg)
    seen = motion({4: 0.5, 5: angle}, way, world_from_front=track.front.world_from_front)
    track = replace(track, motions=(seen,))
    item = build_scene(capture(), [track], [placement], [asset], Overrides(objects={}), SynthesizeConfig()).objects[0]
    joint = item.joints[0]
    axes = {"right": [0, 0, 1], "top": [-1, 0, 0], "bottom": [1, 0, 0]}
    np.testing.assert_allclose(joint.axis_object, axes[way], atol=0.01)
    assert (joint.sources["axis"], joint.sources["limits"]) == ("measured", source)
    assert joint.upper == pytest.approx(max(angle, np.deg2rad(110)), abs=0.02)
    assert any("seen open" in w for w in item.warnings) == (source == "at_least")


@pytest.mark.parametrize(("way", "opens_by_itself"), [("top", True), ("bottom", False), ("right", False)])
def test_friction_keeps_doors_closed_against_gravity(way: str, opens_by_itself: bool) -> None:
    """A leaf hinged at its upper outer edge has its centre of mass behind the hinge."""
    unit = Unit("a", "cabinet", (0, 0, 0.5), (0.5, 0.58, 0.7))
    track, placement, asset = placed_unit(unit, np.random.default_rng(0))
    assert track.front is not None
    track = replace(track, motions=(motion({5: 1.0}, way, world_from_front=track.front.world_from_front),))
    scene = build_scene(capture(), [track], [placement], [asset], Overrides(objects={}), SynthesizeConfig())
    model = compile_scene(scene)
    state = mujoco.MjData(model)
    mujoco.mj_forward(model, state)
    pull = -float(state.qfrc_bias[0])  # effect of gravity on the closed joint
    assert (pull > 0.1) == opens_by_itself
    assert model.dof_frictionloss[0] > max(pull, 0.0)


def turning_about(inwards_m: float, behind_m: float, tilt_rad: float = 0.0) -> ArticulatedScene:
    """A cabinet whose door was filmed turning about a line inside and behind its left edge."""
    unit = Unit("a", "cabinet", (0, 0, 0.5), (0.5, 0.58, 0.7))
    track, placement, asset = placed_unit(unit, np.random.default_rng(0))
    assert track.front is not None
    place = track.front.world_from_front
    turned = place.rotation @ rotation_about(np.array([0.0, 1.0, 0.0]), tilt_rad)
    inside = Rigid3(turned, place.apply(np.array([inwards_m, behind_m, 0.0])))
    track = replace(track, motions=(motion({5: 1.0}, "left", world_from_front=inside),))
    return build_scene(capture(), [track], [placement], [asset], Overrides(objects={}), SynthesizeConfig())


def hinge_of(item: SceneObject) -> np.ndarray:
    """Distances of the hinge inside and behind the outer edge, in metres."""
    return np.asarray(item.joints[0].origin_object[:2] + item.dimensions_m[:2] / 2)


def test_a_hinge_filmed_far_from_the_edge_keeps_its_filmed_position() -> None:
    """Within the uncertainty of both, the edge is used, so that doors clear their neighbours."""
    near, far = (hinge_of(turning_about(off, 0.0).objects[0])[0] for off in (-0.003, -0.03))
    assert (near, far) == pytest.approx((0.0, -0.03), abs=0.003)


def test_a_hinge_filmed_near_the_edge_is_placed_so_that_the_leaf_clears() -> None:
    """Concealed hinges turn inside the edge; a rigid leaf about a line behind its face would swing into its neighbour."""
    item = turning_about(0.008, 0.008).objects[0]
    inwards, behind = hinge_of(item)
    assert 0.005 < inwards < 0.008
    assert 0.002 < behind < 0.008
    assert np.hypot(inwards, behind) - inwards < 0.0011
    assert not any("its hinge" in line for line in item.warnings)


@pytest.mark.parametrize(("inwards_m", "behind_m", "tilt_rad"), [(0.019, 0.019, 0.009), (0.03, 0.0, 0.0), (0.035, -0.01, 0.0)])
def test_a_hinge_filmed_where_its_door_could_not_turn_is_moved_and_reported(
    inwards_m: float, behind_m: float, tilt_rad: float
) -> None:
    """The strip outside the hinge would swing into the carcass behind it."""
    scene = turning_about(inwards_m, behind_m, tilt_rad)
    item = scene.objects[0]
    model = compile_scene(scene)
    assert max(sweep(scene, model).values()) < 5e-4
    assert min(reached(scene, model).values()) > 0.98
    assert any("its hinge was filmed" in line for line in item.warnings)


def test_a_leaf_is_thinned_so_that_it_swings_clear_of_its_carcass() -> None:
    """The rear edge of an 18 mm leaf that turns about a line 12 mm inside its edge would swing 3 mm into the carcass."""
    scene = turning_about(0.012, 0.002)
    assert hinge_of(scene.objects[0])[0] > 0.008
    model = compile_scene(scene)
    assert max(sweep(scene, model).values()) < 5e-4
    assert min(reached(scene, model).values()) > 0.98


def test_inner_depth_and_shelves_observed_behind_a_front_are_built() -> None:
    """Unobserved values are the category's defaults and are marked as such."""
    made = {}
    for category, way, inside in (
        ("cabinet", "left", Inside(depth_m=0.45, shelves_m=(0.2, 0.41))),
        ("cabinet", "left", Inside(shelves_m=(0.2,))),
        ("cabinet", "left", None),
        ("drawer", "out", Inside(depth_m=0.4)),
    ):
        track, placement, asset = placed_unit(Unit("a", category, (0, 0, 0.5), (0.5, 0.58, 0.7)), np.random.default_rng(0))
        assert track.front is not None
        seen = replace(motion({5: 0.4}, way, world_from_front=track.front.world_from_front), inside=inside)
        scene = build_scene(
            capture(), [replace(track, motions=(seen,))], [placement], [asset], Overrides(objects={}), SynthesizeConfig()
        )
        made[inside if way == "left" else "drawer"] = scene.objects[0]
    both, shelf, none, drawer = made.values()
    assert [item.inside_sources for item in made.values()] == [
        {"depth": "measured", "shelves": "measured"},
        {"depth": "default", "shelves": "measured"},
        {"depth": "default", "shelves": "default"},
        {"depth": "measured", "shelves": "default"},
    ]
    assert _clear_depth(both, "front", "back") == pytest.approx(0.45, abs=1e-6)
    assert _clear_depth(shelf, "front", "back") == pytest.approx(_clear_depth(none, "front", "back"), abs=1e-6)
    assert _clear_depth(drawer, "front", "tray_back") == pytest.approx(0.4, abs=1e-6)
    floor = _span(both, "bottom", 2)[1]
    uppers = [_span(both, name, 2)[1] - floor for name in ("shelf_0", "shelf_1")]
    np.testing.assert_allclose(uppers, [0.2, 0.41], atol=1e-6)
    assert {box.role for box in both.links[0].boxes if box.name.startswith("shelf")} == {"inner"}


def _clear_depth(item: SceneObject, front: str, rear: str) -> float:
    return float(_span(item, rear, 1)[0] - _span(item, front, 1)[1])


def _span(item: SceneObject, board: str, axis: int) -> tuple[float, float]:
    """Extent of a board along an axis of the object."""
    link, box = next((link, box) for link in item.links for box in link.boxes if box.name == board)
    middle = (link.object_from_link @ box.link_from_box).translation[axis]
    return middle - box.size_m[axis] / 2, middle + box.size_m[axis] / 2


@pytest.mark.parametrize(
    ("category", "way", "fixture"),
    [
        ("drawer", "left", "cabinet"),
        ("cabinet", "out", "drawer"),
        ("cabinet", "slides_left", "sliding_door"),
        ("oven", "left", "oven"),
    ],
)
def test_the_fixture_follows_the_filmed_motion(category: str, way: str, fixture: str) -> None:
    track, placement, asset = placed_unit(Unit("a", category, (0, 0, 0.5), (0.5, 0.58, 0.4)), np.random.default_rng(0))
    assert track.front is not None
    track = replace(track, motions=(motion({5: 0.3}, way, world_from_front=track.front.world_from_front),))
    item = build_scene(capture(), [track], [placement], [asset], Overrides(objects={}), SynthesizeConfig()).objects[0]
    assert item.fixture == fixture
    assert item.joints[0].motion is track.motions[0]
    assert any(f"called a {category}" in w for w in item.warnings) == (fixture != category)


def test_doors_of_a_pair_have_one_limit_and_their_own_motions() -> None:
    unit = Unit("a", "double-door cabinet", (0, 0, 0.5), (0.8, 0.58, 0.7))
    track, placement, asset = placed_unit(unit, np.random.default_rng(0))
    assert track.front is not None
    place = track.front.world_from_front
    half = Rigid3(place.rotation, place.apply(np.array([0.2, 0.0, 0.0])))
    seen = motion({5: 2.0}, "right", world_from_front=half, size_m=(0.4, 0.7), part="right")
    track = replace(track, motions=(seen,))
    item = build_scene(capture(), [track], [placement], [asset], Overrides(objects={}), SynthesizeConfig()).objects[0]
    left, right = sorted(item.joints, key=lambda joint: joint.name)
    assert (left.motion, right.motion) == (None, seen)
    assert {(joint.upper, joint.sources["limits"]) for joint in item.joints} == {(2.0, "at_least")}


@pytest.mark.parametrize(
    ("category", "width_m", "doors"),
    [("refrigerator", 0.7, {"door"}), ("french_door_refrigerator", 0.9, {"left_door", "right_door"})],
)
def test_a_drawer_filmed_below_refrigerator_doors_is_built(category: str, width_m: float, doors: set[str]) -> None:
    track, placement, asset = placed_unit(
        Unit("a", category, (0, 0, 0.88), (width_m, 0.65, 1.75), kind="appliance"), np.random.default_rng(0)
    )
    assert track.front is not None
    place = track.front.world_from_front
    middle = Rigid3(place.rotation, place.apply(np.array([0.0, 0.0, -0.575])))
    seen = motion({5: 0.3}, "out", world_from_front=middle, size_m=(width_m, 0.6), part="drawer")
    scene = build_scene(
        capture(), [replace(track, motions=(seen,))], [placement], [asset], Overrides(objects={}), SynthesizeConfig()
    )
    item = scene.objects[0]
    moving = {joint.child.removeprefix("a_"): joint for joint in item.joints}
    assert set(moving) == doors | {"drawer"}
    drawer = moving.pop("drawer")
    assert (drawer.type, drawer.motion) == ("prismatic", seen)
    assert all(joint.type == "revolute" and joint.motion is None for joint in moving.values())
    front = next(box for link in item.links if link.name == "a_drawer" for box in link.boxes if box.role == "front")
    assert front.size_m[2] == pytest.approx(0.6, abs=0.01)
    model = compile_scene(scene)
    assert deepest_contact(model) < 5e-4
    assert max(sweep(scene, model).values()) < 5e-4


def test_a_filmed_opening_is_ignored_when_a_person_moves_the_hinge() -> None:
    """A person moved the hinge to the left; the angle in the scan was measured about the right edge."""
    unit = Unit("a", "cabinet", (0, 0, 0.5), (0.5, 0.58, 0.7), handle=Handle(0.2, 0.2))
    track, placement, asset = placed_unit(unit, np.random.default_rng(0))
    track = replace(track, motions=(motion({5: 1.8}, "right"),))
    asked = Overrides(objects={"a": ObjectOverride(hinge="left")})
    joint = build_scene(capture(), [track], [placement], [asset], asked, SynthesizeConfig()).objects[0].joints[0]
    assert joint.axis_object[2] == -1.0
    assert (joint.sources["axis"], joint.sources["limits"]) == ("person", "default")


def test_hinge_confidence_is_higher_with_a_handle_near_the_edge() -> None:
    at_edge, off_centre, without = (
        built(Unit("a", "cabinet", (0, 0, 0.5), (0.6, 0.58, 0.7), handle=handle)).objects[0].joints[0].confidence or 0.0
        for handle in (Handle(0.25, 0.2), Handle(0.09, 0.2), None)
    )
    assert 1.0 > at_edge > off_centre > 0.9 > without == 0.5


def test_a_handle_determines_the_hinge_despite_a_blocking_neighbour() -> None:
    """Without a handle the hinge is on the side that opens; a handle is observed, a neighbour may be measured wrong."""
    block = Unit("block", "open_shelf", (0.25, -0.43, 0.5), (0.06, 0.15, 0.7), kind="thing")
    sides = []
    for handle in (None, Handle(0.24, 0.2)):
        joint = built(Unit("cab", "cabinet", (0, 0, 0.5), (0.6, 0.58, 0.7), handle=handle), block).objects[0].joints[0]
        sides.append("left" if joint.origin_object[0] < 0 else "right")
    assert sides == ["right", "left"]


def test_a_wall_that_barely_touches_the_door_edge_does_not_block_it() -> None:
    """The free edge of a thick door passes 2 mm beyond its closed position, less than the uncertainty of a wall."""
    wall = Wall(normal=np.array([1.0, 0.0, 0.0]), offset_m=-0.3, area_m2=6.0)
    fridge = Unit("f", "fridge", (0, 0, 0.9), (0.6, 0.6, 1.8), handle=Handle(-0.24, 0.2), kind="appliance")
    joint = built(fridge, walls=(wall,)).objects[0].joints[0]
    assert joint.origin_object[0] > 0
    assert joint.upper > np.deg2rad(90)


def test_an_unknown_category_gives_a_rigid_object_with_a_suggestion() -> None:
    scene = built(Unit("m", "Mircowave", (0, 0, 0.05), (0.09, 0.09, 0.1), kind="thing"))
    assert scene.objects[0].category == "Mircowave"
    assert scene.objects[0].fixture == "object"
    assert scene.objects[0].movable
    assert "did you mean microwave" in scene.objects[0].warnings[0]


def test_every_fixture_builds_at_its_default_size() -> None:
    for spec in CATEGORIES:
        if spec.fixture is not None:
            unit = Unit("a", spec.name, (0, 0, 1.2), spec.usual_m, kind="appliance")
            scene = built(unit)
            assert scene.objects[0].fixture == spec.name
            assert deepest_contact(compile_scene(scene)) < 5e-4


def test_building_twice_gives_the_same_scene() -> None:
    first, second = built(*KITCHEN[:4]), built(*KITCHEN[:4])
    for a, b in zip(first.objects, second.objects, strict=True):
        np.testing.assert_array_equal(a.world_from_object.matrix, b.world_from_object.matrix)
        np.testing.assert_array_equal(a.dimensions_m, b.dimensions_m)
