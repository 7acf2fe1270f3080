"""Learned segmenters end to end without the network: a stand-in model returns true masks with realistic errors."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from r2c2r_core.errors import ObjectNotSeen, PromptError
from r2c2r_core.geometry.masks import mask_iou, unpack_mask
from r2c2r_core.model.capture import Capture
from r2c2r_core.model.inputs import CropBox, ObjectPrompt, PromptPoint
from r2c2r_core.segment.geometric.session import GeometricSession
from r2c2r_core.segment.learned.sam_video import SAM2, Click, Seen
from r2c2r_core.segment.learned.session import LearnedSession
from r2c2r_core.segment.stage import SegmentConfig, open_session
from tests.core.segment.conftest import Filmed, Truth
from tests.core.segment.scenes import DOORS, FRONT_Y, OUT_M, PARCEL_M, click_on, parcel_top, prompt

Boxes = tuple[Capture, Truth]
Spoil = Callable[[int, np.ndarray], np.ndarray]


@dataclass
class TrueMasks:
    """Stand-in for VideoModel: the true masks of one object by position, with errors; counts its calls."""

    masks: list[np.ndarray]
    spoil: Spoil = lambda position, mask: mask
    depth: Spoil = lambda position, mask: mask
    asked: list[int] = field(default_factory=list)

    def follow(
        self, image_at: Callable[[int], np.ndarray], count: int, clicks: Mapping[int, list[Click]], *, channel: str = "rgb"
    ) -> Iterator[Seen]:
        start = list(clicks)[-1]
        for position in sorted(range(count), key=lambda p: (abs(p - start), -p)):
            assert image_at(position).dtype == np.uint8
            self.asked.append(position)
            change = self.depth if channel == "depth" else self.spoil
            yield Seen(position, change(position, self.masks[position]), 0.9)


def opened(session: GeometricSession, model: object, **settings: object) -> LearnedSession:
    config = replace(SegmentConfig(), **settings)  # type: ignore[arg-type]
    return LearnedSession(name="sam2", model=model, prepared=session, config=config)  # type: ignore[arg-type]


def true_masks(boxes: Boxes, name: str) -> list[np.ndarray]:
    return [boxes[1][name][frame.index] for frame in boxes[0].frames]


def ious(boxes: Boxes, name: str, track_masks: Mapping[int, object]) -> list[float]:
    empty = np.zeros_like(boxes[1][name][0])
    return [
        mask_iou(unpack_mask(track_masks[i]) if i in track_masks else empty, truth)  # type: ignore[arg-type]
        for i, truth in boxes[1][name].items()
        if np.count_nonzero(truth) >= 60
    ]


@pytest.fixture
def door(boxes: Boxes) -> ObjectPrompt:
    return prompt("door_b", "cabinet", click_on(boxes[0], (0.95, FRONT_Y, 0.4), 60))


@pytest.fixture
def carton(boxes: Boxes) -> ObjectPrompt:
    return prompt("carton", "box", click_on(boxes[0], (1.06, -0.36, 1.0), 60))


def test_true_masks_of_a_front_give_its_rectangle(session: GeometricSession, boxes: Boxes, door: ObjectPrompt) -> None:
    track = opened(session, TrueMasks(true_masks(boxes, "door_b"))).track(door)
    assert (track.kind, track.backend, track.prompt_count) == ("front", "sam2", 1)
    assert track.front is not None
    left, width = DOORS["door_b"]
    assert track.front.width_m == pytest.approx(width, abs=0.006)  # two mosaic cells
    assert track.front.height_m == pytest.approx(0.74, abs=0.006)
    assert track.front.world_from_front.translation[0] == pytest.approx(left + width / 2, abs=0.006)
    assert track.front.world_from_front.translation[1] == pytest.approx(FRONT_Y, abs=0.01)
    assert np.mean(ious(boxes, "door_b", track.masks)) > 0.97  # fusion does not degrade good masks


def test_true_masks_of_a_thing_give_its_box(session: GeometricSession, boxes: Boxes, carton: ObjectPrompt) -> None:
    track = opened(session, TrueMasks(true_masks(boxes, "carton"))).track(carton)
    assert (track.kind, track.front) == ("thing", None)
    assert track.box is not None
    assert track.box.support_z_m == pytest.approx(0.90, abs=0.012)  # a voxel of the fused surface
    np.testing.assert_allclose(track.box.dimensions_m[[0, 2]], [0.12, 0.20], atol=0.015)
    assert np.mean(ious(boxes, "carton", track.masks)) > 0.95


def test_a_mask_leak_over_a_depth_edge_is_removed(session: GeometricSession, boxes: Boxes, carton: ObjectPrompt) -> None:
    """In one frame of three the mask grows over the background of the carton."""

    def leaking(position: int, mask: np.ndarray) -> np.ndarray:
        return mask if position % 3 else _moved(mask, -30) | mask

    model = TrueMasks(true_masks(boxes, "carton"), leaking)
    raw = opened(session, model, fusion="none").track(carton)
    fused = opened(session, model).track(carton)
    assert min(ious(boxes, "carton", raw.masks)) < 0.75
    assert min(ious(boxes, "carton", fused.masks)) > 0.85


def test_a_frame_lost_by_the_model_is_filled_in_with_a_warning(
    session: GeometricSession, boxes: Boxes, carton: ObjectPrompt
) -> None:
    model = TrueMasks(true_masks(boxes, "carton"), lambda position, mask: mask & (position != 6))
    fused = opened(session, model).track(carton)
    lost = boxes[0].frames[6].index
    assert mask_iou(unpack_mask(fused.masks[lost]), boxes[1]["carton"][lost]) > 0.8
    assert fused.confidence[lost] < 0.5 < fused.confidence[boxes[0].frames[5].index]
    assert any("lost it in" in line for line in fused.warnings)
    assert lost not in opened(session, model, fusion="none").track(carton).masks


def test_depth_mask_fusion_intersects_masks_and_falls_back_to_rgb(
    session: GeometricSession, boxes: Boxes, carton: ObjectPrompt
) -> None:
    """Right of the carton's middle the depth mask is empty; in the first frame it is empty altogether."""

    def half(position: int, mask: np.ndarray) -> np.ndarray:
        columns = np.flatnonzero(mask.any(axis=0))
        kept = mask.copy()
        if len(columns):
            kept[:, columns[0] + round(0.6 * len(columns)) :] = False
        return kept & (position != 0)

    truth = true_masks(boxes, "carton")
    track = opened(session, TrueMasks(truth, depth=half), fusion="depth-mask").track(carton)
    first, later = boxes[0].frames[0].index, boxes[0].frames[6].index
    assert (unpack_mask(track.masks[later]) == half(6, truth[6])).all()
    if first in track.masks:
        assert (unpack_mask(track.masks[first]) == truth[0]).all()
    assert any("disagreed in" in line for line in track.warnings)


