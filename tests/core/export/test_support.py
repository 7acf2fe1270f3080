import numpy as np
import pytest

from r2c2r_core.export.plan import plan_bundle
from r2c2r_core.export.support import supported
from r2c2r_core.model.scene import ArticulatedScene, SceneObject
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


def test_no_support_plate_is_placed_inside_another_object() -> None:
    """One bottle would be inside the other's plate: a reported fall is better than two jammed bottles."""
    assert bodies_of(bottle("b", bottom_z=0.8), bottle("lower", bottom_z=0.6)).count("b_support") == 0
