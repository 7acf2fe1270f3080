import dataclasses
from pathlib import Path

import numpy as np
import pytest

from r2c2r_core.geometry.masks import mask_iou
from r2c2r_core.model.capture import Capture
from r2c2r_core.model.inputs import ObjectPrompt
from r2c2r_core.segment.fronts.found import FoundFront
from r2c2r_core.segment.fronts.front import front_mask, front_panel, own_handle
from r2c2r_core.segment.geometric.session import GeometricSession
from r2c2r_core.segment.mosaics.handles import GridHandle
from r2c2r_core.segment.mosaics.orthomosaic import Cell, joined
from r2c2r_core.segment.scene import Scene
from r2c2r_core.segment.stage import open_session
from tests.core.segment.conftest import Truth
from tests.core.segment.scenes import BOTTOM_M, DOORS, DRAWERS, FRONT_Y, POST, TOP_M, Pixels, click_on, prompt

Boxes = tuple[Capture, Truth]


@pytest.mark.parametrize("name", DOORS)
def test_one_click_measures_a_door_within_3_mm(session: GeometricSession, boxes: Boxes, name: str) -> None:
    left, width = DOORS[name]
    panel = session.find(prompt(name, "cabinet", click_on(boxes[0], (left + 0.3, FRONT_Y, 0.4), 60))).panel()
    assert panel is not None
    assert panel.width_m == pytest.approx(width, abs=3e-3)  # a pixel at 1.3 m
    assert panel.height_m == pytest.approx(TOP_M - BOTTOM_M, abs=3e-3)
    middle = [left + width / 2, FRONT_Y, (TOP_M + BOTTOM_M) / 2]
    np.testing.assert_allclose(panel.world_from_front.translation, middle, atol=3e-3)
    assert panel.handle is not None
    assert panel.handle.is_vertical
    assert panel.handle.protrusion_m == pytest.approx(0.036, abs=6e-3)  # a rod two depth pixels wide
    assert np.sign(panel.handle.centre[0]) == (-1 if name == "door_b" else 1)


def test_an_edge_without_colour_contrast_has_low_strength(session: GeometricSession, boxes: Boxes) -> None:
    left, _ = DOORS["door_a"]
    found = session.find(prompt("pale", "cabinet", click_on(boxes[0], (left + 0.3, FRONT_Y, 0.4), 60)))
    assert isinstance(found, FoundFront)
    assert min(front_panel(found.front).edges) > 0.5
    pale = dataclasses.replace(found.front.run, mosaic=np.full_like(found.front.run.mosaic, 200))
    assert max(front_panel(dataclasses.replace(found.front, run=pale)).edges) < 0.3  # evaluated on the run's mosaic


@pytest.mark.parametrize("name", DRAWERS)
def test_a_drawer_stack_is_cut_into_its_drawers(session: GeometricSession, boxes: Boxes, name: str) -> None:
    left, width, bottom, height = DRAWERS[name]
    panel = session.find(prompt(name, "drawer", click_on(boxes[0], (left + 0.1, FRONT_Y, bottom + 0.06), 60))).panel()
    assert panel is not None
    assert panel.width_m == pytest.approx(width, abs=3e-3)
    assert panel.height_m == pytest.approx(height, abs=5e-3)  # a gap is one pixel: its two sides are not distinguished
    assert panel.handle is not None
    assert not panel.handle.is_vertical
    np.testing.assert_allclose(panel.handle.centre, (0, 0), atol=8e-3)


def test_masks_follow_the_door_in_every_frame_and_exclude_the_post(session: GeometricSession, boxes: Boxes) -> None:
    capture, truth = boxes
    track = session.track(prompt("door_b", "cabinet", click_on(capture, (0.9, FRONT_Y, 0.4), 60)))
    for frame in capture.frames:
        mask = session.mask_at(prompt("door_b", "cabinet", click_on(capture, (0.9, FRONT_Y, 0.4), 60)), frame.index)
        assert mask_iou(mask, truth["door_b"][frame.index]) > 0.94
        post = click_on(capture, (sum(POST) / 2, FRONT_Y - 0.25, 0.5), frame.index)
        assert not mask[int(post.y), int(post.x)]
    assert set(track.masks) == {frame.index for frame in capture.frames}
    assert track.kind == "front"


