from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from r2c2r_core.errors import ObjectNotSeen, PromptError
from r2c2r_core.geometry.masks import pack_mask, unpack_mask
from r2c2r_core.model.capture import Capture
from r2c2r_core.model.inputs import FrameSaid
from r2c2r_core.segment.corrected import corrected_stream
from r2c2r_core.segment.geometric.session import GeometricSession
from r2c2r_core.segment.prompts import check_mask_size, check_prompt, checked_prompts, parse_prompts
from r2c2r_core.segment.stage import track_object
from tests.core.segment.conftest import Truth
from tests.core.segment.scenes import FRONT_Y, HEIGHT, WIDTH, click_on, prompt

Boxes = tuple[Capture, Truth]
SMALL = np.zeros((HEIGHT // 4, WIDTH // 4), bool)
SMALL[10:20, 30:50] = True


def test_corrected_frames_override_and_other_frames_keep_their_masks(session: GeometricSession, boxes: Boxes) -> None:
    found = prompt("door_b", "cabinet", click_on(boxes[0], (0.9, FRONT_Y, 0.4), 60))
    first, second, *others = sorted(session.track(found).masks)
    said = (FrameSaid(frame=first, mask=None), FrameSaid(frame=second, mask=pack_mask(SMALL)))
    track = track_object(session, replace(found, frames=said))
    assert set(track.masks) == {second, *others}
    np.testing.assert_array_equal(unpack_mask(track.masks[second]), np.kron(SMALL, np.ones((4, 4), bool)))
    assert track.confidence[second] == 1.0
    assert track.masks[others[0]] == session.track(found).masks[others[0]]


def test_an_object_marked_absent_in_every_frame_raises(session: GeometricSession, boxes: Boxes) -> None:
    found = prompt("door_b", "cabinet", click_on(boxes[0], (0.9, FRONT_Y, 0.4), 60))
    said = tuple(FrameSaid(frame=frame.index, mask=None) for frame in boxes[0].frames)
    with pytest.raises(ObjectNotSeen, match="visible in 0 frames"):
        track_object(session, replace(found, frames=said))


def test_a_correction_of_an_unknown_frame_is_rejected(session: GeometricSession, boxes: Boxes) -> None:
    found = prompt("door_b", "cabinet", click_on(boxes[0], (0.9, FRONT_Y, 0.4), 60))
    session.find(found)
    with pytest.raises(PromptError, match="frame 61 set right found"):
        session.find(replace(found, frames=(FrameSaid(frame=61, mask=None),)))


@pytest.mark.parametrize("size", [(WIDTH // 4, HEIGHT // 4 - 2), (2 * WIDTH, 2 * HEIGHT)])
def test_a_mask_of_another_aspect_or_larger_than_its_frame_is_rejected(boxes: Boxes, size: tuple[int, int]) -> None:
    found = prompt("door_b", "cabinet", click_on(boxes[0], (0.9, FRONT_Y, 0.4), 60))
    check_prompt(boxes[0], replace(found, frames=(FrameSaid(frame=60, mask=pack_mask(SMALL)),)))
    other = pack_mask(np.ones(size[::-1], bool))
    with pytest.raises(PromptError, match=f"door_b: frame 60: a mask of {size[0]} x {size[1]} found, {WIDTH} x {HEIGHT}"):
        check_prompt(boxes[0], replace(found, frames=(FrameSaid(frame=60, mask=other),)))


@pytest.mark.parametrize("frame_px", [(1920, 1440), (1440, 1920), (1296, 968), (641, 479), (160, 120)])
def test_a_downscaled_mask_rounded_to_whole_pixels_is_accepted(frame_px: tuple[int, int]) -> None:
    for width in (1, 2, 97, frame_px[0] - 1, frame_px[0]):
        height = max(round(frame_px[1] * width / frame_px[0]), 1)
        check_mask_size("", pack_mask(np.ones((height, width), bool)), frame_px)


def test_painted_frames_are_streamed_first_and_only_once() -> None:
    mask, other = pack_mask(SMALL), pack_mask(~SMALL)
    said = (FrameSaid(frame=3, mask=None), FrameSaid(frame=5, mask=mask))
    found = iter([(5, other, 0.4), (3, other, 0.5), (7, other, 0.6)])
    assert list(corrected_stream(found, said)) == [(5, mask, 1.0), (7, other, 0.6)]


def document(**mask: Any) -> dict[str, Any]:
    point = {"frame": 60, "x": 100.0, "y": 50.5, "label": 1}
    frames = [{"frame": 3, "mask": None}, {"frame": 5, "mask": {"width": 4, "height": 2, "runs": [1, 2, 5], **mask}}]
    return {"version": 2, "objects": [{"name": "mug", "category": "mug", "points": [point], "frames": frames}]}


def many_masks(count: int) -> dict[str, Any]:
    mask = {"width": 8000, "height": 8000, "runs": [64_000_000]}
    written = document()
    written["objects"][0]["frames"] = [{"frame": number, "mask": mask} for number in range(count)]
    return written


def test_masks_within_the_total_pixel_limit_are_accepted() -> None:
    assert len(checked_prompts(many_masks(62)).objects[0].frames) == 62


def test_a_mask_is_decoded_from_its_run_lengths() -> None:
    absent, painted = parse_prompts(document()).objects[0].frames
    assert absent == FrameSaid(frame=3, mask=None)
    assert painted.mask is not None
    np.testing.assert_array_equal(unpack_mask(painted.mask), [[False, True, True, False], [False] * 4])


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (document(runs=[1, 2]), "runs of 3 pixels found, 4 x 2 expected"),
        (document(width=20_000, height=20_000, runs=[400_000_000]), "a mask of 20000 x 20000 found, at most 64000000 pixels"),
        (many_masks(63), "masks of 4032000000 pixels in all found, at most 4000000000 expected"),
        ({**document(), "version": 1}, "frames of 'mug' found in version 1, version 2 expected"),
    ],
)
def test_invalid_masks_are_rejected(wrong: dict[str, Any], message: str) -> None:
    with pytest.raises(PromptError, match=message):
        parse_prompts(wrong)
