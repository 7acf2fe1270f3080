import pytest

from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.capture import Frame
from r2c2r_core.segment.motion.inside import front_thickness, measure_inside
from tests.core.segment.motion.boards import LEAF, THICKNESS_M, filmed, joint

HELD = [0.0] * 4 + [1.5] * 20


def stays(frame: Frame) -> Rigid3 | None:
    return LEAF.world_from_front if HELD[frame.index] else None


def test_inner_depth_is_measured_from_the_rear_board_of_an_open_unit() -> None:
    inside = measure_inside(LEAF, stays, filmed("left", HELD))
    assert inside is not None
    assert inside.depth_m == pytest.approx(0.45 + THICKNESS_M - 0.019, abs=0.005)  # the unit's rear, minus a usual front
    assert inside.shelves_m == ()


def test_a_row_of_jars_is_not_taken_for_the_rear_board() -> None:
    """Rays pass the jars along the shelf and hit a rear without depth returns."""
    assert measure_inside(LEAF, stays, filmed("left", HELD, jars=True)) is None


def test_a_unit_that_stays_closed_has_no_measured_inside() -> None:
    assert measure_inside(LEAF, lambda frame: None, filmed("left", HELD)) is None
    assert measure_inside(LEAF, lambda frame: LEAF.world_from_front, filmed("left", [0.0] * 12)) is None


def test_surfaces_deeper_than_the_unit_are_not_its_rear_board() -> None:
    assert measure_inside(LEAF, stays, filmed("left", HELD), deepest_m=0.4) is None


DRAWN = [0.0] * 4 + [0.08, 0.1, 0.13, 0.16, 0.18] + [0.2] * 11


def comes_out(frame: Frame) -> Rigid3 | None:
    state = DRAWN[frame.index]
    return LEAF.world_from_front @ joint("out").pose(state) if state else None


def test_the_static_rear_of_a_unit_is_not_the_rear_of_a_drawer() -> None:
    """The rear board of the unit is visible above the drawer front, and farther behind it in every frame."""
    film = filmed("out", DRAWN)
    assert measure_inside(LEAF, comes_out, film, drawn_out_m=0.1) is None
    assert measure_inside(LEAF, stays_behind, film) is not None  # the rear is visible


def stays_behind(frame: Frame) -> Rigid3 | None:
    return LEAF.world_from_front if DRAWN[frame.index] else None


@pytest.mark.parametrize("thickness_m", [THICKNESS_M, 0.06])
def test_the_thickness_of_a_door_is_measured_at_its_edge(thickness_m: float) -> None:
    film = filmed("left", HELD, thickness_m=thickness_m)
    found = front_thickness(LEAF, lambda frame: LEAF.world_from_front @ joint("left").pose(HELD[frame.index]), film)
    assert found == pytest.approx(thickness_m, abs=0.015)  # depth blurs an edge by a pixel
