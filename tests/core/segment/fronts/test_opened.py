from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from r2c2r_core.geometry.masks import mask_iou, unpack_mask
from r2c2r_core.model.inputs import CropBox
from r2c2r_core.model.track import at_rest
from r2c2r_core.segment.stage import open_session
from tests.core.segment.conftest import Filmed
from tests.core.segment.scenes import DOORS, FRONT_Y, OUT_M, PARCEL_M, click_on, kitchen, parcel_top, prompt


@pytest.fixture(scope="module")
def swung(tmp_path_factory: pytest.TempPathFactory) -> Filmed:
    """A door is open for longer than it is closed."""
    capture, truth = kitchen(from_step=4, swung_rad=np.deg2rad(60.0))
    return capture, truth, open_session(capture, tmp_path_factory.mktemp("swung"))


def test_a_drawer_open_in_the_last_frames_is_tracked_and_measured(drawn_out: Filmed) -> None:
    capture, truth, session = drawn_out
    drawer = prompt("drawer_mid", "drawer", click_on(capture, (1.5, FRONT_Y, 0.5), 60))
    track = session.track(drawer)
    shown = [f for f, mask in truth["drawer_mid"].items() if mask.sum() > 3000]
    assert {f for f in shown if f in track.opened_frames} == {f for f in shown if f >= 100}
    (motion,) = track.motions
    assert motion.kind == "prismatic"
    values = [motion.states[f].value for f in shown if f >= 100]
    assert values == pytest.approx([OUT_M] * len(values), abs=0.006)  # 2 mm of depth noise
    overlap = {f: mask_iou(unpack_mask(track.masks[f]), truth["drawer_mid"][f]) for f in shown}
    assert np.mean([overlap[f] for f in shown if f < 100]) > 0.93
    assert np.mean([overlap[f] for f in shown if f >= 100]) > 0.93
    assert track.front is not None
    assert (track.front.width_m, track.front.height_m) == pytest.approx((0.45, 0.297), abs=0.015)


def test_a_thing_in_an_open_drawer_is_measured_where_the_drawer_is_closed(looked_into: Filmed) -> None:
    capture, truth, session = looked_into
    (left, near, bottom), (right, far, top) = PARCEL_M
    track = session.track(prompt("parcel", "box", click_on(capture, parcel_top(OUT_M), 110)))
    assert track.box is not None
    assert track.box.carrier is not None
    assert track.box.carrier.motion.largest == pytest.approx(OUT_M, abs=0.006)
    expected = [(left + right) / 2, FRONT_Y + (near + far) / 2, (bottom + top) / 2]
    np.testing.assert_allclose(track.box.world_from_object.translation, expected, atol=0.02)
    assert set(track.masks) <= {frame.index for frame in capture.frames if frame.index >= 100}
    shown = [f for f, mask in truth["parcel"].items() if mask.sum() > 150]
    assert np.mean([mask_iou(unpack_mask(track.masks[f]), truth["parcel"][f]) for f in shown]) > 0.7
    resting = at_rest(capture, track)
    assert {frame.index for frame in resting.frames} == set(track.masks)
    for frame in resting.frames:  # the camera is as far from the parcel at rest as it was from the parcel drawn out
        moved = frame.world_from_camera.translation - capture.frame(frame.index).world_from_camera.translation
        np.testing.assert_allclose(moved, [0.0, OUT_M, 0.0], atol=0.006)


def test_a_crop_box_of_a_thing_in_a_drawer_is_where_the_drawer_is_closed(looked_into: Filmed) -> None:
    capture, _, session = looked_into
    (left, _, bottom), (right, _, _) = PARCEL_M
    click = click_on(capture, parcel_top(OUT_M), 110)
    edges = ((0.55 * (right - left), 0.0, 0.0), (0.0, 0.4, 0.0), (0.0, 0.0, 0.4))
    crop = CropBox(corner_capture=(left - 0.02, FRONT_Y, bottom - 0.05), edges_capture=edges)
    whole, half = (session.track(replace(prompt("parcel", "box", click), crop=one)) for one in (None, crop))
    assert whole.box is not None
    assert half.box is not None
    assert half.box.carrier is not None
    assert half.box.dimensions_m[0] < 0.7 * whole.box.dimensions_m[0]
    assert all(half.masks[f].area_px < whole.masks[f].area_px for f in half.masks)


