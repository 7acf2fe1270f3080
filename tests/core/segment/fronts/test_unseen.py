import dataclasses

import pytest

from r2c2r_core.kitchen.names import category_of
from r2c2r_core.model.capture import Capture
from r2c2r_core.segment.fronts.found import FoundFront
from r2c2r_core.segment.fronts.front import Front, front_panel
from r2c2r_core.segment.fronts.unseen import with_unseen_top
from r2c2r_core.segment.geometric.session import GeometricSession
from tests.core.segment.conftest import Truth
from tests.core.segment.scenes import DOORS, FRONT_Y, click_on, prompt

CABINET, TALL = category_of("cabinet"), category_of("tall_cabinet")


@pytest.fixture
def door(session: GeometricSession, boxes: tuple[Capture, Truth]) -> Front:
    left, _ = DOORS["door_a"]
    found = session.find(prompt("door_a", "cabinet", click_on(boxes[0], (left + 0.3, FRONT_Y, 0.4), 60)))
    assert isinstance(found, FoundFront)
    return found.front


def cut_off(door: Front, columns: slice) -> Front:
    """The door as frames show it whose border is 10 cm below its upper edge."""
    row = round(door.cell.top + 0.1 / door.run.grid.cell_m)
    mosaic = door.run.mosaic.copy()
    mosaic[:row, columns] = 0
    run = dataclasses.replace(door.run, mosaic=mosaic)
    return dataclasses.replace(door, run=run, cell=dataclasses.replace(door.cell, top=float(row)))


def test_an_upper_edge_that_frames_show_stays(door: Front) -> None:
    assert with_unseen_top(door.cell, door.run, CABINET) == door.cell


def test_an_upper_edge_15_mm_below_the_border_of_the_pictures_is_seen(door: Front) -> None:
    mosaic = door.run.mosaic.copy()
    mosaic[: round(door.cell.top - 0.015 / door.run.grid.cell_m)] = 0
    assert with_unseen_top(door.cell, dataclasses.replace(door.run, mosaic=mosaic), TALL) == door.cell


def test_an_unseen_upper_edge_is_on_the_line_of_its_row(door: Front) -> None:
    cut = cut_off(door, slice(round(door.cell.left) - 4, round(door.cell.right) + 4))
    found = with_unseen_top(cut.cell, cut.run, CABINET)
    assert found.top == pytest.approx(door.cell.top, abs=0.01 / door.run.grid.cell_m)


def test_a_row_whose_upper_edges_are_all_unseen_has_its_usual_height_and_says_so(door: Front) -> None:
    cut = cut_off(door, slice(None))
    found = with_unseen_top(cut.cell, cut.run, TALL)  # higher than the grid
    assert found.height * cut.run.grid.cell_m == pytest.approx(TALL.height.usual)
    assert front_panel(dataclasses.replace(cut, cell=found)).edges[2] < 0.3
