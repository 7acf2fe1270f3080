from dataclasses import replace

import numpy as np
import pytest

from r2c2r_core.evaluate.records import ObjectRecord
from r2c2r_core.evaluate.shape import box_iou
from r2c2r_core.geometry.transforms import Rigid3, rotation_about_z, rotation_between


def box(size: tuple[float, float, float], pose: Rigid3) -> ObjectRecord:
    return ObjectRecord(name="a", category="box", dimensions_m=np.array(size), world_from_object=pose, joints=())


def at(x: float, yaw: float = 0.0) -> Rigid3:
    return Rigid3(rotation_about_z(yaw), np.array([x, 0.0, 0.0]))


@pytest.mark.parametrize(
    ("other", "expected"),
    [
        (box((1, 1, 1), at(0.0)), 1.0),
        (box((1, 1, 1), at(0.5)), 1 / 3),
        (box((1, 1, 1), at(1.0)), 0.0),
        (box((1, 1, 1), at(5.0)), 0.0),
        (box((0.5, 0.5, 0.5), at(0.1)), 0.125),
        (box((1, 1, 1), at(0.0, np.pi / 4)), 1 / np.sqrt(2)),  # an octagon of area 2 (sqrt 2 - 1)
        (box((0.999, 0.999, 0.999), at(0.0)), 0.999**3),
    ],
)
def test_box_iou_matches_known_values(other: ObjectRecord, expected: float) -> None:
    unit = box((1, 1, 1), at(0.0))
    assert box_iou(unit, other) == pytest.approx(expected, abs=1e-6)
    assert box_iou(other, unit) == pytest.approx(expected, abs=1e-6)


def test_box_iou_is_invariant_to_the_world_frame() -> None:
    a, b = box((0.6, 0.5, 0.8), at(0.0, 0.2)), box((0.5, 0.6, 0.7), at(0.2, -0.3))
    world = Rigid3(rotation_between(np.array([0.0, 0.0, 1.0]), np.array([0.3, -0.5, 0.8])), np.array([4.0, -2.0, 1.0]))
    moved = [box(tuple(t.dimensions_m), world @ t.world_from_object) for t in (a, b)]
    assert box_iou(*moved) == pytest.approx(box_iou(a, b), abs=1e-9)


def test_box_iou_of_a_round_object_ignores_yaw_but_not_position() -> None:
    bottle = replace(box((0.08, 0.08, 0.3), at(0.0, 0.3)), turns_freely=True)
    assert box_iou(bottle, box((0.08, 0.08, 0.3), at(0.0, 1.1))) == pytest.approx(1.0, abs=1e-6)
    aside = Rigid3(rotation_about_z(1.1), at(0.0, 0.3).apply(np.array([0.04, 0.0, 0.0])))
    assert box_iou(bottle, box((0.08, 0.08, 0.3), aside)) == pytest.approx(1 / 3, abs=1e-6)
