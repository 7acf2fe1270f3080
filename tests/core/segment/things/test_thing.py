import dataclasses

import numpy as np
import pytest

from r2c2r_core.arrays import Mask
from r2c2r_core.errors import ObjectNotSeen, PromptError
from r2c2r_core.geometry.masks import mask_iou, unpack_mask
from r2c2r_core.model.capture import Capture, Frame
from r2c2r_core.model.inputs import PromptPoint
from r2c2r_core.segment.found import View
from r2c2r_core.segment.geometric.finders import _on_thing
from r2c2r_core.segment.geometric.session import GeometricSession
from r2c2r_core.segment.scene import Scene
from r2c2r_core.segment.stage import open_session
from r2c2r_core.segment.things.thing import ThingConfig
from tests.core.segment.conftest import Truth
from tests.core.segment.scenes import FRONT_Y, Pixels, click_on, prompt

Boxes = tuple[Capture, Truth]


def test_a_carton_is_separated_from_the_worktop(session: GeometricSession, boxes: Boxes) -> None:
    capture, truth = boxes
    carton = prompt("carton", "box", click_on(capture, (1.06, -0.36, 1.0), 60))
    track = session.track(carton)
    overlap = [mask_iou(unpack_mask(track.masks[f.index]), truth["carton"][f.index]) for f in capture.frames]
    assert np.mean(overlap) > 0.9
    assert track.kind == "thing"
    assert track.front is None
    assert track.box is not None
    assert track.box.support_z_m == pytest.approx(0.90, abs=0.01)  # a voxel of the fused surface
    assert track.box.dimensions_m[0] == pytest.approx(0.12, abs=0.012)
    assert track.box.dimensions_m[2] == pytest.approx(0.20, abs=0.012)


def test_a_wrong_category_still_gives_a_mask_and_a_warning(session: GeometricSession, boxes: Boxes) -> None:
    track = session.track(prompt("carton", "dishwasher", click_on(boxes[0], (1.06, -0.36, 1.0), 60)))
    assert track.warnings == ("no flat front under the click: treated as a free-standing object (dishwasher)",)
    assert mask_iou(unpack_mask(track.masks[60]), boxes[1]["carton"][60]) > 0.8


def test_a_click_without_surface_raises_with_its_position_and_advice(
    boxes: Boxes, tmp_path_factory: pytest.TempPathFactory
) -> None:
    capture = boxes[0]
    blind = Pixels(capture.images.colours, {k: np.zeros_like(v) for k, v in capture.images.depths.items()})  # type: ignore[attr-defined]
    bare = dataclasses.replace(capture.surface, faces=capture.surface.faces[:0])
    session = open_session(
        dataclasses.replace(capture, images=blind, surface=bare, sha256="blind"), tmp_path_factory.mktemp("blind")
    )
    with pytest.raises(PromptError, match=r"mug: the click at \(240, 180\) on frame 60 hits no surface.*; click where"):
        session.mask_at(prompt("mug", "mug", PromptPoint(frame=60, x=240.0, y=180.0, label=1)), 60)


def test_a_second_click_without_depth_does_not_lose_the_object(
    session: GeometricSession, boxes: Boxes, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, second = (click_on(boxes[0], (1.06, -0.36, height), frame) for height, frame in ((1.0, 60), (1.05, 70)))
    once = session.mask_at(prompt("carton", "box", first), 60)
    seen = Scene.pick
    monkeypatch.setattr(Scene, "pick", lambda self, frame, x, y: None if frame == 70 else seen(self, frame, x, y))
    assert mask_iou(once, session.mask_at(prompt("carton", "box", first, second), 60)) > 0.9


def test_each_point_is_checked_with_the_ray_of_its_own_click(
    session: GeometricSession, boxes: Boxes, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first click on an appliance may hit no surface; the remaining clicks must still belong to their own points."""
    blind, first, second = (click_on(boxes[0], (1.06, -0.36, 1.0), frame) for frame in (50, 60, 70))
    pick, behind = Scene.pick, {70: np.array([1.06, -0.6, 1.4])}  # the third click shows what is behind the thing
    monkeypatch.setattr(
        Scene, "pick", lambda self, frame, x, y: None if frame == 50 else behind.get(frame, pick(self, frame, x, y))
    )
    rays = []
    monkeypatch.setattr(Scene, "ray", lambda self, frame, x, y: rays.append(frame) or (np.zeros(3), np.array([0.0, 1.0, 0.0])))
    _, hits, _ = session._clicked(prompt("oven_1", "microwave", blind, first, second))
    _on_thing(session.scene, hits, ThingConfig(radius_m=0.05))
    assert hits.clicks == (first, second)
    assert rays == [70]


def test_an_object_seen_in_no_frame_raises(session: GeometricSession, boxes: Boxes, monkeypatch: pytest.MonkeyPatch) -> None:
    door = prompt("door_a", "cabinet", click_on(boxes[0], (0.3, FRONT_Y, 0.4), 60))
    strict = dataclasses.replace(session, config=dataclasses.replace(session.config, least_area_px=10**9))
    with pytest.raises(ObjectNotSeen, match="door_a: seen in 0 of 14 frames"):
        strict.track(door)


def test_a_nonexistent_frame_is_rejected(session: GeometricSession, boxes: Boxes) -> None:
    door = prompt("door_a", "cabinet", click_on(boxes[0], (0.3, FRONT_Y, 0.4), 60))
    with pytest.raises(PromptError, match=r"door_a: frame 7 found, a frame of 0\.\.130 expected"):
        session.mask_at(door, 7)


def test_clicks_without_depth_are_in_the_mask_or_out_of_it_as_said(session: GeometricSession, boxes: Boxes) -> None:
    """The carton's upper half is black and returns no light in the clicked frame, and was not found."""
    capture, truth = boxes
    first, on, off = (click_on(capture, (1.06, -0.36, z), 60) for z in (0.95, 1.06, 0.92))
    shown, black = truth["carton"][60], truth["carton"][60].copy()
    black[int((first.y + on.y) / 2) :] = False
    rgb, depth = capture.images.rgb(60).copy(), capture.images.depth(60).metres.copy()
    rgb[black], depth[black[1::2, 1::2]] = 15, 0.0
    scene = Scene(dataclasses.replace(capture, images=Pixels({60: rgb}, {60: depth})), {}, session.scene.parts)

    def mask(*clicks: PromptPoint) -> Mask:
        said = prompt("carton", "box", *clicks)
        return dataclasses.replace(session, scene=scene, _found={said: HalfFound(shown & ~black)}).mask_at(said, 60)

    assert mask_iou(mask(first, on), shown) > 0.95
    cut = mask(first, on, dataclasses.replace(off, label=0))
    assert (cut[int(on.y), int(on.x)], cut[int(off.y), int(off.x)]) == (True, False)


@dataclasses.dataclass(frozen=True)
class HalfFound:
    half: Mask
    kind = "thing"

    def see(self, frame: Frame) -> View:
        return View(self.half, 1.0)
