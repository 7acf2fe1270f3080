"""Scheduling of the live segmenter's desk, with a fake session whose pace the test controls."""

import json
import threading
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from app.jobs import live_segment
from app.jobs.doubts import suggested_category
from app.jobs.live_segment import Desk
from app.jobs.mask_wire import mask_bits
from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.masks import PackedMask, pack_mask
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.inputs import ObjectPrompt, PromptPoint
from r2c2r_core.model.track import FrontPanel
from tests.waiting import PATIENCE_S, until

CAMERA = Intrinsics(fx=50.0, fy=50.0, cx=20.0, cy=15.0, width=40, height=30)
CAPTURE: Any = SimpleNamespace(frames=tuple(SimpleNamespace(index=index, rgb_camera=CAMERA) for index in range(4)))


def mask(size: int) -> PackedMask:
    return pack_mask(np.arange(1200).reshape(30, 40) < size)


class Session:
    """Session of four frames; the area of an object's masks is the x of its last click. The gate blocks its stream."""

    def __init__(self) -> None:
        self.gate = threading.Event()
        self.looked: list[float] = []
        self.painted: list[int] = []  # frames with a painted mask, of the objects streamed
        self.begun = threading.Event()

    def glimpse(self, prompt: ObjectPrompt) -> tuple[int, PackedMask, float]:
        self.looked.append(prompt.points[-1].x)
        return prompt.points[-1].frame, mask(int(prompt.points[-1].x) - (prompt.category == "bottle")), 0.5

    def stream(self, prompt: ObjectPrompt) -> Iterator[tuple[int, PackedMask, float]]:
        self.begun.set()
        self.painted += [one.frame for one in prompt.frames]
        assert self.gate.wait(PATIENCE_S)
        for frame in range(4):
            yield frame, mask(int(prompt.points[-1].x)), 0.5

    def prefetch(self) -> Iterator[None]:
        return iter(())

    def panel(self, prompt: ObjectPrompt) -> None:
        return None

    def thing_box(self, prompt: ObjectPrompt) -> None:
        return None

    def motions(self, prompt: ObjectPrompt) -> tuple[()]:
        return ()

    def propose(self) -> Iterator[Any]:
        return iter([(1.0, ())])


@pytest.fixture
def said(monkeypatch: pytest.MonkeyPatch) -> list[dict[str, Any]]:
    lines: list[dict[str, Any]] = []
    monkeypatch.setattr(live_segment, "_say", lambda **message: lines.append(json.loads(json.dumps(message))))
    return lines


@pytest.fixture
def desk(said: list[dict[str, Any]]) -> Iterator[SimpleNamespace]:
    session, commands = Session(), live_segment.Commands()
    at_work = threading.Thread(target=Desk(session, CAPTURE, 40).answer, args=(commands,))  # type: ignore[arg-type]

    def end() -> None:
        session.gate.set()
        commands.put(None)
        at_work.join(PATIENCE_S)

    yield SimpleNamespace(session=session, put=commands.put, start=at_work.start, end=end)
    end()


def click(number: int, x: float, category: str = "drawer") -> dict[str, Any]:
    point = {"frame": 0, "x": x, "y": 5.0, "label": 1}
    prompt = {"name": f"o{number}", "category": category, "points": [point]}
    return {"cmd": "segment", "object": number, "key": f"{number}-{x:g}", "prompt": prompt}


def test_the_clicked_frame_is_sent_first_and_again_if_its_mask_changes(desk: Any, said: list[dict[str, Any]]) -> None:
    desk.session.gate.set()
    desk.start()
    desk.put(click(1, 20.0))
    until(lambda: said and said[-1].get("end") == "done")
    assert [line.get("frame") for line in said] == [0, 1, 2, 3, None]
    said.clear()
    desk.put(click(2, 20.0, "bottle"))
    until(lambda: said and said[-1].get("end") == "done")
    assert [line.get("frame") for line in said] == [0, 0, 1, 2, 3, None]


def test_a_painted_mask_reaches_the_session_as_evidence_for_the_other_frames(desk: Any, said: list[dict[str, Any]]) -> None:
    desk.session.gate.set()
    desk.start()
    command = click(1, 20.0)
    command["prompt"]["frames"] = [{"frame": 2, "mask": {"width": 40, "height": 30, "runs": [100, 1100]}}]
    desk.put(command)
    until(lambda: said and said[-1].get("end") == "done")
    assert desk.session.painted == [2]
    assert [line.get("frame") for line in said] == [2, 0, 1, 3, None]


