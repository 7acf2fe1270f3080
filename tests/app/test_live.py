import base64
import threading
import time
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest
from starlette.websockets import WebSocketDisconnect

from app.jobs.live_session import LiveSession
from app.services import masks, prompts
from tests.app.conftest import ORIGIN, SOCKETS, Running

CLICK = {"frame": 3, "x": 80.5, "y": 60.5, "label": 1}
HELD = {**CLICK, "x": 156.5}  # yields one frame and then blocks: tests/app/fakes/live.py


@contextmanager
def listening(web: Running, project: str | None, **query: Any) -> Iterator[Any]:
    asked = "&".join(f"{key}={value}" for key, value in {"project": project, **query}.items() if value is not None)
    with web.client.websocket_connect(f"{SOCKETS}/api/live?{asked}", headers={"origin": ORIGIN}) as socket:
        yield socket


def until(socket: Any, **wanted: Any) -> tuple[list[dict[str, Any]], dict[str, Any]]:
    """Messages up to the one that has these fields."""
    seen: list[dict[str, Any]] = []
    for _ in range(300):
        message = socket.receive_json()
        if all(message.get(key) == value for key, value in wanted.items()):
            return seen, message
        seen.append(message)
    raise AssertionError(f"no message with {wanted}: {[m['type'] for m in seen]}")


def decoded(mask: dict[str, Any]) -> np.ndarray:
    """A mask decoded as in the browser."""
    bits = np.unpackbits(np.frombuffer(zlib.decompress(base64.b64decode(mask["bits"])), np.uint8))
    shape = (mask["box_height"], mask["box_width"])
    return bits[: shape[0] * shape[1]].reshape(shape).astype(bool)


def test_a_click_sends_masks_clicked_frame_first_and_stores_them(start: Callable[..., Any]) -> None:
    with start() as web:
        project = web.sample()
        with listening(web, project) as socket:
            assert socket.receive_json()["type"] == "hello"
            made = web.post(f"/api/projects/{project}/objects", {"category": "drawer", "points": [CLICK]}, 201)
            seen, _ = until(socket, type="segment", object=made["id"], state="done")
            masks = [m for m in seen if m["type"] == "mask"]
            assert [m["frame"] for m in masks] == [3, 0, 7]
            assert masks[0]["mask"]["width"] == 160
            assert decoded(masks[0]["mask"]).sum() == 100
            assert any(m["type"] == "segment" and m["restart"] for m in seen)
            until(socket, type="object")
    with start() as web:  # stored on disk
        (lane,) = [lane for lane in web.get(f"/api/projects/{project}/lanes") if lane["object"] == made["id"]]
        assert (lane["frames"], lane["complete"], lane["source"]) == ([0, 3, 7], True, "live")
        (shown,) = [m for m in web.get(f"/api/projects/{project}/masks/7") if m["object"] == made["id"]]
        assert shown["mask"] == masks[2]["mask"]


