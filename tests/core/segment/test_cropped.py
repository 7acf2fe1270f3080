"""A crop box limits the masks and the size of an object, whatever was found beyond it."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from r2c2r_core.errors import ObjectNotSeen, PromptError
from r2c2r_core.geometry.transforms import Rigid3, rotation_about_z
from r2c2r_core.model.capture import Capture
from r2c2r_core.model.inputs import CropBox
from r2c2r_core.segment.cropped import cropped_mask, world_crop
from r2c2r_core.segment.geometric.session import GeometricSession
from r2c2r_core.segment.prompts import checked_prompts, parse_prompts
from tests.core.segment.conftest import Truth
from tests.core.segment.scenes import FRONT_Y, click_on, prompt

Boxes = tuple[Capture, Truth]
EDGES = ((0.3, 0.0, 0.0), (0.0, 0.3, 0.0), (0.0, 0.0, 0.3))
UPPER = CropBox(corner_capture=(0.9, -0.45, 1.02), edges_capture=EDGES)  # of the carton, which reaches from 0.90 to 1.10 m


def test_a_crop_box_limits_the_size_and_masks_of_an_object(session: GeometricSession, boxes: Boxes) -> None:
    capture, _ = boxes
    carton = prompt("carton", "box", click_on(capture, (1.06, -0.36, 1.06), 60))
    whole, upper = session.track(carton), session.track(replace(carton, crop=UPPER))
    assert whole.box is not None
    assert upper.box is not None
    assert whole.box.dimensions_m[2] == pytest.approx(0.20, abs=0.012)  # a voxel
    assert upper.box.dimensions_m[2] == pytest.approx(0.08, abs=0.012)
    assert upper.box.support_z_m == pytest.approx(1.02, abs=1e-9)
    found = session.mask_at(replace(carton, crop=UPPER), 60)
    assert 0.25 < found.sum() / session.mask_at(carton, 60).sum() < 0.6
    assert not (found & ~session.mask_at(carton, 60)).any()


def test_surfaces_behind_the_crop_box_are_excluded_from_the_mask(boxes: Boxes) -> None:
    capture = boxes[0]
    frame = capture.frame(60)
    crop = world_crop(CropBox(corner_capture=(0.9, -0.45, 0.93), edges_capture=EDGES), Rigid3())
    everything = np.ones((frame.rgb_camera.height, frame.rgb_camera.width), bool)
    kept = cropped_mask(everything, frame, capture.images.depth(60).metres, crop)
    carton = boxes[1]["carton"][60]
    assert (kept & carton).sum() > 0.75 * carton.sum()
    assert (kept & carton).sum() > 0.9 * kept.sum()  # its silhouette covers three times as much wall


def test_a_crop_box_keeps_its_place_when_the_world_is_rotated(boxes: Boxes) -> None:
    turn = Rigid3(rotation_about_z(0.7), np.array([1.0, -2.0, 0.3]))
    crop = world_crop(UPPER, turn)
    points = np.array([[1.0, -0.3, 1.1], [1.0, -0.3, 1.01], [0.89, -0.3, 1.1]])
    assert crop.holds(turn.apply(points)).tolist() == [True, False, False]
    assert crop.bottom_m == pytest.approx(1.32)


def test_a_crop_box_that_misses_the_object_raises(session: GeometricSession, boxes: Boxes) -> None:
    carton = prompt("carton", "box", click_on(boxes[0], (1.06, -0.36, 1.06), 60))
    beside = replace(UPPER, corner_capture=(0.0, -0.45, 1.02))
    with pytest.raises(ObjectNotSeen, match=r"carton: 0 of its \d+ points lie in its crop box"):
        session.track(replace(carton, crop=beside))


def test_a_crop_box_on_a_front_is_rejected(session: GeometricSession, boxes: Boxes) -> None:
    door = prompt("door_b", "cabinet", click_on(boxes[0], (0.9, FRONT_Y, 0.4), 60))
    with pytest.raises(PromptError, match="a crop box of a 'cabinet' found"):
        session.find(replace(door, crop=UPPER))


def document(version: int = 3, **crop: Any) -> dict[str, Any]:
    point = {"frame": 60, "x": 100.0, "y": 50.5, "label": 1}
    box = {"corner_m": [0.9, -0.45, 1.02], "edges_m": [list(edge) for edge in EDGES], **crop}
    return {"version": version, "objects": [{"name": "mug", "category": "mug", "points": [point], "crop": box}]}


def test_a_crop_box_is_read_from_a_version_3_file() -> None:
    assert parse_prompts(document()).objects[0].crop == UPPER


@pytest.mark.parametrize(
    ("written", "message"),
    [
        (document(version=2), "a crop box of 'mug' found in version 2, version 3 expected"),
        (document(edges_m=[[0.3, 0.0, 0.0], [0.1, 0.3, 0.0], [0.0, 0.0, 0.3]]), "edges of no box found"),
        (document(edges_m=[[0.3, 0.0, 0.0], [0.0, 0.3, 0.0], [0.0, 0.0, 0.001]]), "a crop box's edge of 0.001 m found"),
    ],
)
def test_invalid_crop_boxes_are_rejected(written: dict[str, Any], message: str) -> None:
    with pytest.raises(PromptError, match=message):
        checked_prompts(written)
