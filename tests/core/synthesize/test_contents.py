"""Things in drawers: on the tray's floor, clear of its sides, children of the drawer."""

from dataclasses import replace

import numpy as np
import pytest

from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.carrier import Carrier
from r2c2r_core.model.inputs import ObjectOverride, Overrides
from r2c2r_core.model.rectangle import Rectangle3
from r2c2r_core.model.scene import ArticulatedScene, SceneObject
from r2c2r_core.synthesize.stage import SynthesizeConfig, build_scene
from tests.core.motions import motion
from tests.core.synthesize.kitchen_units import Handle, Unit, capture, placed_unit
from tests.core.synthesize.mujoco_oracle import compile_scene, deepest_contact

FRONT = Rectangle3(world_from_front=Rigid3(translation=np.array([1.2, -0.29, 0.5])), width_m=0.59, height_m=0.298)
DRAWER = Unit("drawer_1", "drawer", (1.2, 0, 0.5), (0.59, 0.58, 0.298), handle=Handle(0, 0.02, vertical=False))
BELOW = Unit("drawer_2", "drawer", (1.2, 0, 0.2), (0.59, 0.58, 0.298), handle=Handle(0, 0.02, vertical=False))


def built(*units: Unit, carried: str, said: Overrides | None = None) -> ArticulatedScene:
    """A scene in which the thing of that name was filmed in a drawer that was pulled out."""
    rng = np.random.default_rng(0)
    found = [placed_unit(unit, rng) for unit in units]
    tracks = [track for track, _, _ in found]
    for k, track in enumerate(tracks):
        if track.name == carried:
            assert track.box is not None
            tracks[k] = replace(track, box=replace(track.box, carrier=Carrier(front=FRONT, motion=motion({0: 0.3}))))
    placements, assets = [placement for _, placement, _ in found], [asset for _, _, asset in found]
    return build_scene(capture(), tracks, placements, assets, said or Overrides(objects={}), SynthesizeConfig())


def the(scene: ArticulatedScene, name: str) -> SceneObject:
    return next(item for item in scene.objects if item.name == name)


@pytest.mark.parametrize(("x", "z"), [(1.2, 0.45), (0.96, 0.43), (1.2, 0.5)])
def test_a_thing_lies_on_the_floor_of_its_drawer_clear_of_its_sides(x: float, z: float) -> None:
    """Measured in place, 35 mm into the tray's left side, or above its floor."""
    scene = built(DRAWER, BELOW, Unit("mug", "mug", (x, -0.1, z), (0.08, 0.08, 0.1), kind="thing"), carried="mug")
    mug = the(scene, "mug")
    assert (mug.carried_by, mug.movable) == ("drawer_1_drawer", True)
    floor = next(box for link in the(scene, "drawer_1").links for box in link.boxes if box.name == "tray_floor")
    top = the(scene, "drawer_1").world_from_object.translation[2] + floor.link_from_box.translation[2] + floor.size_m[2] / 2
    assert mug.world_from_object.translation[2] - 0.05 == pytest.approx(top + 0.0005, abs=1e-4)
    assert mug.world_from_object.translation[1] == pytest.approx(-0.1, abs=0.005)
    assert deepest_contact(compile_scene(scene)) == 0.0


def test_a_thing_whose_drawer_is_no_object_is_left_out() -> None:
    """The drawer above it is not the one that it lies in."""
    scene = built(DRAWER, Unit("mug", "mug", (1.2, -0.1, 0.2), (0.08, 0.08, 0.1), kind="thing"), carried="mug")
    assert "mug" not in {item.name for item in scene.objects}
    assert "click that drawer's front" in scene.failures["mug"]


def test_a_thing_that_a_person_placed_stays_there() -> None:
    pose = np.eye(4)
    pose[:3, 3] = [1.2, -0.6, 0.6]  # in the open drawer, before its unit
    said = Overrides(objects={"mug": ObjectOverride(pose=pose)})
    scene = built(DRAWER, Unit("mug", "mug", (1.2, -0.1, 0.45), (0.08, 0.08, 0.1), kind="thing"), carried="mug", said=said)
    mug = the(scene, "mug")
    np.testing.assert_allclose(mug.world_from_object.matrix, pose, atol=1e-9)
    assert mug.carried_by is None


def test_a_thing_on_a_shelf_behind_a_door_stays_in_its_unit() -> None:
    cabinet = Unit("wall", "wall_cabinet", (0, 0.1, 1.7), (0.6, 0.35, 0.7), handle=Handle(0.24, -0.2))
    scene = built(cabinet, Unit("mug", "mug", (0.1, 0.12, 1.5), (0.08, 0.08, 0.1), kind="thing"), carried="")
    np.testing.assert_allclose(the(scene, "mug").world_from_object.translation, [0.1, 0.12, 1.5], atol=0.002)
    np.testing.assert_allclose(the(scene, "wall").world_from_object.translation, [0, 0.1, 1.7], atol=0.002)
    assert not scene.failures