def test_a_click_is_answered_while_another_object_is_being_segmented(desk: Any, said: list[dict[str, Any]]) -> None:
    desk.start()
    desk.put(click(1, 20.0))
    assert desk.session.begun.wait(PATIENCE_S)
    desk.put(click(2, 10.0))
    until(lambda: len(said) == 2)
    assert (said[1]["object"], said[1]["frame"]) == (2, 0)


def test_a_newer_click_stops_masks_of_an_older_one_immediately(desk: Any, said: list[dict[str, Any]]) -> None:
    desk.start()
    desk.put(click(1, 20.0))
    assert desk.session.begun.wait(PATIENCE_S)
    desk.put(click(1, 10.0))
    until(lambda: len(said) == 2)
    desk.session.gate.set()
    until(lambda: said[-1].get("end") == "done")
    assert [line["key"] for line in said] == ["1-20"] + ["1-10"] * 5


def test_clicks_replaced_by_a_later_one_are_not_segmented(desk: Any, said: list[dict[str, Any]]) -> None:
    desk.session.gate.set()
    for x in (5.0, 6.0, 7.0):
        desk.put(click(1, x))
    desk.start()
    until(lambda: said and said[-1].get("end") == "done")
    assert desk.session.looked == [7.0]
    assert {line["key"] for line in said} == {"1-7"}


def test_an_object_with_a_failing_mask_or_front_fails_alone(
    desk: Any, said: list[dict[str, Any]], monkeypatch: pytest.MonkeyPatch
) -> None:
    def panel(prompt: ObjectPrompt) -> None:
        if prompt.name == "o1":
            raise MemoryError

    def bits(packed: PackedMask, width: int) -> Any:
        if packed.area_px == 7:
            raise MemoryError
        return mask_bits(packed, width)

    monkeypatch.setattr(desk.session, "panel", panel)
    monkeypatch.setattr(live_segment, "mask_bits", bits)
    monkeypatch.setattr(desk.session, "glimpse", lambda prompt: None)
    desk.session.gate.set()
    desk.start()
    for number, x, end in ((1, 20.0, "failed"), (2, 7.0, "failed"), (3, 10.0, "done")):
        desk.put(click(number, x))
        until(lambda: said and "end" in said[-1])
        assert (said[-1]["object"], said[-1]["end"]) == (number, end)
        said.clear()


def test_an_object_with_a_failing_first_mask_fails_alone(desk: Any, said: list[dict[str, Any]]) -> None:
    desk.session.gate.set()
    desk.start()
    broken = SimpleNamespace(area_px=1, width=80, height=60)  # lacks its bits
    look = desk.session.glimpse
    desk.session.glimpse = lambda prompt: (0, broken, 0.5)
    desk.put(click(1, 20.0))
    until(lambda: said and said[-1].get("end") == "failed")
    desk.session.glimpse = look
    desk.put(click(2, 10.0))
    until(lambda: said[-1].get("end") == "done")


def test_a_front_of_a_size_unlikely_for_its_category_suggests_another() -> None:
    kitchen: Any = SimpleNamespace(room=SimpleNamespace(floor_found=True, walls=()))
    point = PromptPoint(frame=0, x=1.0, y=1.0, label=1)

    def suggested(category: str, height_m: float, centre_m: float) -> str:
        pose = Rigid3(np.eye(3), np.array([0.0, 0.0, centre_m]))
        panel = FrontPanel(world_from_front=pose, width_m=0.45, height_m=height_m, handle=None, confidence=0.9)
        return suggested_category(ObjectPrompt(name="front_1", category=category, points=(point,)), panel, kitchen)

    assert suggested("drawer", 0.57, 1.7) == "wall_cabinet"
    assert suggested("drawer", 0.7, 0.5) == "cabinet"
    assert suggested("drawer", 0.15, 0.7) == ""  # usual
    assert suggested("drawer", 3.0, 1.5) == ""  # usual for nothing


def test_a_cancelled_object_reports_cancelled_as_its_last_message(desk: Any, said: list[dict[str, Any]]) -> None:
    desk.start()
    desk.put(click(1, 20.0))
    assert desk.session.begun.wait(PATIENCE_S)
    desk.put({"cmd": "cancel", "object": 1})
    until(lambda: said[-1].get("end") == "cancelled")
    desk.end()
    assert said[-1].get("end") == "cancelled"
