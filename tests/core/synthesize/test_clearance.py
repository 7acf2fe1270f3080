"""Joint motions, and their free range up to a stationary obstacle."""

from dataclasses import replace

import numpy as np
import pytest

from r2c2r_core.geometry.boxes import box_corners
from r2c2r_core.geometry.transforms import Rigid3, rotation_about, rotation_about_z
from r2c2r_core.model.capture import Wall
from r2c2r_core.model.inputs import Overrides
from r2c2r_core.model.scene import Box, SceneObject
from r2c2r_core.synthesize.clearance import free_travel, gathered, motion_at, open_freely
from r2c2r_core.synthesize.stage import SynthesizeConfig, build_scene
from tests.core.synthesize.kitchen_units import Handle, Unit, capture, placed_unit

SPARE_M, SPARE_RAD = 0.003, np.deg2rad(1.0)  # clearance kept before an obstacle
ROOM = Rigid3(rotation_about_z(0.7), np.array([2.0, -1.0, 0.3]))


def unit(category: str, *, room: Rigid3 | None = None) -> SceneObject:
    """A unit of 0.6 x 0.58 x 0.7 m at the origin whose front faces -Y, or elsewhere."""
    made = placed_unit(Unit("a", category, (0.0, 0.0, 0.5), (0.6, 0.58, 0.7)), np.random.default_rng(0))
    item = build_scene(capture(), *([m] for m in made), Overrides(objects={}), SynthesizeConfig()).objects[0]
    return moved(item, room or Rigid3())


def moved(item: SceneObject, motion: Rigid3) -> SceneObject:
    return replace(item, world_from_object=motion @ item.world_from_object)


def block(low: tuple[float, float, float], high: tuple[float, float, float]) -> SceneObject:
    """A stationary block between two corners."""
    size = np.subtract(high, low)
    box = Box(name="block", role="carcass", size_m=size, link_from_box=Rigid3())
    shown = unit("cabinet")
    link = replace(shown.links[0], name="block_base", object_from_link=Rigid3(), boxes=(box,))
    pose = Rigid3(np.eye(3), np.add(low, size / 2))
    return replace(shown, name="block", links=(link,), joints=(), world_from_object=pose)


def travel(item: SceneObject, *others: SceneObject, walls: tuple[Wall, ...] = ()) -> tuple[float, str | None]:
    objects = [item, *others]
    return free_travel(item, item.joints[0], 0, objects, gathered(objects), walls)[:2]


@pytest.mark.parametrize("category", ["drawer", "cabinet"])
def test_joint_motions_compose_additively_and_invert(category: str) -> None:
    item = unit(category, room=ROOM)
    joint = item.joints[0]
    np.testing.assert_allclose(motion_at(item, joint, 0.0).matrix, np.eye(4), atol=1e-12)
    for a, b in [(0.1, 0.2), (0.3, -0.1), (1e-9, 1e-9)]:
        both = motion_at(item, joint, a) @ motion_at(item, joint, b)
        np.testing.assert_allclose(motion_at(item, joint, a + b).matrix, both.matrix, atol=1e-12)
        np.testing.assert_allclose(motion_at(item, joint, -a).matrix, motion_at(item, joint, a).inverse.matrix, atol=1e-12)


def test_a_door_rotates_about_its_hinge_and_a_drawer_slides_outwards() -> None:
    door = unit("cabinet", room=ROOM)
    pivot = door.world_from_object.apply(door.joints[0].origin_object[None])
    on_axis = np.concatenate([pivot, pivot + np.array([0, 0, 0.4])])
    np.testing.assert_allclose(motion_at(door, door.joints[0], 0.9).apply(on_axis), on_axis, atol=1e-12)
    drawer = unit("drawer", room=ROOM)
    slide = motion_at(drawer, drawer.joints[0], 0.25)
    np.testing.assert_allclose(slide.translation, -0.25 * drawer.world_from_object.rotation[:, 1], atol=1e-12)


@pytest.mark.parametrize("axis", [np.array([0, 0, 1.0]), np.array([0.6, 0.0, 0.8]), np.array([0, -1.0, 0])])
def test_a_rotation_keeps_its_axis_and_is_right_handed(axis: np.ndarray) -> None:
    across = np.cross(axis, [0.3, 0.5, -0.7])
    across /= np.linalg.norm(across)
    for angle in (1e-9, 0.4, np.pi):
        turn = rotation_about(axis, angle)
        np.testing.assert_allclose(turn @ axis, axis, atol=1e-12)
        np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-12)
        np.testing.assert_allclose(turn @ across, np.cos(angle) * across + np.sin(angle) * np.cross(axis, across), atol=1e-12)