def test_the_done_state_is_sent_after_all_mask_updates(web: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    project = web.sample()
    prompts_tell, ended = prompts._tell, threading.Event()

    def tell_late(context: Any, shape: Any) -> Any:
        if shape.segment == "done":
            ended.set()
        elif shape.points:
            ended.wait(0.5)  # masks computed before the end are delivered after it, if possible
        return prompts_tell(context, shape)

    monkeypatch.setattr(prompts, "_tell", tell_late)
    with listening(web, project) as socket:
        made = web.post(f"/api/projects/{project}/objects", {"category": "drawer", "points": [CLICK]}, 201)
        web.until(ended.is_set)
        web.post(f"/api/projects/{project}/comments", {"text": "after it"}, 201)
        seen, _ = until(socket, type="comments")
    told = [m["object"]["segment"] for m in seen if m["type"] == "object" and m["object"]["id"] == made["id"]]
    assert told[-1] == "done"


def test_live_masks_continue_after_an_unexpected_error(web: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    failures, sound = list[dict[str, Any]](), LiveSession.take

    def fail_once(self: LiveSession, line: dict[str, Any]) -> None:
        if "mask" in line and not failures:
            failures.append(line)
            raise RuntimeError("unexpected")
        sound(self, line)

    monkeypatch.setattr(LiveSession, "take", fail_once)
    project = web.sample()
    made = web.post(f"/api/projects/{project}/objects", {"category": "drawer", "points": [CLICK]}, 201)
    web.until(lambda: _object(web, project, made["id"])["segment"] == "done")
    assert len(failures) == 1


def test_a_newer_click_replaces_the_masks_of_an_older_one(web: Running) -> None:
    project = web.sample()
    made = web.post(f"/api/projects/{project}/objects", {"category": "drawer", "points": [HELD]}, 201)
    address = f"/api/projects/{project}/objects/{made['id']}/points/{made['points'][0]['id']}"
    web.until(lambda: _object(web, project, made["id"])["segment"] == "running")
    web.patch(address, {"x": 30.5})
    web.until(lambda: _object(web, project, made["id"])["segment"] == "done")
    (mask,) = [m for m in web.get(f"/api/projects/{project}/masks/3") if m["object"] == made["id"]]
    assert mask["mask"]["left"] == 25


def test_undo_restores_the_older_masks_without_recomputing(web: Running) -> None:
    project = web.sample()
    made = web.post(f"/api/projects/{project}/objects", {"category": "drawer", "points": [CLICK]}, 201)
    number = made["id"]
    web.until(lambda: _object(web, project, number)["segment"] == "done")
    web.patch(f"/api/projects/{project}/objects/{number}/points/{made['points'][0]['id']}", {"x": 30.5})
    web.until(lambda: _object(web, project, number)["segment"] == "done")
    back = web.post(f"/api/projects/{project}/undo", {"object": number})["object"]
    assert (back["segment"], back["mask_frames"]) == ("done", 3)


def test_clicks_without_inference_are_segmented_on_request(web: Running) -> None:
    project = web.sample()
    made = web.post(f"/api/projects/{project}/objects?infer=false", {"category": "drawer", "points": [CLICK]}, 201)
    assert made["segment"] == "none"
    assert web.get(f"/api/projects/{project}/live")["state"] == "off"
    web.post(f"/api/projects/{project}/objects/{made['id']}/segment", status=202)
    web.until(lambda: _object(web, project, made["id"])["segment"] == "done")
    assert web.get(f"/api/projects/{project}/live")["state"] == "ready"


def test_a_click_that_finds_nothing_adds_a_notice_to_the_object(web: Running) -> None:
    project = web.sample()
    points = [{**CLICK, "label": 0}, CLICK]
    made = web.post(f"/api/projects/{project}/objects", {"category": "drawer", "points": points}, 201)
    web.until(lambda: _object(web, project, made["id"])["segment"] == "failed")
    assert _object(web, project, made["id"])["notices"] == ["nothing there; click on it"]


def test_cancelling_keeps_masks_that_are_already_computed(web: Running) -> None:
    project = web.sample()
    made = web.post(f"/api/projects/{project}/objects", {"category": "drawer", "points": [HELD]}, 201)
    web.until(lambda: _object(web, project, made["id"])["mask_frames"] > 0)
    stopped = web.post(f"/api/projects/{project}/objects/{made['id']}/segment/cancel")
    assert stopped["segment"] == "partial"
    assert stopped["mask_frames"] >= 1


def test_unfinished_masks_continue_after_a_normal_restart(start: Callable[..., Any]) -> None:
    with start() as web:
        project = web.sample()
        made = web.post(f"/api/projects/{project}/objects", {"category": "drawer", "points": [HELD]}, 201)
        web.until(lambda: _object(web, project, made["id"])["segment"] == "running")
    with start() as web:
        web.until(lambda: _object(web, project, made["id"])["segment"] == "running")


def test_preparation_and_segmentation_count_as_computing_time(start: Callable[..., Any]) -> None:
    with start() as web:
        project = web.sample()
        before = web.get(f"/api/projects/{project}/figures")["computing_s"]
        preparing = next(web.settings.data_dir.rglob("work")) / "prepare_slowly"
        preparing.touch()
        web.post(f"/api/projects/{project}/live/open")
        began = time.monotonic()
        web.until(lambda: time.monotonic() - began > 1.0)
        preparing.unlink()
        web.until(lambda: web.get(f"/api/projects/{project}/proposals")["state"] == "done")
        web.until(lambda: web.get(f"/api/projects/{project}/figures")["computing_s"] >= before + 1.0)
        ready = web.get(f"/api/projects/{project}/figures")["computing_s"]
        slow = {"category": "drawer", "points": [{**CLICK, "x": 155.5}]}
        made = web.post(f"/api/projects/{project}/objects", slow, 201)
        web.until(lambda: _object(web, project, made["id"])["segment"] == "done")
        web.until(lambda: web.get(f"/api/projects/{project}/figures")["computing_s"] >= ready + 0.3)
    with start() as web:
        assert web.get(f"/api/projects/{project}/figures")["computing_s"] >= ready + 0.3


def test_an_idle_segmenter_is_stopped_and_restarted_by_a_click(
    start: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("app.jobs.live.IDLE_LOOK_S", 0.05)
    with start() as web:
        project = web.sample()
        web.post(f"/api/projects/{project}/live/open")
        web.until(lambda: web.get(f"/api/projects/{project}/proposals")["state"] == "done")
        assert web.get(f"/api/projects/{project}/live")["state"] == "ready"
        web.context.live._sessions[project].used -= web.settings.live_idle_s  # as if idle for that long
        web.until(lambda: web.get(f"/api/projects/{project}/live")["state"] == "off")
        web.post(f"/api/projects/{project}/objects", {"category": "drawer", "points": [CLICK]}, 201)
        web.until(lambda: web.get(f"/api/projects/{project}/live")["state"] == "ready")


def test_preparation_stops_when_the_last_tab_leaves(start: Callable[..., Any], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("app.jobs.live.LEFT_S", 0.3)
    with start() as web:
        project = web.sample()
        unclick(web, project)
        slow = next(web.settings.data_dir.rglob("work")) / "prepare_slowly"
        slow.touch()
        with listening(web, project) as socket:
            socket.receive_json()
            web.post(f"/api/projects/{project}/live/open")
            until(socket, type="live")
            web.until(lambda: web.get(f"/api/projects/{project}/live")["state"] == "preparing")
        web.until(lambda: web.get(f"/api/projects/{project}/live")["state"] == "off")
        slow.unlink()
        web.post(f"/api/projects/{project}/live/open")
        web.until(lambda: web.get(f"/api/projects/{project}/live")["state"] == "ready")


def test_opening_a_recording_segments_its_imported_clicks(web: Running) -> None:
    project = web.sample()
    items = web.get(f"/api/projects/{project}/objects")
    assert [item["segment"] for item in items] == ["none", "none"]
    with listening(web, project) as socket:
        socket.receive_json()
        web.post(f"/api/projects/{project}/live/open")
        told: set[int] = set()  # every tab is notified of them
        while told != {item["id"] for item in items}:
            told.add(until(socket, type="object")[1]["object"]["id"])
    web.until(lambda: {item["segment"] for item in web.get(f"/api/projects/{project}/objects")} == {"done"})


def test_opening_does_not_restart_cancelled_masks(web: Running) -> None:
    project = web.sample()
    at = f"/api/projects/{project}/objects"
    stopped = web.post(at, {"category": "drawer", "points": [HELD]}, 201)["id"]
    web.post(f"{at}/{stopped}/segment/cancel")
    web.post(f"/api/projects/{project}/live/open")
    web.until(lambda: [item["segment"] for item in web.get(at)].count("done") == 2)
    assert web.get(at)[-1]["segment"] == "partial"


def test_an_imported_recording_is_prepared_automatically(start: Callable[..., Any]) -> None:
    with start(prepare_imports=True) as web:
        project = web.sample()
        web.until(lambda: web.get(f"/api/projects/{project}/live")["state"] == "ready")
        web.until(lambda: {item["segment"] for item in web.get(f"/api/projects/{project}/objects")} == {"done"})


def test_only_one_recording_is_prepared_at_a_time(start: Callable[..., Any]) -> None:
    with start() as web:
        first, second = web.sample(), web.sample()
        unclick(web, first)
        slow = next(web.settings.data_dir.glob(f"projects/{first}/work")) / "prepare_slowly"
        slow.touch()
        masks.prepare(web.context, first)
        masks.prepare(web.context, second)
        assert web.context.live.projects == {first}


def unclick(web: Running, project: str) -> None:
    """Delete the sample's own objects, so that no masks are computed for them."""
    for item in web.get(f"/api/projects/{project}/objects"):
        web.delete(f"/api/projects/{project}/objects/{item['id']}")


def test_a_reconnecting_tab_receives_missed_messages_or_a_reset(web: Running) -> None:
    project = web.sample()
    with listening(web, project) as socket:
        hello = socket.receive_json()
        assert hello["reset"] is False
    number = web.get(f"/api/projects/{project}/objects")[0]["id"]
    web.patch(f"/api/projects/{project}/objects/{number}", {"colour": 7})
    with listening(web, project, since=hello["seq"], epoch=hello["epoch"]) as socket:
        assert socket.receive_json()["reset"] is False
        _, message = until(socket, type="object")
        assert (message["object"]["colour"], message["seq"] > hello["seq"]) == (7, True)
    with listening(web, project, since=3, epoch="of-another-server") as socket:
        assert socket.receive_json()["reset"] is True


def test_job_messages_reach_every_tab_and_masks_only_watching_tabs(web: Running) -> None:
    first, second = web.sample(), web.sample()
    with listening(web, second) as socket:
        socket.receive_json()
        made = web.post(f"/api/projects/{first}/objects", {"category": "drawer", "points": [CLICK]}, 201)
        web.until(lambda: _object(web, first, made["id"])["segment"] == "done")
        web.post(f"/api/projects/{first}/run", {}, 202)
        seen, message = until(socket, type="job")
        assert message["job"]["project"] == first
        assert not [m for m in seen if m["type"] in ("mask", "object", "segment")]
        socket.send_json({"type": "watch", "project": first})
        socket.send_text("not json")
        socket.send_json(["not", "a", "table"])
        web.until(lambda: web.get(f"/api/jobs?project={first}")[0]["state"] == "done")
        web.patch(f"/api/projects/{first}/objects/{made['id']}", {"colour": 3})
        until(socket, type="object")


BAD = (
    '{"type": "watch", "page": "' + "\\ud800" + '"}',
    '{"type": "watch", "page": "anywhere"}',
    '{"type": "watch", "project": "../x"}',
    '{"type": "watch", "project": {"a": 1}}',
    '{"type": "watch", "object": 9223372036854775808}',
    '{"type": "watch", "object": -1}',
    '{"type": "watch", "object": 1e400}',
    '{"type": "shout"}',
    '{"type": "watch", "more": 1}',
    "not json",
    '["not", "a", "table"]',
    "[" * 900,
    "x" * 100_000,
    "",
)


def test_an_invalid_message_is_answered_to_its_sender_only(web: Running) -> None:
    project = web.sample()
    with listening(web, project) as other, listening(web, project) as socket:
        for message in BAD:
            socket.send_text(message)
            _, answer = until(socket, type="refused")
            assert len(answer["message"]) < 200
            assert '"type": "watch"' in answer["hint"]
        socket.send_bytes(b"\xff\x00")
        until(socket, type="refused")
        number = web.get(f"/api/projects/{project}/objects")[0]["id"]
        web.patch(f"/api/projects/{project}/objects/{number}", {"colour": 5})
        until(socket, type="object")
        seen, _ = until(other, type="object")
        assert {message["type"] for message in seen} <= {"hello", "project", "presence"}


def test_the_number_of_tabs_of_a_person_is_limited(web: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("app.routes.live.MOST_TABS", 2)
    with listening(web, None) as first, listening(web, None) as second:
        first.receive_json(), second.receive_json()
        with listening(web, None) as third, pytest.raises(WebSocketDisconnect) as closed:
            third.receive_json()
        assert (closed.value.code, "close some" in closed.value.reason) == (4429, True)
    web.until(lambda: web.context.hub.tabs_of("tester") == 0)
    with listening(web, None) as again:
        assert again.receive_json()["type"] == "hello"


def _object(web: Running, project: str, number: int) -> Any:
    (found,) = [o for o in web.get(f"/api/projects/{project}/objects") if o["id"] == number]
    return found