@pytest.mark.parametrize("colour", [15, None])
def test_what_hides_a_front_without_returning_light_is_known_by_its_colour(
    session: GeometricSession, boxes: Boxes, colour: int | None
) -> None:
    """Black glass of an open oven's door, in one frame; the front itself where the depth image has a mere hole."""
    capture, truth = boxes
    found, frame = session.find(prompt("a", "cabinet", click_on(capture, (0.3, FRONT_Y, 0.4), 60))), capture.frame(60)
    assert isinstance(found, FoundFront)
    alone, _ = front_mask(found.front, session.scene, frame)
    before = truth["door_a"][60].copy()
    before[: int(np.median(np.flatnonzero(before.any(axis=1))))] = False
    rgb, depth = capture.images.rgb(60).copy(), capture.images.depth(60).metres.copy()
    depth[before[1::2, 1::2]] = 0.0
    rgb[before] = rgb[before] if colour is None else colour
    shown = dataclasses.replace(capture, images=Pixels({60: rgb}, {60: depth}))
    mask, _ = front_mask(found.front, Scene(shown, session.scene.rendered_mm, session.scene.parts), frame)
    assert mask[alone & before].mean() == pytest.approx(0.0 if colour else 1.0, abs=0.02)
    assert mask[alone & ~before].mean() > 0.98


def test_a_double_door_is_found_as_one_object_from_one_click(session: GeometricSession, boxes: Boxes) -> None:
    point = click_on(boxes[0], (0.3, FRONT_Y, 0.4), 60)
    single, double = (
        session.find(prompt("a", "cabinet", point)).panel(),
        session.find(prompt("a", "double-door cabinet", point)).panel(),
    )
    assert single is not None
    assert double is not None
    assert double.width_m == pytest.approx(1.003, abs=4e-3)  # doors a and b, whose handles are adjacent
    assert double.width_m > 1.9 * single.width_m


def test_a_second_click_joins_panels_and_a_negative_click_cuts_them(session: GeometricSession, boxes: Boxes) -> None:
    on_a, on_b = (click_on(boxes[0], (x, FRONT_Y, 0.4), 60) for x in (0.3, 0.9))
    joined = session.find(prompt("ab", "cabinet", on_a, on_b)).panel()
    assert joined is not None
    assert joined.width_m == pytest.approx(1.003, abs=4e-3)
    off_b = click_on(boxes[0], (0.9, FRONT_Y, 0.4), 60, label=0)
    cut = session.find(prompt("a", "double-door cabinet", on_a, off_b)).panel()
    assert cut is not None
    assert cut.width_m == pytest.approx(0.5, abs=6e-3)  # cut along the middle of the seam


@pytest.mark.parametrize("label", [1, 0])
def test_a_click_within_pose_error_of_the_border_changes_nothing(session: GeometricSession, boxes: Boxes, label: int) -> None:
    beside = click_on(boxes[0], (0.508 if label else 0.495, FRONT_Y, 0.3), 60, label)
    panel = session.find(prompt("a", "cabinet", click_on(boxes[0], (0.3, FRONT_Y, 0.4), 60), beside)).panel()
    assert panel is not None
    assert panel.width_m == pytest.approx(0.5, abs=4e-3)


def test_a_negative_click_on_an_occluder_keeps_the_panel_whole(session: GeometricSession, boxes: Boxes) -> None:
    on_post = click_on(boxes[0], (0.67, FRONT_Y - 0.25, 0.5), 60, label=0)
    panel = session.find(prompt("b", "cabinet", click_on(boxes[0], (0.9, FRONT_Y, 0.4), 60), on_post)).panel()
    assert panel is not None
    assert panel.width_m == pytest.approx(0.5, abs=4e-3)


def test_tracks_do_not_depend_on_object_order_or_the_cache(boxes: Boxes, tmp_path: Path, cache: Path) -> None:
    capture = boxes[0]
    first = prompt("door_a", "cabinet", click_on(capture, (0.3, FRONT_Y, 0.4), 60))
    second = prompt("drawer", "drawer", click_on(capture, (1.6, FRONT_Y, 0.2), 80))
    fresh, cached = open_session(capture, tmp_path), open_session(capture, cache)
    forward = [fresh.track(first), fresh.track(second)]
    backward = [cached.track(second), cached.track(first)]
    for a, b in zip(forward, reversed(backward), strict=True):
        assert a.masks == b.masks
        assert a.confidence == b.confidence
        assert a.front is not None
        assert b.front is not None
        assert dataclasses.astuple(a.front)[1:3] == dataclasses.astuple(b.front)[1:3]


def test_the_stream_starts_at_the_click_and_spreads_outwards(session: GeometricSession, boxes: Boxes) -> None:
    order = [index for index, _, _ in session.stream(prompt("a", "cabinet", click_on(boxes[0], (0.3, FRONT_Y, 0.4), 60)))]
    assert order[:3] == [60, 50, 70]
    assert len(order) == len(set(order))


