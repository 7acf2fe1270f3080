from dataclasses import replace

import numpy as np
import pytest

from r2c2r_core.export.plan import collider_corners_world, plan_bundle
from r2c2r_core.export.support import supported
from r2c2r_core.geometry.gaps import last_contact
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.scene import ArticulatedScene, ConvexPiece, SceneObject
from tests.core.export.kitchen import bottle, cabinet, counter, kitchen


def bodies_of(*objects: SceneObject) -> list[str]:
    scene = ArticulatedScene(name="t", objects=objects, layout_moves_m={}, warnings=())
    return [body.name for body in supported(plan_bundle(scene)).bodies]


def test_objects_on_a_counter_or_the_floor_get_no_support_plate() -> None:
    assert "bottle_1_support" not in [body.name for body in supported(plan_bundle(kitchen())).bodies]
    assert "b_support" not in bodies_of(bottle("b", bottom_z=0.0005), cabinet("c", x=2.0))


def test_an_unsupported_object_gets_a_support_plate() -> None:
    scene = ArticulatedScene(name="t", objects=(bottle("b", bottom_z=0.8), cabinet("c", x=2.0)), layout_moves_m={}, warnings=())
    plan = supported(plan_bundle(scene))
    plate = next(body for body in plan.bodies if body.name == "b_support")
    top = plate.world_from_body.translation[2] + plate.link.boxes[0].size_m[2] / 2
    assert top == pytest.approx(0.8 - 1e-4, abs=1e-9)
    np.testing.assert_allclose(plate.world_from_body.translation[:2], [0.2, -0.1], atol=1e-9)
    assert plan.notes("b")
    assert not plan.notes("c")
    assert [body.name for body in plan.of("b")] == ["b_body"]


def test_a_counter_far_below_does_not_count_as_support() -> None:
    assert "b_support" in bodies_of(counter("k"), bottle("b", bottom_z=1.2))


def test_an_object_is_set_down_on_the_tilted_top_below_it() -> None:
    """A table top that rises by 1 cm along its length: the bottle stands on it where it is, not at its highest point."""
    slab = np.array([[x, y, z - 0.02 * x] for x in (-0.25, 0.25) for y in (-0.3, 0.3) for z in (-0.03, 0.0)])
    tilted = counter("k")
    piece = ConvexPiece(name="top", vertices_link=slab)
    links = (replace(tilted.links[0], boxes=(), pieces=(piece,)),)
    tilted = replace(tilted, links=links, world_from_object=Rigid3(np.eye(3), np.array([0.0, 0.0, 0.8])))
    scene = ArticulatedScene(name="t", objects=(tilted, bottle("b", bottom_z=0.825)), layout_moves_m={}, warnings=())
    plan = supported(plan_bundle(scene))
    (body,) = plan.of("b")
    (bottle_corners,), (top_corners,) = collider_corners_world(body), collider_corners_world(plan.of("k")[0])
    assert last_contact(bottle_corners, top_corners, np.array([0.0, 0.0, 1.0])) == pytest.approx(-1e-4, abs=1e-9)
    assert len(plan.notes("b")) == 1
    assert "down by" in plan.notes("b")[0]


def test_no_support_plate_is_placed_inside_another_object() -> None:
    """One bottle would be inside the other's plate: a reported fall is better than two jammed bottles."""
    assert bodies_of(bottle("b", bottom_z=0.8), bottle("lower", bottom_z=0.6)).count("b_support") == 0