@pytest.mark.parametrize("distance_m", [0.05, 0.2, 0.4])
def test_a_drawer_stops_before_an_obstacle(distance_m: float) -> None:
    face = -0.58 / 2
    wall_before = block((-1.0, face - distance_m - 0.3, 0.0), (1.0, face - distance_m, 1.0))
    free, blocker = travel(unit("drawer"), wall_before)
    assert blocker == "block"
    assert free == pytest.approx(distance_m - SPARE_M, abs=1.5e-3)  # half a millimetre of contact is allowed; a 64th of a step


def test_travel_is_full_without_obstacles_or_with_movable_ones() -> None:
    drawer = unit("drawer")
    far = block((-1.0, -3.0, 0.0), (1.0, -2.5, 1.0))
    assert travel(drawer, far) == (drawer.joints[0].upper, None)
    chair = replace(block((-0.3, -0.8, 0.0), (0.3, -0.5, 1.0)), movable=True)
    assert travel(drawer, chair) == (drawer.joints[0].upper, None)


def test_a_wall_beside_the_hinge_limits_the_opening_angle() -> None:
    """For a left hinge with a wall 10 cm beside it, the door's far edge hits the wall at the angle of plane geometry."""
    door = unit("cabinet")
    hinge_x = float(door.joints[0].origin_object[0])
    assert hinge_x < 0
    wall = Wall(normal=np.array([1.0, 0.0, 0.0]), offset_m=hinge_x - 0.1, area_m2=4.0)
    free, blocker = travel(door, walls=(wall,))
    assert blocker == "a wall"
    reach = 0.1 + 0.01  # to the wall, and into its centimetre of plaster
    assert np.pi / 2 < free < np.pi / 2 + np.arcsin(reach / 0.6)


def test_a_flap_is_limited_by_the_floor_unless_it_is_on_a_plinth() -> None:
    def oven(bottom_m: float) -> SceneObject:
        handle = Handle(0.0, 0.3, vertical=False)
        made = placed_unit(Unit("a", "oven", (0.0, 0.0, bottom_m + 0.35), (0.6, 0.58, 0.7), handle=handle), rng)
        return build_scene(capture(), *([m] for m in made), Overrides(objects={}), SynthesizeConfig()).objects[0]

    rng = np.random.default_rng(0)
    grounded = oven(0.002)
    assert grounded.warnings == ("a_door_joint opens to 86° of 90°: the floor blocks it",)
    joint = grounded.joints[0]
    flap = next(link for link in grounded.links if link.name == joint.child)
    touching = motion_at(grounded, joint, joint.upper + SPARE_RAD) @ grounded.world_from_object @ flap.object_from_link
    corners = [(touching @ box.link_from_box).apply(box_corners(box.size_m)) for box in flap.boxes]
    assert -1e-3 < np.concatenate(corners)[:, 2].min() <= 0.0  # half a millimetre of contact is allowed; a 64th of a step
    assert oven(0.1).joints[0].upper == pytest.approx(np.pi / 2)


@pytest.mark.parametrize("category", ["drawer", "cabinet"])
def test_free_travel_does_not_depend_on_the_world_frame(category: str) -> None:
    def obstacles(motion: Rigid3) -> SceneObject:
        return moved(block((-0.5, -0.8, 0.2), (-0.1, -0.5, 0.9)), motion)

    here, there = travel(unit(category), obstacles(Rigid3())), travel(unit(category, room=ROOM), obstacles(ROOM))
    assert here[1] == there[1] == "block"
    assert here[0] == pytest.approx(there[0], abs=1e-6)


@pytest.mark.parametrize("category", ["drawer", "cabinet"])
@pytest.mark.parametrize(("overlap_m", "opens"), [(0.0008, True), (0.008, True), (0.03, False)])
def test_an_overlap_while_closed_that_an_edges_error_explains_blocks_no_joint(
    category: str, overlap_m: float, opens: bool
) -> None:
    front = unit(category)
    free_edge_m = max(abs(corner) for corner in (-0.3, 0.3))
    side = -1.0 if front.joints[0].origin_object[0] > 0 else 1.0  # on the side without the hinge
    ends = sorted((side * (free_edge_m - overlap_m), side * (free_edge_m + 0.5)))
    beside = block((ends[0], -0.35, 0.0), (ends[1], -0.28, 1.0))
    free, _ = open_freely([front, beside], (), frozenset())
    assert (free.joints[0].upper > 0.9 * front.joints[0].upper) == opens
    assert any("its closed front overlaps block" in line for line in free.warnings)


def test_a_blocked_limit_is_lowered_unless_a_person_set_it() -> None:
    drawer, before = unit("drawer"), block((-1.0, -0.8, 0.0), (1.0, -0.4, 1.0))
    opened, _ = open_freely([drawer, before], (), frozenset())
    assert opened.joints[0].upper < drawer.joints[0].upper
    assert opened.joints[0].sources["limits"] == "inferred"
    assert "block blocks it" in opened.warnings[-1]
    kept, _ = open_freely([drawer, before], (), frozenset({drawer.joints[0].name}))
    assert kept.joints[0].upper == drawer.joints[0].upper
