"""Clicks on an open door, mapped back to where it is closed."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.kitchen.category import Size
from r2c2r_core.kitchen.names import category_of
from r2c2r_core.segment.fronts import clicked_open
from r2c2r_core.segment.fronts.clicked_open import closed_place
from r2c2r_core.segment.mosaics.orthomosaic import Cell
from r2c2r_core.segment.planes import PlaneRegion
from r2c2r_core.segment.prepared import PreparedCapture
from tests.core.segment.fronts.test_clicked_dark import FACE
from tests.core.segment.motion.boards import LEAF, THICKNESS_M, filmed, joint

STATES = np.concatenate([np.zeros(20), np.full(8, np.radians(80.0))])
CLICKED = 24  # a frame in which it is open
BOX = replace(category_of("refrigerator"), width=Size(0.4, 0.5, 0.6, ""), height=Size(0.5, 0.6, 0.7, ""))


def face(pose: Rigid3) -> PlaneRegion:
    shape = (round(LEAF.height_m / 0.02), round(LEAF.width_m / 0.02))
    return PlaneRegion(pose, LEAF.width_m, LEAF.height_m, np.ones(shape, bool), 0.02, LEAF.width_m * LEAF.height_m)


@pytest.fixture(scope="module")
def prepared() -> PreparedCapture:
    """A door that is closed in 20 frames and open in 8: the scan has both faces as planes of the same size."""
    film = filmed("left", STATES)

    def depth(k: int) -> np.ndarray:  # in a room, whose walls are far
        return np.where(film.depth(k) > 0, film.depth(k), 4.0)

    scene = SimpleNamespace(frames=film.frames, frame=lambda k: film.frames[k], depth=depth, noise=film.noise)
    planes = (face(LEAF.world_from_front), face(opened()))
    return cast(PreparedCapture, cast(Any, SimpleNamespace(scene=scene, planes=planes, run_of=lambda _: None)))


def opened() -> Rigid3:
    return LEAF.world_from_front @ joint("left").pose(float(STATES[CLICKED]))


def test_a_click_on_an_open_door_is_mapped_to_the_place_before_its_compartment(prepared: PreparedCapture) -> None:
    on_leaf = np.array([0.1, 0.0, 0.05])
    closed = closed_place(prepared, opened().apply(on_leaf), CLICKED, BOX)
    assert LEAF.world_from_front.inverse.apply(closed) == pytest.approx(on_leaf, abs=0.03)


def test_a_click_on_a_closed_door_stays_where_it_is(prepared: PreparedCapture) -> None:
    point = LEAF.world_from_front.apply(np.array([0.1, 0.0, 0.05]))
    assert closed_place(prepared, point, 3, BOX) is point


FLAP_STATES = np.concatenate([np.zeros(20), np.full(8, np.radians(85.0))])


def test_a_click_on_an_open_oven_is_mapped_to_its_black_glass(monkeypatch: pytest.MonkeyPatch) -> None:
    """The closed face returns no depth, so no panel of the run has its size: it is found by the hole in the depth."""
    film = filmed("bottom", FLAP_STATES, glass=True)
    scene = SimpleNamespace(frames=film.frames, frame=lambda k: film.frames[k], depth=film.depth, noise=film.noise)
    grid = SimpleNamespace(cells_of=lambda points: points[:, :2], rectangle=lambda cell: LEAF)
    run = SimpleNamespace(grid=grid, cells=(), region=FACE)
    prepared = cast(PreparedCapture, cast(Any, SimpleNamespace(scene=scene, planes=(FACE,), run_of=lambda *_, **__: run)))
    monkeypatch.setattr(clicked_open, "best_frames", lambda *_: range(8))
    monkeypatch.setattr(clicked_open, "unit_cell", lambda *_: Cell(0, 0, 1, 1))
    on_leaf = np.array([0.1, THICKNESS_M, 0.05])  # on its inner face
    flap = LEAF.world_from_front @ joint("bottom").pose(float(FLAP_STATES[CLICKED]))
    closed = closed_place(prepared, flap.apply(on_leaf), CLICKED, category_of("oven"))
    assert LEAF.world_from_front.inverse.apply(closed)[[0, 2]] == pytest.approx(on_leaf[[0, 2]], abs=0.04)
