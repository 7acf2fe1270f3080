from dataclasses import replace

import numpy as np
import pytest

from r2c2r_core.errors import ObjectNotSeen, PromptError
from r2c2r_core.geometry.masks import mask_iou
from r2c2r_core.model.capture import Capture
from r2c2r_core.model.inputs import DrawnFront, DrawnHandle, ObjectPrompt
from r2c2r_core.segment.geometric.session import GeometricSession
from tests.core.segment.conftest import Truth
from tests.core.segment.scenes import BOTTOM_M, DOORS, DRAWERS, FRONT_Y, TOP_M, click_on

Boxes = tuple[Capture, Truth]


def drawn(capture: Capture, left: float, right: float, bottom: float, top: float, **more: object) -> DrawnFront:
    corners = np.array([[left, FRONT_Y, top], [right, FRONT_Y, top], [right, FRONT_Y, bottom], [left, FRONT_Y, bottom]])
    there = capture.world_from_capture.inverse.apply(corners)
    return DrawnFront(corners_capture=tuple((x, y, z) for x, y, z in there.tolist()), **more)  # type: ignore[arg-type]


def prompted(category: str, front: DrawnFront) -> ObjectPrompt:
    return ObjectPrompt(name="it", category=category, points=(), front=front)


def test_a_drawn_front_keeps_its_rectangle_within_a_tenth_of_a_millimetre(session: GeometricSession, boxes: Boxes) -> None:
    # where there is no line: half of one door and half of the next
    front = drawn(boxes[0], 0.251, 0.7533, 0.1307, 0.8011)
    track = session.track(prompted("cabinet", front))
    panel = track.front
    assert panel is not None
    assert (panel.width_m, panel.height_m) == pytest.approx((0.5023, 0.6704), abs=1e-4)
    np.testing.assert_allclose(panel.world_from_front.translation, [0.50215, FRONT_Y, 0.4659], atol=1e-4)
    assert panel.confidence == 1.0
    assert track.kind == "front"


def test_masks_of_a_drawn_front_cover_only_its_visible_part(session: GeometricSession, boxes: Boxes) -> None:
    capture, truth = boxes
    left, width = DOORS["door_b"]
    track = session.track(prompted("cabinet", drawn(capture, left, left + width, BOTTOM_M, TOP_M)))
    assert set(track.masks) == {frame.index for frame in capture.frames}
    for frame in capture.frames:
        mask = session.mask_at(prompted("cabinet", drawn(capture, left, left + width, BOTTOM_M, TOP_M)), frame.index)
        assert mask_iou(mask, truth["door_b"][frame.index]) > 0.94  # without the post before it


def test_the_handle_of_a_drawn_front_is_found_drawn_or_omitted(session: GeometricSession, boxes: Boxes) -> None:
    left, width, bottom, height = DRAWERS["drawer_mid"]
    front = drawn(boxes[0], left, left + width, bottom, bottom + height)
    found = session.find(prompted("drawer", front)).panel()
    assert found is not None
    assert found.handle is not None
    np.testing.assert_allclose(found.handle.centre, (0, 0), atol=8e-3)
    box = DrawnHandle(left_m=-0.1, bottom_m=0.05, right_m=0.14, top_m=0.07)
    placed = session.find(prompted("drawer", replace(front, handle=box))).panel()
    assert placed is not None
    assert placed.handle is not None
    np.testing.assert_allclose(placed.handle.centre, (0.02, 0.06), atol=1e-6)
    assert (found.handle.source, placed.handle.source) == ("measured", "person")
    assert placed.handle.protrusion_source == "default"
    bare = session.find(prompted("drawer", replace(front, handle="none"))).panel()
    assert bare is not None
    assert bare.handle is None


def test_clicks_do_not_move_a_drawn_front(session: GeometricSession, boxes: Boxes) -> None:
    front = drawn(boxes[0], 0.25, 0.75, 0.2, 0.8)
    clicked = replace(prompted("cabinet", front), points=(click_on(boxes[0], (1.2, FRONT_Y, 0.4), 60),))
    panel = session.find(clicked).panel()
    assert panel is not None
    assert panel.width_m == pytest.approx(0.5, abs=1e-4)


def test_a_drawn_front_seen_in_no_frame_raises(session: GeometricSession, boxes: Boxes) -> None:
    with pytest.raises(ObjectNotSeen, match="seen in 0 of"):
        session.track(prompted("cabinet", drawn(boxes[0], 40.0, 40.5, 0.2, 0.8)))


def test_a_drawn_front_on_a_thing_is_rejected(session: GeometricSession, boxes: Boxes) -> None:
    with pytest.raises(PromptError, match="a front drawn of a 'bottle' found"):
        session.find(prompted("bottle", drawn(boxes[0], 0.25, 0.75, 0.2, 0.8)))


def test_an_appliance_gets_a_box_behind_its_drawn_front(session: GeometricSession, boxes: Boxes) -> None:
    track = session.track(prompted("refrigerator", drawn(boxes[0], 0.25, 0.75, 0.2, 0.8)))
    assert track.kind == "appliance"
    assert track.box is not None
    assert track.box.dimensions_m[[0, 2]] == pytest.approx([0.5, 0.6], abs=1e-4)


def test_elevations_are_to_scale_in_capture_coordinates(session: GeometricSession, boxes: Boxes) -> None:
    capture = boxes[0]
    first = next(session.elevations())
    lefts = np.array(sorted({cell[0] for cell in first.cells}))[:, None] * first.cell_m
    corners = capture.world_from_capture.apply(first.origin_capture + lefts * first.right_capture)
    np.testing.assert_allclose(corners[:, 1], FRONT_Y, atol=3e-3)
    for left, _ in DOORS.values():
        assert np.abs(corners[:, 0] - left).min() < 5e-3
    down = capture.world_from_capture.rotation @ first.down_capture
    assert down[2] == pytest.approx(-1.0, abs=1e-3)
    assert first.picture.shape[1] == first.upright.clarity.shape[1]
    assert first.picture.shape[0] == first.level.clarity.shape[1]
    # seams are visible in the profile that edges snap to
    profile = first.upright.clarity.mean(axis=0)
    seams = [round((edge - corners[0, 0] + lefts[0, 0]) / first.cell_m) for edge in (0.5015, 1.0045)]
    assert all(profile[seam - 2 : seam + 3].max() > 3 * np.median(profile) + 10 for seam in seams)