def test_the_stream_starts_at_the_clicked_frame_and_reuses_masks(
    session: GeometricSession, boxes: Boxes, carton: ObjectPrompt
) -> None:
    model = TrueMasks(true_masks(boxes, "carton"))
    learned = opened(session, model)
    first = next(learned.stream(carton))
    assert first[0] == 60
    assert model.asked == [6]
    assert (learned.mask_at(carton, 60) == boxes[1]["carton"][60]).all()
    assert model.asked == [6]
    learned.track(carton)
    learned.track(carton)
    assert sorted(model.asked) == list(range(len(boxes[0].frames)))


@pytest.mark.slow
def test_a_thing_in_an_open_drawer_is_measured_where_the_drawer_is_closed(looked_into: Filmed) -> None:
    capture, truth, session = looked_into
    (left, near, bottom), (right, far, top) = PARCEL_M
    parcel = prompt("parcel", "box", click_on(capture, parcel_top(OUT_M), 110))
    track = opened(session, TrueMasks(true_masks((capture, truth), "parcel"))).track(parcel)
    assert track.box is not None
    assert track.box.carrier is not None
    expected = [(left + right) / 2, FRONT_Y + (near + far) / 2, (bottom + top) / 2]
    np.testing.assert_allclose(track.box.world_from_object.translation, expected, atol=0.02)
    assert set(track.masks) <= {frame.index for frame in capture.frames if frame.index >= 100}
    shown = [f for f, mask in truth["parcel"].items() if mask.sum() > 150]
    assert np.mean([mask_iou(unpack_mask(track.masks[f]), truth["parcel"][f]) for f in shown]) > 0.9


