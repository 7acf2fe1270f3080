from dataclasses import replace

import numpy as np
import pytest

from r2c2r_core.errors import ExportFailed
from r2c2r_core.export.plan import plan_bundle
from r2c2r_core.export.preview import poses_at
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.scene import ArticulatedScene, Box, Joint, Link, SceneObject
from tests.core.export.kitchen import bottle, cabinet, double_door, kitchen


def scene_of(*objects: SceneObject) -> ArticulatedScene:
    return ArticulatedScene(name="test", objects=objects, layout_moves_m={}, warnings=())


def test_body_and_joint_names_are_unique_and_prefixed_by_object() -> None:
    plan = plan_bundle(kitchen())
    for body in plan.bodies:
        assert body.name.startswith(f"{body.object_name}_")
        assert body.joint_name.startswith(f"{body.object_name}_")
    names = [body.name for body in plan.bodies] + [body.joint_name for body in plan.bodies]
    assert len(set(names)) == len(names)


def test_colliding_link_names_of_two_objects_are_made_unique() -> None:
    first, second = cabinet("a"), cabinet("a_b", x=1.0)
    first = replace(
        first,
        links=(replace(first.links[0], name="b_base"), first.links[1]),
        joints=(replace(first.joints[0], parent="b_base"),),
    )
    second = replace(
        second,
        links=(replace(second.links[0], name="base"), second.links[1]),
        joints=(replace(second.joints[0], parent="base"),),
    )
    names = [body.name for body in plan_bundle(scene_of(first, second)).bodies]
    assert len(set(names)) == 4


def test_link_names_are_prefixed_and_special_characters_replaced() -> None:
    item = cabinet("cab")
    item = replace(
        item,
        links=(replace(item.links[0], name="cab"), replace(item.links[1], name="left door/1")),
        joints=(replace(item.joints[0], name="hinge", parent="cab", child="left door/1"),),
    )
    plan = plan_bundle(scene_of(item))
    assert [body.name for body in plan.bodies] == ["cab_body", "cab_left_door_1"]
    assert plan.bodies[1].joint_name == "cab_hinge"


def test_bodies_are_sorted_parents_before_children() -> None:
    item = double_door("d")
    item = replace(item, links=(item.links[0], item.links[2], item.links[1]))
    seen = {"world"}
    for body in plan_bundle(scene_of(item)).bodies:
        assert body.parent in seen
        seen.add(body.name)


def test_link_frames_are_moved_onto_the_hinge_with_the_same_motion() -> None:
    """A door given in the object's frame opens exactly like the same door given in the hinge's frame."""
    good = cabinet("c", x=0.3, yaw=0.4)
    door = good.links[1]
    shift = door.object_from_link.translation
    moved = replace(
        door,
        object_from_link=Rigid3(),
        boxes=tuple(replace_box(box, shift) for box in door.boxes),
        visual=replace(door.visual, vertices=door.visual.vertices + shift),
        inertial=replace(door.inertial, com_link=door.inertial.com_link + shift),
    )
    a, b = plan_bundle(scene_of(good)), plan_bundle(scene_of(replace(good, links=(good.links[0], moved))))
    for fraction in (0.0, 0.5, 1.0):
        pose_a, pose_b = poses_at(a, fraction)["c_door"], poses_at(b, fraction)["c_door"]
        np.testing.assert_allclose(
            pose_a.apply(a.bodies[1].link.visual.vertices), pose_b.apply(b.bodies[1].link.visual.vertices), atol=1e-9
        )
        np.testing.assert_allclose(
            pose_a.apply(a.bodies[1].link.inertial.com_link[None]),
            pose_b.apply(b.bodies[1].link.inertial.com_link[None]),
            atol=1e-9,
        )


def test_a_left_hinged_door_opens_outwards_and_to_the_left() -> None:
    plan = plan_bundle(scene_of(cabinet("c")))
    handle = np.array([[0.55, 0.0, 0.0]])
    closed, opened = (poses_at(plan, fraction)["c_door"].apply(handle)[0] for fraction in (0.0, 0.9))
    assert opened[1] < closed[1] - 0.4  # metres towards the person, at -Y
    assert opened[0] < closed[0] - 0.4


def test_identical_textures_of_an_object_share_one_file() -> None:
    item = cabinet("c")
    base = replace(item.links[0], visual=item.links[1].visual)
    plan = plan_bundle(scene_of(replace(item, links=(base, item.links[1]))))
    assert plan.bodies[0].texture_file == plan.bodies[1].texture_file


def test_the_floor_is_lowered_to_the_lowest_object() -> None:
    low = bottle("b", bottom_z=-0.004)
    assert plan_bundle(scene_of(low)).floor_z_m == pytest.approx(-0.004)
    assert plan_bundle(kitchen()).floor_z_m == 0.0


def test_an_empty_scene_or_a_kinematic_loop_is_rejected() -> None:
    with pytest.raises(ExportFailed, match="no object"):
        plan_bundle(scene_of())
    item = cabinet("c")
    loop = replace(item, joints=(replace(item.joints[0], parent="c_door"),))
    with pytest.raises(ExportFailed, match="c: its joints do not form a tree"):
        plan_bundle(scene_of(loop))


def replace_box(box: Box, shift: np.ndarray) -> Box:
    return replace(box, link_from_box=Rigid3(np.eye(3), shift) @ box.link_from_box)


def test_planning_does_not_modify_the_scene_model() -> None:
    item = cabinet("c")
    before: tuple[Link, Joint] = (item.links[1], item.joints[0])
    plan_bundle(scene_of(item))
    assert (item.links[1], item.joints[0]) == before
