"""Kitchens of several runs: positions and contents of their units, and the camera path around them."""

import numpy as np
import pytest

from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.synthetic.build import build_kitchen
from r2c2r_core.synthetic.choices import LAYOUTS, STYLES, Choice
from r2c2r_core.synthetic.kitchen import Kitchen
from r2c2r_core.synthetic.path import walk
from r2c2r_core.synthetic.styled import plan_styled_kitchen
from r2c2r_core.synthetic.truth import TrueObject, true_objects

CASES = [(layout, style, seed) for layout in LAYOUTS for seed, style in enumerate(STYLES)]


@pytest.fixture(params=CASES, ids=lambda case: "-".join(map(str, case)))
def kitchen(request: pytest.FixtureRequest) -> Kitchen:
    layout, style, seed = request.param
    return plan_styled_kitchen(seed, Choice(style=style, layout=layout))


def corners(thing: TrueObject) -> np.ndarray:
    signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, 8).T
    return thing.kitchen_from_object.apply(signs * thing.dimensions_m / 2)


def solids(kitchen: Kitchen) -> list[tuple[str, np.ndarray, np.ndarray]]:
    """Name, lowest and highest corner of every object's box; runs are at right angles."""
    return [(thing.name, corners(thing).min(axis=0), corners(thing).max(axis=0)) for thing in true_objects(kitchen)]


def test_objects_have_unique_names_and_disjoint_boxes_in_the_room(kitchen: Kitchen) -> None:
    objects = true_objects(kitchen)
    assert tuple(thing.name for thing in objects) == kitchen.object_names
    assert len(set(kitchen.object_names)) == len(objects)
    x_min, x_max, y_min, y_max, ceiling = kitchen.room
    boxes = solids(kitchen)
    for i, (name, low, high) in enumerate(boxes):
        assert (low > [x_min - 1e-6, y_min - 1e-6, -1e-6]).all(), name
        assert (high < [x_max + 1e-6, y_max + 1e-6, ceiling]).all(), name
        for other, other_low, other_high in boxes[i + 1 :]:
            if name.startswith("sliding") and other.startswith("sliding"):
                continue  # one is behind the other: the box of each reaches to the wall
            assert np.maximum(low - other_high, other_low - high).max() > -1e-6, (name, other)


def test_fronts_face_the_room_and_open_into_it(kitchen: Kitchen) -> None:
    for thing in true_objects(kitchen):
        rotation = thing.kitchen_from_object.rotation
        outward, rightward = rotation @ [0.0, -1.0, 0.0], rotation @ [1.0, 0.0, 0.0]
        face = thing.kitchen_from_object.apply(np.array([0.0, -thing.dimensions_m[1] / 2, 0.0]))
        for joint in thing.joints:
            assert joint.upper > 0.15
            if thing.category == "sliding_door":
                assert joint.type == "prismatic"
                assert abs(joint.axis @ rightward) == pytest.approx(1.0)
                continue
            motion = joint.axis if joint.type == "prismatic" else np.cross(joint.axis, face - joint.origin)
            if joint.hinge == "bottom":
                motion = np.cross(joint.axis, [0.0, 0.0, 1.0])
            assert motion @ outward > 0.05, (thing.name, joint)


def test_layouts_have_their_documented_runs_and_units() -> None:
    found = {}
    for layout in LAYOUTS:
        kitchen = plan_styled_kitchen(4, Choice(layout=layout))
        found[layout] = {thing.category for thing in true_objects(kitchen)}
        directions = {round(run.yaw_rad, 3) for run in kitchen.runs}
        assert len(directions) == {"straight": 1, "l": 2, "galley": 2, "island": 2}[layout]
        sinks = [prop.kind for run in kitchen.runs for prop in run.props]
        assert sinks.count("hob") <= 1 or layout == "galley"
    assert {"oven", "microwave", "dishwasher", "hood"} <= found["l"]
    assert {"sliding_door", "open_shelf", "french_door_refrigerator", "dishwasher"} <= found["galley"]
    assert len(plan_styled_kitchen(4, Choice(layout="island")).runs) == 3


def test_a_french_door_fridge_has_two_hinges_and_a_pull_out_drawer() -> None:
    kitchen = plan_styled_kitchen(4, Choice(layout="galley"))
    fridge = next(thing for thing in true_objects(kitchen) if thing.category == "french_door_refrigerator")
    assert [(joint.type, joint.hinge) for joint in fridge.joints] == [
        ("revolute", "left"),
        ("revolute", "right"),
        ("prismatic", None),
    ]
    middle = fridge.kitchen_from_object.translation
    assert [float(np.sign(joint.origin[0] - middle[0])) for joint in fridge.joints[:2]] == [-1.0, 1.0]
    assert np.allclose(fridge.joints[2].axis, [0, -1, 0])


@pytest.mark.parametrize("layout", LAYOUTS)
def test_object_surfaces_match_their_box_in_every_layout(layout: str) -> None:
    kitchen = plan_styled_kitchen(6, Choice(style="shaker", layout=layout))
    objects, patches = true_objects(kitchen), build_kitchen(kitchen)
    for index, thing in enumerate(objects):
        own = [patch for patch in patches if patch.object_id == index + 1 and not patch.is_handle]
        points = thing.kitchen_from_object.inverse.apply(np.concatenate([patch.grid.reshape(-1, 3) for patch in own]))
        if thing.category == "bottle":
            continue
        assert (np.abs(points) < thing.dimensions_m / 2 + 0.004).all(), thing.name
        reach = np.array([points[:, 0].max(), -points[:, 1].min(), points[:, 2].max()])
        assert reach == pytest.approx(thing.dimensions_m / 2, abs=0.004), thing.name


def test_the_camera_path_avoids_obstacles_and_shows_every_front(kitchen: Kitchen) -> None:
    shots = walk(kitchen, 120, np.random.default_rng(5))
    eyes = np.array([shot.kitchen_from_camera.translation for shot in shots])
    x_min, x_max, y_min, y_max, ceiling = kitchen.room
    assert (eyes > [x_min + 0.1, y_min + 0.1, 0.5]).all()
    assert (eyes < [x_max - 0.1, y_max - 0.1, ceiling]).all()
    for name, low, high in solids(kitchen):
        apart = np.maximum(low[:2] - eyes[:, :2], eyes[:, :2] - high[:2]).max(axis=1)
        assert apart.min() > 0.1, name
    camera = Intrinsics(fx=484.0, fy=484.0, cx=320.0, cy=240.0, width=640, height=480)
    things = true_objects(kitchen)
    faces = np.concatenate([t.kitchen_from_object.apply(np.array([[0.0, -t.dimensions_m[1] / 2, 0.0]])) for t in things])
    outward = np.array([t.kitchen_from_object.rotation @ [0.0, -1.0, 0.0] for t in things])
    seen = np.zeros(len(things), int)
    for shot in shots:
        x, y, z = shot.kitchen_from_camera.inverse.apply(faces).T
        u, v = camera.fx * x / z + camera.cx, camera.fy * y / z + camera.cy
        before = ((shot.kitchen_from_camera.translation - faces) * outward).sum(axis=1) > 0.2
        seen += before & (z > 0.2) & (u > 20) & (u < 620) & (v > 20) & (v < 460)
    assert (seen >= 3).all(), [thing.name for thing, count in zip(things, seen, strict=True) if count < 3]