def test_a_crop_box_of_a_thing_in_a_drawer_is_where_the_drawer_is_closed(looked_into: Filmed) -> None:
    capture, truth, session = looked_into
    (left, _, bottom), (right, _, _) = PARCEL_M
    learned = opened(session, TrueMasks(true_masks((capture, truth), "parcel")))
    parcel = prompt("parcel", "box", click_on(capture, parcel_top(OUT_M), 110))
    edges = ((0.55 * (right - left), 0.0, 0.0), (0.0, 0.4, 0.0), (0.0, 0.0, 0.4))
    crop = CropBox(corner_capture=(left - 0.02, FRONT_Y, bottom - 0.05), edges_capture=edges)
    whole, half = (learned.mask_at(replace(parcel, crop=box), 110) for box in (None, crop))
    assert 0.2 < np.count_nonzero(half) / np.count_nonzero(whole) < 0.6


@pytest.mark.parametrize(("y", "frame"), [(FRONT_Y, 20), pytest.param(FRONT_Y - OUT_M, 120, marks=pytest.mark.slow)])
def test_a_drawer_open_in_the_last_frames_keeps_its_masks_and_gets_its_motion(y: float, frame: int, drawn_out: Filmed) -> None:
    """Clicked where it is closed, and where it is open."""
    capture, truth, session = drawn_out
    drawer = prompt("drawer_mid", "drawer", click_on(capture, (1.5, y, 0.5), frame))
    track = opened(session, TrueMasks(true_masks((capture, truth), "drawer_mid"))).track(drawer)
    assert track.kind == "front"
    assert track.front is not None
    assert track.front.world_from_front.translation[1] == pytest.approx(FRONT_Y, abs=0.01)
    (motion,) = track.motions
    assert (motion.kind, motion.largest) == ("prismatic", pytest.approx(OUT_M, abs=0.006))
    shown = [f for f, mask in truth["drawer_mid"].items() if mask.sum() > 3000]
    overlap = {f: mask_iou(unpack_mask(track.masks[f]), truth["drawer_mid"][f]) for f in shown}
    assert min(overlap.values()) > 0.9


def test_an_object_the_model_never_sees_is_an_error(session: GeometricSession, boxes: Boxes, carton: ObjectPrompt) -> None:
    model = TrueMasks([np.zeros_like(mask) for mask in true_masks(boxes, "carton")])
    with pytest.raises(ObjectNotSeen, match="carton: sam2 sees it in 0 of 14 frames"):
        opened(session, model).track(carton)


def test_a_nonexistent_frame_is_rejected(session: GeometricSession, boxes: Boxes, carton: ObjectPrompt) -> None:
    with pytest.raises(PromptError, match="frame 7 found"):
        opened(session, TrueMasks(true_masks(boxes, "carton"))).mask_at(carton, 7)


def test_tracking_a_click_in_a_nonexistent_frame_is_rejected(session: GeometricSession, boxes: Boxes) -> None:
    stray = prompt("carton", "box", PromptPoint(frame=7, x=240.0, y=180.0, label=1))
    with pytest.raises(PromptError, match="frame 7"):
        opened(session, TrueMasks(true_masks(boxes, "carton"))).track(stray)


@pytest.mark.slow
def test_the_real_model_class_runs_with_random_weights(session: GeometricSession, boxes: Boxes, carton: ObjectPrompt) -> None:
    """Random masks mean nothing, but all calls are real: RGB-sized masks, one per frame, in the order of the protocol."""
    learned = opened(session, tiny_model(), least_area_px=0)
    found = list(learned.stream(carton))
    assert [frame for frame, _, _ in found][:5] == [60, 70, 50, 80, 40]
    assert len(found) == len(boxes[0].frames)
    assert {(packed.width, packed.height) for _, packed, _ in found} == {(480, 360)}


@pytest.mark.slow
def test_a_session_opens_by_name_from_a_folder_of_weights(boxes: Boxes, tmp_path: Path) -> None:
    weights = tmp_path / "weights"
    tiny_model().model.save_pretrained(weights)
    learned = open_session(boxes[0], tmp_path, "sam2", SegmentConfig(weights=str(weights), least_area_px=0))
    two = prompt("carton", "box", click_on(boxes[0], (1.06, -0.36, 1.0), 60), click_on(boxes[0], (1.3, -0.36, 1.0), 90, 0))
    assert [frame for (frame, _, _), _ in zip(learned.stream(two), range(3), strict=False)] == [90, 60, 100]


def tiny_model() -> Any:
    """The real class with random weights; skips without torch."""
    pytest.importorskip("torch", reason="no torch: pip install --group learned")
    from tests.core.segment.learned.tiny_models import tiny

    return tiny(SAM2)


def _moved(mask: np.ndarray, rows: int) -> np.ndarray:
    return np.roll(mask, rows, axis=0)
