"""Masks painted in one frame as evidence for the others, and clicks on objects that have no flat front."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from r2c2r_core.arrays import Mask
from r2c2r_core.errors import ObjectNotSeen
from r2c2r_core.geometry.camera import project
from r2c2r_core.geometry.masks import mask_iou, pack_mask, unpack_mask
from r2c2r_core.model.capture import Capture
from r2c2r_core.model.inputs import FrameSaid, ObjectPrompt
from r2c2r_core.model.track import MaskTrack
from r2c2r_core.segment.geometric.session import GeometricSession
from r2c2r_core.segment.occlusion import fill_polygon
from r2c2r_core.segment.stage import open_session, track_object
from tests.core.segment.conftest import Filmed, Truth
from tests.core.segment.scenes import FRONT_Y, GLAZED_M, GLAZED_Y, HOOD_CANOPY, HOOD_CHIMNEY, click_on, glazed, hood, prompt
from tests.core.segment.test_scene import HOB_HIGH, HOB_LOW, TABLE_M, with_hob

Boxes = tuple[Capture, Truth]


@pytest.fixture(scope="module")
def kitchen_hood(tmp_path_factory: pytest.TempPathFactory) -> Filmed:
    capture, truth = hood()
    return capture, truth, open_session(capture, tmp_path_factory.mktemp("hood"))


@pytest.fixture(scope="module")
def glass(tmp_path_factory: pytest.TempPathFactory) -> Filmed:
    capture, truth = glazed()
    return capture, truth, open_session(capture, tmp_path_factory.mktemp("glass"))


def painted(found: ObjectPrompt, frame: int, mask: Mask) -> ObjectPrompt:
    return replace(found, frames=(FrameSaid(frame=frame, mask=pack_mask(mask)),))


def overlaps(track: MaskTrack, truth: dict[int, np.ndarray]) -> list[float]:
    """IoU in every frame."""
    return [mask_iou(unpack_mask(track.masks[frame]), mask) if frame in track.masks else 0.0 for frame, mask in truth.items()]


def test_a_mask_painted_round_a_hood_in_one_frame_holds_in_all(kitchen_hood: Filmed) -> None:
    capture, truth, session = kitchen_hood
    clicked = prompt("hood", "hood", click_on(capture, HOOD_CANOPY, 30))
    track = track_object(session, painted(clicked, 30, truth["hood"][30]))
    assert min(overlaps(track, truth["hood"])) > 0.85
    assert track.box is not None
    np.testing.assert_allclose(track.box.dimensions_m, [0.6, 0.24, 0.5], atol=0.03)


@pytest.mark.parametrize("point", [HOOD_CHIMNEY, HOOD_CANOPY])
def test_one_click_finds_a_hoods_chimney_and_canopy_without_the_cabinet_beside(
    kitchen_hood: Filmed, point: tuple[float, float, float]
) -> None:
    capture, truth, session = kitchen_hood
    track = track_object(session, prompt("hood", "hood", click_on(capture, point, 30)))
    assert min(overlaps(track, truth["hood"])) > 0.7


def test_a_click_on_a_glass_hob_finds_the_hob_in_all_frames(tmp_path: Path) -> None:
    capture = with_hob(opening=False)
    session = open_session(capture, tmp_path)
    track = track_object(session, prompt("hob", "hob", click_on(capture, (0.35, 0.0, TABLE_M), 0)))
    (left, near), (right, far) = HOB_LOW, HOB_HIGH
    corners = np.array([[x, y, TABLE_M] for x, y in ((left, near), (right, near), (right, far), (left, far))])
    for frame in (frame for frame in capture.frames if frame.world_from_camera.translation[0] > 1):  # carton and chair behind
        # the hole in the depth is open by a few pixels less at its corners
        assert mask_iou(unpack_mask(track.masks[frame.index]), outlined(capture, corners, frame.index)) > 0.65
    assert track.box is not None
    np.testing.assert_allclose(np.sort(track.box.dimensions_m[:2]), [0.3, 0.3], atol=0.03)


def test_a_click_on_a_bottle_beside_missing_depth_takes_no_part_of_the_worktop(tmp_path: Path) -> None:
    """A bottle's dark foot lacks depth like the worktop around it, but no bottle lies flat in a worktop."""
    capture = with_hob(opening=False)
    session = open_session(capture, tmp_path)
    with pytest.raises(ObjectNotSeen):
        track_object(session, prompt("bottle", "bottle", click_on(capture, (0.35, 0.0, TABLE_M), 0)))


def test_a_painted_rectangle_replaces_the_front_under_the_click(session: GeometricSession, boxes: Boxes) -> None:
    capture, _ = boxes
    corners = np.array([[x, FRONT_Y, z] for x, z in ((0.1, 0.8), (0.4, 0.8), (0.4, 0.3), (0.1, 0.3))])
    clicked = prompt("part", "cabinet", click_on(capture, (0.25, FRONT_Y, 0.5), 60))
    panel = session.find(painted(clicked, 60, outlined(capture, corners, 60))).panel()
    assert panel is not None
    assert (panel.width_m, panel.height_m) == pytest.approx((0.3, 0.5), abs=0.01)  # a pixel at 1.3 m, on either side


def test_a_painted_mask_that_trims_a_front_leaves_the_other_frames_alone(session: GeometricSession, boxes: Boxes) -> None:
    capture, truth = boxes
    clicked = prompt("door_b", "cabinet", click_on(capture, (0.9, FRONT_Y, 0.4), 60))
    assert session.find(painted(clicked, 60, truth["door_b"][60])) is session.find(clicked)


@pytest.mark.parametrize("height_m", [0.85, 1.4])
def test_a_rectangle_painted_round_a_glazed_door_is_the_door_though_the_click_went_through_its_glass(
    glass: Filmed, height_m: float
) -> None:
    capture, _, session = glass
    left, width, bottom, height = GLAZED_M
    right, top = left + width, bottom + height
    corners = np.array([[x, GLAZED_Y, z] for x, z in ((left, top), (right, top), (right, bottom), (left, bottom))])
    clicked = prompt("door", "wall cabinet", click_on(capture, (left + width / 2, GLAZED_Y, height_m), 60))
    panel = session.find(painted(clicked, 60, outlined(capture, corners, 60))).panel()
    assert panel is not None
    assert (panel.width_m, panel.height_m) == pytest.approx((width, height), abs=0.01)  # a pixel at 1.6 m, on either side
    np.testing.assert_allclose(panel.world_from_front.translation, corners.mean(axis=0), atol=0.01)
    for frame in (0, 60, 130):  # the panes are the door's, whatever is seen through them
        assert (
            mask_iou(
                session.mask_at(painted(clicked, 60, outlined(capture, corners, 60)), frame), outlined(capture, corners, frame)
            )
            > 0.9
        )


def outlined(capture: Capture, corners: np.ndarray, frame_index: int) -> Mask:
    frame = capture.frame(frame_index)
    camera = frame.rgb_camera
    outline = project(frame.world_from_camera.inverse.apply(corners), camera)
    return fill_polygon(outline, (0, 0, camera.width, camera.height))
