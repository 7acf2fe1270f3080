"""Clicks on fronts without depth returns."""

from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from r2c2r_core.kitchen.names import category_of
from r2c2r_core.model.capture import Capture
from r2c2r_core.model.inputs import PromptPoint
from r2c2r_core.segment.fronts.clicked_dark import dark_beyond, dark_frames, dark_place
from r2c2r_core.segment.geometric import finders
from r2c2r_core.segment.planes import PlaneRegion
from r2c2r_core.segment.scene import Scene
from r2c2r_core.segment.stage import open_session
from tests.core.segment.conftest import Truth
from tests.core.segment.motion.boards import LEAF, THICKNESS_M, filmed
from tests.core.segment.scenes import FRONT_Y, click_on, prompt

WIDTH_M, HEIGHT_M = 1.7, 0.9


class Film:
    """The part of a scene that a click needs."""

    def __init__(self, *, glass: bool, dark_corner: bool = False) -> None:
        self._film = filmed("left", np.zeros(3), glass=glass)
        self._dark_corner = dark_corner

    def depth(self, index: int) -> Any:
        depth = self._film.depth(index).copy()
        if self._dark_corner:
            depth[:60, :60] = 0
        return depth

    def frame(self, index: int) -> Any:
        return self._film.frames[index]

    def has_depth(self, index: int, x_px: float, y_px: float) -> bool:
        return Scene.has_depth(cast(Scene, self), index, x_px, y_px)

    def depth_at_step(self, index: int, x_px: float, y_px: float) -> float | None:
        return Scene.depth_at_step(cast(Scene, self), index, x_px, y_px)

    def ray(self, index: int, x_px: float, y_px: float) -> Any:
        return Scene.ray(cast(Scene, self), index, x_px, y_px)


def _plane(behind_m: float, *, hole: bool) -> PlaneRegion:
    """A plane that far behind LEAF's face, with a hole at LEAF."""
    place = LEAF.world_from_front
    support = np.ones((round(HEIGHT_M / 0.02), round(WIDTH_M / 0.02)), bool)
    if hole:
        support[8:37, 30:55] = False
    origin = place.apply(np.array([0.0, behind_m, 0.0]))
    return PlaneRegion(type(place)(place.rotation, origin), WIDTH_M, HEIGHT_M, support, 0.02, float(support.sum()) * 4e-4)


FACE, REAR = _plane(0.0, hole=True), _plane(THICKNESS_M + 0.45, hole=False)
CLICK = PromptPoint(frame=1, x=96.0, y=76.0, label=1)


def test_a_click_on_black_glass_lies_on_the_plane_of_its_surroundings() -> None:
    place = dark_place(cast(Scene, Film(glass=True)), (REAR, FACE), CLICK)
    assert place is not None
    local = LEAF.world_from_front.inverse.apply(place)
    assert abs(local[1]) < 1e-6
    assert (np.abs(local[[0, 2]]) < LEAF.half_m).all()


def test_a_click_with_sensor_depth_gets_no_dark_place() -> None:
    assert dark_place(cast(Scene, Film(glass=False)), (REAR, FACE), CLICK) is None


def test_a_click_in_a_silhouette_gap_is_not_taken_for_black_glass(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Film, "depth_at_step", lambda *_: 2.0)
    assert dark_place(cast(Scene, Film(glass=True)), (REAR, FACE), CLICK) is None


def test_a_depth_hole_without_a_surrounding_plane_gives_no_place() -> None:
    assert dark_place(cast(Scene, Film(glass=True)), (REAR,), CLICK) is None


def test_a_depth_hole_that_leaves_the_image_gives_no_place() -> None:
    corner = PromptPoint(frame=1, x=2.0, y=2.0, label=1)
    assert dark_place(cast(Scene, Film(glass=False, dark_corner=True)), (REAR, FACE), corner) is None


def _band(top_m: float, bottom_m: float) -> PlaneRegion:
    """The observed part of LEAF's face between two heights, across its middle."""
    place, height = LEAF.world_from_front, top_m - bottom_m
    origin = place.apply(np.array([0.0, 0.0, (top_m + bottom_m) / 2]))
    support = np.ones((round(height / 0.02), round(WIDTH_M / 0.02)), bool)
    return PlaneRegion(type(place)(place.rotation, origin), WIDTH_M, height, support, 0.02, WIDTH_M * height)


ABOVE, BELOW = _band(HEIGHT_M / 2, LEAF.half_m[1]), _band(-LEAF.half_m[1], -HEIGHT_M / 2)


def test_black_glass_between_two_coplanar_regions_lies_on_their_plane() -> None:
    film = cast(Scene, Film(glass=True))
    place = dark_place(film, (REAR, ABOVE, BELOW), CLICK)
    assert place is not None
    assert abs(LEAF.world_from_front.inverse.apply(place[None])[0, 1]) < 1e-6


def test_a_front_extends_beyond_its_plane_as_far_as_the_hole_in_the_depth() -> None:
    glass, wood = (cast(Scene, Film(glass=shown)) for shown in (True, False))
    middle, oven = LEAF.centre, category_of("oven")
    beyond_m = dark_beyond(glass, ABOVE, middle, (CLICK.frame,), oven)
    assert LEAF.height_m - 0.02 < beyond_m < LEAF.height_m + 0.1
    assert dark_beyond(wood, ABOVE, middle, (CLICK.frame,), oven) == 0.0


def test_a_front_extends_no_farther_than_its_category() -> None:
    microwave, point = category_of("microwave"), LEAF.world_from_front.apply(np.array([0.0, 0.0, 0.2]))
    beyond_m = dark_beyond(cast(Scene, Film(glass=True)), ABOVE, point, (CLICK.frame,), microwave)
    assert 0 < beyond_m < 0.1 + microwave.height.usual + 0.1 < LEAF.height_m


def test_black_glass_is_looked_for_on_the_plane_that_surrounds_it() -> None:
    glass, wood = (cast(Scene, Film(glass=shown)) for shown in (True, False))
    assert dark_frames(glass, FACE, LEAF.centre, (CLICK.frame,)) == (CLICK.frame,)
    assert dark_frames(glass, REAR, LEAF.centre, (CLICK.frame,)) == ()
    assert dark_frames(wood, FACE, LEAF.centre, (CLICK.frame,)) == ()


def test_black_glass_is_not_looked_for_where_a_closed_front_has_depth(
    boxes: tuple[Capture, Truth], cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(finders, "best_frames", lambda *_: pytest.fail("searched other frames for black glass"))
    door = prompt("a", "cabinet", click_on(boxes[0], (0.3, FRONT_Y, 0.4), 60))
    assert open_session(boxes[0], cache).panel(door) is not None