def test_a_thing_beside_an_open_drawer_is_not_carried(looked_into: Filmed) -> None:
    capture, _, session = looked_into
    track = session.track(prompt("carton", "carton", click_on(capture, (1.06, -0.36, 1.0), 110)))
    assert track.box is not None
    assert track.box.carrier is None


def test_hinge_and_angle_are_found_for_a_door_open_in_most_frames(swung: Filmed) -> None:
    assert_hinge_and_angle(swung, closed_frame=20, from_frame=40)


@pytest.mark.slow
def test_hinge_and_angle_are_found_for_a_door_open_in_the_last_frames(tmp_path: Path) -> None:
    capture, truth = kitchen(from_step=8, swung_rad=np.deg2rad(60.0))
    assert_hinge_and_angle((capture, truth, open_session(capture, tmp_path)), closed_frame=60, from_frame=80)


def assert_hinge_and_angle(filmed: Filmed, closed_frame: int, from_frame: int) -> None:
    """Check the door that is open by 60 degrees from a frame on, clicked where it is closed."""
    capture, truth, session = filmed
    x, width = DOORS["door_c"]
    door = prompt("door_c", "cabinet", click_on(capture, (x + width / 2, FRONT_Y, 0.5), closed_frame))
    track = session.track(door)
    assert track.opened_frames == {f for f in track.masks if f >= from_frame}  # it is closed before
    (motion,) = track.motions
    np.testing.assert_allclose(motion.axis_world, [0.0, 0.0, -1.0], atol=np.deg2rad(0.5))
    assert motion.pivot_world is not None
    np.testing.assert_allclose(motion.pivot_world[:2], [x, FRONT_Y], atol=0.008)
    angles = np.rad2deg([motion.states[f].value or 0.0 for f in track.opened_frames])
    np.testing.assert_allclose(angles, 60.0, atol=2.0)
    overlap = [mask_iou(unpack_mask(track.masks[f]), truth["door_c"][f]) for f in track.opened_frames]
    assert np.mean(overlap) > 0.85


def test_a_click_on_an_open_drawer_selects_its_closed_front(drawn_out: Filmed) -> None:
    """Clicks on the same front in a frame where it is closed and in one where it is open."""
    capture, _, session = drawn_out
    closed, opened = (
        session.track(prompt("drawer_mid", "drawer", click_on(capture, (1.5, y, 0.5), frame))).front
        for y, frame in ((FRONT_Y, 20), (FRONT_Y - OUT_M, 120))
    )
    assert closed is not None
    assert opened is not None
    np.testing.assert_allclose(opened.world_from_front.matrix, closed.world_from_front.matrix, atol=0.005)
    assert (opened.width_m, opened.height_m) == pytest.approx((closed.width_m, closed.height_m), abs=0.01)


@pytest.mark.parametrize(("swung_deg", "frame"), [(0.0, 20), (60.0, 100)])
def test_a_mostly_open_door_is_found_from_an_open_or_a_closed_click(swung_deg: float, frame: int, swung: Filmed) -> None:
    capture, _, session = swung
    x, width = DOORS["door_c"]
    half = width / 2 * np.array([np.cos(np.deg2rad(swung_deg)), -np.sin(np.deg2rad(swung_deg))])
    door = prompt("door_c", "cabinet", click_on(capture, (x + half[0], FRONT_Y + half[1], 0.5), frame))
    track = session.track(door)
    assert track.front is not None
    np.testing.assert_allclose(track.front.world_from_front.translation[:2], [x + width / 2, FRONT_Y], atol=0.01)
    (motion,) = track.motions
    assert motion.largest == pytest.approx(np.deg2rad(60.0), abs=np.deg2rad(1.0))


def test_an_open_drawer_gets_its_front_at_the_closed_position(drawn_out: Filmed) -> None:
    """For half of the recording the drawer front is a board in the room, on a separate plane."""
    capture, _, session = drawn_out
    drawer = prompt("drawer_mid", "drawer", click_on(capture, (1.5, FRONT_Y - OUT_M, 0.5), 110))
    track = session.track(drawer)
    assert track.front is not None
    np.testing.assert_allclose(track.front.world_from_front.translation[1], FRONT_Y, atol=0.01)
    (motion,) = track.motions
    assert (motion.kind, motion.largest) == ("prismatic", pytest.approx(OUT_M, abs=0.006))
