from dataclasses import replace

import numpy as np
import pytest

from r2c2r_core.geometry.transforms import Rigid3, front_rotation
from r2c2r_core.kitchen.fillers import Params
from r2c2r_core.kitchen.names import category_of
from r2c2r_core.model.track import FrontHandle
from r2c2r_core.synthesize.dimensions import MeasuredObject
from r2c2r_core.synthesize.fillers import leave_fillers


def door(name: str, outward: tuple[float, float], front: tuple[float, float], width: float) -> MeasuredObject:
    """A base door whose front centre is at `front` in plan."""
    size = np.array([width, 0.58, 0.72])
    rotation = front_rotation(np.array([*outward, 0.0]))
    centre = np.array([*front, 0.5]) + rotation[:, 1] * size[1] / 2
    pose = Rigid3(rotation, centre)
    return MeasuredObject(
        name=name,
        category="cabinet",
        spec=category_of("cabinet"),
        world_from_object=pose,
        dimensions_m=size,
        sources=("measured", "inferred", "measured"),
        handle=FrontHandle(left_m=0.1, right_m=0.2, bottom_m=0.2, top_m=0.22, protrusion_m=0.03, confidence=0.9),
        support_z_m=None,
        front_measured=True,
        confidence=0.9,
        fixed_by_person=False,
        placed_pose=pose,
        warnings=(),
    )


def right_edge(item: MeasuredObject) -> np.ndarray:
    return item.front_centre + item.world_from_object.rotation[:, 0] * item.dimensions_m[0] / 2


# `a` faces -y, its right edge is at x = 0.63; `b` faces -x with its front plane at x = 0.60, where an inside corner is
def corner(width: float) -> list[MeasuredObject]:
    a = door("a", (0.0, -1.0), (0.63 - width / 2, 0.0), width)
    b = door("b", (-1.0, 0.0), (0.60, -0.22), 0.5)
    return [a, b]


def test_a_door_in_a_corner_is_narrowed_by_a_filler() -> None:
    a, b = leave_fillers(corner(0.63))
    assert right_edge(a)[0] == pytest.approx(0.60 - Params().width_m, abs=1e-9)
    assert a.front_centre[1] == pytest.approx(0.0, abs=1e-9)  # the plane is unchanged
    assert a.sources == ("inferred", "inferred", "measured")
    assert "80 mm" in a.warnings[0]
    assert b.dimensions_m[0] < 0.5  # its own edge extended into the plane of `a` as well


def test_a_diagonal_unit_does_not_narrow_its_neighbour() -> None:
    half = np.sqrt(0.5)
    straight = door("a", (0.0, -1.0), (0.3, 0.0), 0.6)
    diagonal = door("b", (-half, -half), (0.6 + 0.2 * half, -0.2 * half), 0.4)
    assert [item.dimensions_m[0] for item in leave_fillers([straight, diagonal])] == [0.6, 0.4]


def test_narrowing_a_door_keeps_its_handle_in_place() -> None:
    before, after = corner(0.63)[0], leave_fillers(corner(0.63))[0]
    assert before.handle is not None
    assert after.handle is not None
    for item, handle in ((before, before.handle), (after, after.handle)):
        world = item.world_from_object.apply(np.array([handle.left_m, 0.0, 0.0]))
        assert world[0] == pytest.approx(0.315 + 0.1, abs=1e-9), item.name


def test_a_handle_on_the_filler_is_dropped_as_a_shadow() -> None:
    a, b = corner(0.63)
    shadow = FrontHandle(left_m=0.29, right_m=0.31, bottom_m=-0.2, top_m=0.2, protrusion_m=0.03, confidence=0.9)
    narrowed = leave_fillers([replace(a, handle=shadow), b])[0]
    assert narrowed.handle is None
    assert any("on the filler" in line for line in narrowed.warnings)
    beside = [door("a", (0.0, -1.0), (0.0, 0.0), 0.6), door("b", (0.0, -1.0), (0.602, 0.0), 0.6)]
    assert leave_fillers([replace(beside[0], handle=shadow), beside[1]])[0].handle == shadow


def test_adjacent_and_facing_doors_keep_their_width() -> None:
    beside = [door("a", (0.0, -1.0), (0.0, 0.0), 0.6), door("b", (0.0, -1.0), (0.602, 0.0), 0.6)]
    across = [door("a", (0.0, -1.0), (0.0, 0.0), 0.6), door("b", (0.0, 1.0), (0.0, -1.2), 0.6)]
    for pair in (beside, across):
        assert [item.dimensions_m[0] for item in leave_fillers(pair)] == [0.6, 0.6]


def test_a_large_overlap_in_a_corner_does_not_narrow_the_door() -> None:
    a = door("a", (0.0, -1.0), (0.3, 0.0), 0.9)  # its edge at 0.75 is 15 cm behind the plane of b
    b = door("b", (-1.0, 0.0), (0.60, -0.22), 0.5)
    assert leave_fillers([a, b])[0].dimensions_m[0] == 0.9
