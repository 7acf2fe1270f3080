import pytest

from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.capture import Frame
from r2c2r_core.segment.motion.inside import measure_inside
from tests.core.segment.motion.boards import LEAF, THICKNESS_M, filmed

HELD = [0.0] * 4 + [1.5] * 20


def stays(frame: Frame) -> Rigid3 | None:
    return LEAF.world_from_front if HELD[frame.index] else None


def test_the_rear_board_of_an_open_unit_tells_its_inner_depth() -> None:
    inside = measure_inside(LEAF, stays, filmed("left", HELD))
    assert inside is not None
    assert inside.depth_m == pytest.approx(0.45 + THICKNESS_M - 0.019, abs=0.005)  # the unit's rear, less a usual front
    assert inside.shelves_m == ()


def test_what_stays_closed_has_no_inside_that_was_seen() -> None:
    assert measure_inside(LEAF, lambda frame: None, filmed("left", HELD)) is None
    assert measure_inside(LEAF, lambda frame: LEAF.world_from_front, filmed("left", [0.0] * 12)) is None
