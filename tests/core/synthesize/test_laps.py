"""Leaves that slide sideways past each other: two clicks, one unit."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from r2c2r_core.geometry.boxes import Boxes, box_penetration
from r2c2r_core.model.inputs import ObjectOverride, Overrides
from r2c2r_core.model.scene import ArticulatedScene, SceneObject
from r2c2r_core.synthesize.clearance import link_boxes
from tests.core.synthesize.kitchen_units import Handle, Unit
from tests.core.synthesize.mujoco_oracle import compile_scene, deepest_contact, reached
from tests.core.synthesize.test_build_scene import built, the

WIDTH_M, OVERLAP_M, TRACK_M = 0.6, 0.035, 0.026
FRONT = Unit("front", "sliding_door", (0, 0, 0.5), (WIDTH_M, 0.58, 0.74), handle=Handle(-0.24, 0.1, out=0.02))


def rear(track_m: float = TRACK_M, **more: object) -> Unit:
    """The rear leaf: the camera sees the part not covered by the front one."""
    seen = WIDTH_M - OVERLAP_M
    return Unit("rear", "sliding_door", ((WIDTH_M + seen) / 2, track_m / 2, 0.5), (seen, 0.58 - track_m, 0.74), **more)  # type: ignore[arg-type]


REAR = rear(handle=Handle(0.22, 0.1, out=0.035))
BESIDE = [
    Unit("left", "cabinet", (-0.603, 0, 0.5), (0.6, 0.58, 0.74), handle=Handle(0.24, 0.2)),
    Unit("right", "drawer", (1.168, 0, 0.5), (0.6, 0.58, 0.74), handle=Handle(0, 0, vertical=False)),
]


@pytest.fixture(scope="module")
def scene() -> ArticulatedScene:
    return built(FRONT, REAR, *BESIDE)


def door(scene: ArticulatedScene, name: str) -> SceneObject:
    item = the(scene, name)
    assert [joint.type for joint in item.joints] == ["prismatic"]
    return item


def face_y(item: SceneObject) -> float:
    return float(item.world_from_object.apply(np.array([[0.0, -item.dimensions_m[1] / 2, 0.0]]))[0, 1])


def test_each_leaf_slides_until_it_covers_the_other(scene: ArticulatedScene) -> None:
    for name, towards in (("front", 1.0), ("rear", -1.0)):
        (joint,) = door(scene, name).joints
        np.testing.assert_allclose(joint.axis_object, [towards, 0.0, 0.0])
        assert joint.upper == pytest.approx(WIDTH_M - OVERLAP_M, abs=0.004)
        assert joint.sources["axis"] == "inferred"
        assert joint.sources["limits"] == "default"  # no obstacle in its way


def test_the_hidden_edge_makes_both_leaves_equally_wide(scene: ArticulatedScene) -> None:
    item = door(scene, "rear")
    assert item.dimensions_m[0] == pytest.approx(WIDTH_M, abs=0.003)
    assert item.dimension_sources[0] == "inferred"
    assert door(scene, "front").dimension_sources[0] == "measured"
    left = item.world_from_object.translation[0] - item.dimensions_m[0] / 2
    assert left == pytest.approx(WIDTH_M / 2 - OVERLAP_M, abs=0.003)


def test_the_layout_keeps_the_track_distance_of_sliding_leaves(scene: ArticulatedScene) -> None:
    assert face_y(door(scene, "rear")) - face_y(door(scene, "front")) == pytest.approx(TRACK_M, abs=0.002)


@pytest.mark.parametrize("track_m", [0.010, 0.014, 0.04])
def test_closely_spaced_tracks_are_kept_separate(track_m: float) -> None:
    scene = built(FRONT, rear(track_m), *BESIDE)
    assert face_y(the(scene, "rear")) - face_y(the(scene, "front")) == pytest.approx(track_m, abs=0.002)
    assert min(joint.upper for joint in (*the(scene, "rear").joints, *the(scene, "front").joints)) > 0.5
    assert deepest_contact(compile_scene(scene)) < 1e-6


def test_leaves_pass_each_other_without_contact(scene: ArticulatedScene) -> None:
    model = compile_scene(scene)
    (first,), (second,) = (door(scene, name).joints for name in ("front", "rear"))
    for a, b in product(np.linspace(0, 1, 9), repeat=2):
        at = {first.name: float(a) * first.upper, second.name: float(b) * second.upper}
        assert deepest_contact(model, at) < 1e-6, at
    shares = reached(scene, model, seconds=3.0)
    assert min(shares.values()) >= 0.98, shares


def test_two_leaves_of_one_unit_are_aligned_in_height() -> None:
    scene = built(FRONT, replace(REAR, centre=(REAR.centre[0], REAR.centre[1], 0.506)))
    tops = [item.world_from_object.translation[2] + item.dimensions_m[2] / 2 for item in scene.objects[:2]]
    assert tops[0] == pytest.approx(tops[1], abs=1e-4)


def test_a_rear_leaf_cut_to_its_panel_is_extended_to_full_size() -> None:
    """The cut leaves out the stile of 6 cm and the upper rail of 8 cm; the front leaf has both."""
    x, y, z = REAR.centre
    width, depth, height = REAR.size
    low = replace(REAR, centre=(x + 0.03, y, z - 0.04), size=(width - 0.06, depth, height - 0.08))
    scene = built(FRONT, low)
    item = door(scene, "rear")
    assert item.dimensions_m[2] == pytest.approx(height, abs=0.004)
    assert item.world_from_object.translation[2] == pytest.approx(z, abs=0.003)
    assert item.dimension_sources[2] == "inferred"
    assert item.dimensions_m[0] == pytest.approx(WIDTH_M, abs=0.004)
    grip = next(box for box in item.links[1].boxes if box.role == "handle")
    at = item.world_from_object.apply(grip.link_from_box.translation)
    assert at[[0, 2]] == pytest.approx([x + 0.03 + 0.22, z - 0.04 + 0.1], abs=0.004)  # where it was observed
    assert min(joint.upper for each in scene.objects[:2] for joint in each.joints) > 0.5


def test_a_front_leaf_cut_too_wide_widens_the_rear_leaf_by_at_most_5_cm() -> None:
    """The cut includes 7 cm of the adjacent unit at the free edge; two leaves never overlap by 11 cm."""
    x, y, z = FRONT.centre
    wide = replace(FRONT, centre=(x - 0.035, y, z), size=(WIDTH_M + 0.07, *FRONT.size[1:]))
    scene = built(wide, REAR)
    assert door(scene, "rear").dimensions_m[0] == pytest.approx(WIDTH_M - OVERLAP_M + 0.05, abs=0.004)


def test_bodies_of_the_two_leaves_do_not_overlap(scene: ArticulatedScene) -> None:
    (ours, theirs) = (link_boxes(item, item.links[0]) for item in (door(scene, "front"), door(scene, "rear")))
    repeated = Boxes(*(np.repeat(part, len(theirs.centres), axis=0) for part in ours))
    tiled = Boxes(*(np.concatenate([part] * len(ours.centres)) for part in theirs))
    assert box_penetration(repeated, tiled).max() < -0.001


@pytest.mark.parametrize(("handle", "towards"), [(Handle(-0.24, 0.1), 1.0), (Handle(0.24, 0.1), -1.0)])
def test_a_single_leaf_slides_away_from_its_pull(handle: Handle, towards: float) -> None:
    item = built(replace(FRONT, handle=handle)).objects[0]
    np.testing.assert_allclose(item.joints[0].axis_object, [towards, 0.0, 0.0])
    assert item.joints[0].upper == pytest.approx(WIDTH_M)


def test_a_single_leaf_without_a_pull_slides_by_default_with_a_warning() -> None:
    item = built(replace(FRONT, handle=None)).objects[0]
    assert item.joints[0].sources["axis"] == "default"
    assert "slides to the right by default: nothing in the scan tells the side" in item.warnings


def test_a_person_overrides_the_sliding_direction() -> None:
    scene = built(FRONT, overrides=Overrides(objects={"front": ObjectOverride(hinge="left")}))
    np.testing.assert_allclose(scene.objects[0].joints[0].axis_object, [-1.0, 0.0, 0.0])
    assert scene.objects[0].joints[0].sources["axis"] == "person"


def test_a_rear_leaf_drawn_with_its_hidden_edge_keeps_its_width() -> None:
    x, y, z = REAR.centre
    width, depth, height = REAR.size
    scene = built(FRONT, replace(REAR, centre=(x - 0.02, y, z), size=(width + 0.04, depth, height - 0.03), handle=None))
    item = door(scene, "rear")
    assert item.dimensions_m[0] == pytest.approx(width + 0.04, abs=1e-3)
    assert item.dimension_sources[0] == "measured"


def test_a_leaf_size_set_by_a_person_is_kept() -> None:
    given = (0.58, 0.55, 0.74)
    scene = built(FRONT, REAR, overrides=Overrides(objects={"rear": ObjectOverride(dimensions_m=np.array(given))}))
    np.testing.assert_allclose(the(scene, "rear").dimensions_m, given)


def test_the_middle_of_three_leaves_slides_away_from_its_pull() -> None:
    """Front, rear, front: each outer leaf slides inwards, and the rear leaf is as wide as they are."""
    step = WIDTH_M - OVERLAP_M
    seen = WIDTH_M - 2 * OVERLAP_M
    units = [
        replace(FRONT, name="a"),
        Unit("b", "sliding_door", (step, TRACK_M / 2, 0.5), (seen, 0.554, 0.74), handle=Handle(0.2, 0.1)),
        replace(FRONT, name="c", centre=(2 * step, 0, 0.5), handle=None),
    ]
    scene = built(*units)
    towards = [float(the(scene, name).joints[0].axis_object[0]) for name in "abc"]
    assert towards == [1.0, -1.0, -1.0]
    assert the(scene, "b").dimensions_m[0] == pytest.approx(WIDTH_M, abs=0.004)
    assert deepest_contact(compile_scene(scene)) < 1e-6