def test_a_panel_clicked_for_two_objects_is_split_at_a_seam(boxes: Boxes, cache: Path) -> None:
    session = open_session(boxes[0], cache)
    assert isinstance(session, GeometricSession)
    doors = two_doors(boxes[0])
    first = session.find(doors[0])
    assert isinstance(first, FoundFront)
    run, apart = first.front.run, [session.panel(door) for door in doors]
    hits = [session.scene.pick(click.frame, click.x, click.y) for door in doors for click in door.points]
    cells = [cell for column, row in run.grid.cells_of(np.array(hits)) if (cell := run.cell_at(column, row)) is not None]
    run.cells = (joined(cells), *(cell for cell in run.cells if cell not in cells))  # an undetected seam
    run.handles = tuple(None for _ in run.cells)

    again = [dataclasses.replace(door, category="base_cabinet") for door in doors]  # found again
    both = [session.panel(door) for door in again]
    assert [panel is not None and panel.width_m > 0.9 for panel in both] == [True, True]
    towel = dataclasses.replace(again[1], category="towel")
    assert session.disputed([again[0], towel]) == {}  # it hangs on the door
    disputed = session.disputed(again)
    assert disputed == {doors[0].name: doors[1].points, doors[1].name: doors[0].points}
    for door, own in zip(again, apart, strict=True):
        panel = session.panel(dataclasses.replace(door, others=disputed[door.name]))
        assert panel is not None
        assert own is not None
        assert panel.width_m == pytest.approx(own.width_m, abs=6e-3)
        np.testing.assert_allclose(panel.world_from_front.translation, own.world_from_front.translation, atol=6e-3)


def test_a_front_without_a_handle_between_fronts_with_one_has_a_warning(boxes: Boxes, cache: Path) -> None:
    session, (_, asked) = open_session(boxes[0], cache), two_doors(boxes[0])
    assert isinstance(session, GeometricSession)
    found = session.find(asked)
    assert isinstance(found, FoundFront)
    assert found.warnings == ()
    run = found.front.run
    run.handles = tuple(None if handle == found.front.handle else handle for handle in run.handles)
    (line,) = session.find(dataclasses.replace(asked, name="bare")).warnings
    assert line.startswith("bare probably has a handle like its neighbours")


def test_separate_neighbours_do_not_dispute_a_panel(session: GeometricSession, boxes: Boxes) -> None:
    assert session.disputed(two_doors(boxes[0])) == {}


def test_fronts_with_unchanged_clicks_are_not_searched_again(
    session: GeometricSession, boxes: Boxes, monkeypatch: pytest.MonkeyPatch
) -> None:
    session.disputed(two_doors(boxes[0]))
    later = dataclasses.replace(session, _found={})
    found: list[str] = []
    find = GeometricSession.find
    monkeypatch.setattr(GeometricSession, "find", lambda self, asked: found.append(asked.name) or find(self, asked))
    changed, kept = two_doors(boxes[0])
    point = dataclasses.replace(changed.points[0], x=changed.points[0].x + 1.0)
    assert later.disputed([dataclasses.replace(changed, points=(point,)), kept]) == {}
    assert found == [changed.name]


def two_doors(capture: Capture) -> list[ObjectPrompt]:
    places = list(DOORS.items())[:2]
    return [prompt(name, "cabinet", click_on(capture, (left + 0.2, FRONT_Y, 0.4), 60)) for name, (left, _) in places]


def test_a_click_just_past_the_edge_selects_the_front(session: GeometricSession, boxes: Boxes) -> None:
    """The click hits a strip lower than any door: the plinth's shadow, or the gap below the worktop."""
    left, width = DOORS["door_a"]
    panel = session.find(prompt("a", "cabinet", click_on(boxes[0], (left + 0.2, FRONT_Y, TOP_M + 0.008), 60))).panel()
    assert panel is not None
    assert panel.height_m == pytest.approx(TOP_M - BOTTOM_M, abs=3e-3)
    assert panel.width_m == pytest.approx(width, abs=3e-3)


@pytest.mark.parametrize(
    ("left", "top", "right", "bottom", "kept"),
    [
        (40, 20, 60, 24, (40, 20, 60, 24)),
        (80, 20, 110, 24, (80, 20, 100, 24)),  # a bar displaced across the edge by parallax
        (104, 20, 112, 28, None),  # the neighbour's knob
        (2, 2, 98, 48, None),  # the raised frame of a framed front
    ],
)
def test_only_a_handle_on_the_panel_is_kept_and_not_its_raised_frame(
    left: float, top: float, right: float, bottom: float, kept: tuple[float, ...] | None
) -> None:
    found = own_handle(GridHandle(left=left, top=top, right=right, bottom=bottom, confidence=0.9), Cell(0, 0, 100, 50))
    assert (found and (found.left, found.top, found.right, found.bottom)) == kept
