import http.client
import io
import json
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from starlette.testclient import TestClient
from starlette.types import Message, Receive, Scope, Send
from starlette.websockets import WebSocketDisconnect
from uvicorn.protocols.utils import ClientDisconnected
from websockets.sync.client import connect

from app.db.engine import reading, writing
from app.db.queries import newest_bundle, project_row
from app.errors import Unavailable
from app.services import marks
from app.settings import Settings
from app.viewer import contract, worker
from app.viewer.client import Viewer
from tests.app.conftest import ORIGIN, PATIENT, SOCKETS, Running, fake, running
from tests.app.nouns import finish
from tests.app.test_jobs import run
from tests.waiting import PATIENCE_S

PROTOCOL = "viser-v1.1.1"
STANDING = np.eye(4).tolist()
MOVED = [[0.0, -1.0, 0.0, 0.3], [1.0, 0.0, 0.0, 2.0], [0.0, 0.0, 1.0, 0.5], [0.0, 0.0, 0.0, 1.0]]


@pytest.fixture
def seen(tmp_path: Path) -> Iterator[Running]:
    """An app whose viewer is a stand-in with an echoing upstream."""
    viewer = Viewer(Settings(data_dir=tmp_path / "data", **PATIENT), fake("viewer"))
    with running(tmp_path / "data", viewer=viewer) as web:
        yield web


def test_the_viewer_page_is_proxied_with_headers_for_embedding(seen: Running) -> None:
    session = seen.post(f"/api/projects/{seen.sample()}/viewer")
    assert session["state"] == "ready"
    page = seen.client.get(session["url"])
    assert page.text.startswith("<html><head><script>document.hasFocus=()=>true</script><script src=")
    assert "[data-floating-window]" in page.text
    policy = page.headers["content-security-policy"]
    assert "worker-src blob:" in policy
    assert "frame-ancestors 'self'" in policy
    assert page.headers["x-content-type-options"] == "nosniff"


def test_websocket_messages_are_proxied_both_ways_with_the_subprotocol(seen: Running) -> None:
    url = seen.post(f"/api/projects/{seen.sample()}/viewer")["url"].rstrip("/")
    with seen.client.websocket_connect(SOCKETS + url, subprotocols=[PROTOCOL], headers={"origin": ORIGIN}) as socket:
        assert socket.accepted_subprotocol == PROTOCOL
        socket.send_bytes(b"\0\1" * 40_000)
        assert socket.receive_bytes() == b"\0\1" * 40_000
        socket.send_text("hello")
        assert socket.receive_text() == "hello"


def test_the_number_of_3d_view_connections_of_a_person_is_limited(seen: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("app.viewer.client.MOST_CONNECTIONS", 2)
    url = seen.post(f"/api/projects/{seen.sample()}/viewer")["url"].rstrip("/")

    def connecting() -> Any:
        return seen.client.websocket_connect(SOCKETS + url, subprotocols=[PROTOCOL], headers={"origin": ORIGIN})

    with connecting(), connecting():
        with pytest.raises(WebSocketDisconnect) as refused, connecting():
            pass
        assert (refused.value.code, "you already have 2 3D views" in refused.value.reason) == (4429, True)
    seen.until(lambda: not seen.context.viewer._connections)
    with connecting() as again:
        again.send_text("hello")
        assert again.receive_text() == "hello"


def test_a_connection_that_is_gone_before_its_answer_leaves_no_traceback(seen: Running) -> None:
    ended: list[BaseException] = []

    async def cut(scope: Scope, receive: Receive, send: Send) -> None:
        async def gone(_: Message) -> None:
            raise ClientDisconnected

        try:
            await seen.app(scope, receive, gone)
        except Exception as error:
            ended.append(error)
        await send({"type": "websocket.close"})

    client = TestClient(cut, base_url=ORIGIN, cookies=seen.client.cookies)
    with pytest.raises(WebSocketDisconnect), client.websocket_connect(f"{SOCKETS}/viewer/none", headers={"origin": ORIGIN}):
        pass
    assert [type(error) for error in ended] == [ClientDisconnected]  # which the server ends silently


def test_findings_and_comments_of_one_place_share_a_label_off_what_they_are_about(seen: Running) -> None:
    project = seen.sample()
    seen.job(run(seen, project), "done")
    finish(seen.settings.data_dir / "projects" / project / "work")
    points = ([0.0, 0.0, 1.0], [0.02, 0.0, 1.0], [2.0, 0.0, 1.0])
    for point in points:
        seen.post(f"/api/projects/{project}/comments", {"text": "too wide", "point_world": point}, 201)
    findings = [
        {"severity": "warning", "where": "drawer_1_slide", "message": f"collides with its neighbour when {k} cm open"}
        for k in range(3)
    ]
    with writing(seen.context.engine) as session:
        bundle = newest_bundle(session, project)
        assert bundle is not None
        bundle.certificate = {"passed": True, "findings": findings}
        session.add(bundle)
    with reading(seen.context.engine) as session:
        files = seen.context.files(project_row(session, project))
        found, _ = marks.marks(session, files, project, "drawer_1")
    labels = [mark for mark in found if mark.get("text")]
    assert [mark["text"] for mark in labels] == ["3 findings", "2 comments", "tester"]
    assert labels[0]["at"][2] > 0.1  # m, half the drawer's height: above its front
    assert [mark["at"] for mark in found if mark.get("pin")] == [list(point) for point in points]


def test_signing_out_closes_the_3d_view(seen: Running) -> None:
    url = seen.post(f"/api/projects/{seen.sample()}/viewer")["url"].rstrip("/")
    with seen.client.websocket_connect(SOCKETS + url, subprotocols=[PROTOCOL], headers={"origin": ORIGIN}) as socket:
        assert seen.client.post("/api/logout").status_code == 204
        with pytest.raises(WebSocketDisconnect) as closed:
            socket.receive_bytes()
    assert closed.value.code == 4401


def test_a_viewer_token_is_valid_for_its_own_session_only(seen: Running) -> None:
    url = seen.post(f"/api/projects/{seen.sample()}/viewer")["url"]
    other = TestClient(seen.app, base_url=ORIGIN, headers={"X-Requested-With": "t"})
    other.get(seen.printed())
    assert other.get(url).status_code == 403
    opening = other.websocket_connect(SOCKETS + url.rstrip("/"), headers={"origin": ORIGIN})
    with pytest.raises(WebSocketDisconnect) as refused, opening:
        pass
    assert refused.value.code == 4403
    assert seen.client.get("/viewer/madeup/").status_code == 403


def test_the_same_session_receives_the_same_viewer_token(seen: Running) -> None:
    project = seen.sample()
    assert seen.post(f"/api/projects/{project}/viewer")["url"] == seen.post(f"/api/projects/{project}/viewer")["url"]


def test_a_crashed_viewer_is_reported_and_restarted(seen: Running) -> None:
    project = seen.sample()
    url = seen.post(f"/api/projects/{project}/viewer")["url"]
    seen.post(f"/api/projects/{project}/viewer/show", {"mode": "cloud", "opacity": 0.123}, 503)  # kills the stand-in
    assert seen.client.get(url).status_code == 200
    assert seen.post(f"/api/projects/{project}/viewer")["url"] == url


def test_a_failed_viewer_offers_a_fallback_page_and_image(start: Callable[..., Any], tmp_path: Path) -> None:
    broken = Viewer(Settings(data_dir=tmp_path / "data", **PATIENT), (sys.executable, "-c", "raise SystemExit(3)"))
    with start(viewer=broken) as web:
        project = web.sample()
        web.job(run(web, project), "done")
        session = web.post(f"/api/projects/{project}/viewer")
        assert (session["state"], session["url"]) == ("down", None)
        assert session["message"]
        assert web.client.get(session["fallback_page"]).status_code == 200
        assert web.client.get(session["fallback_image"]).status_code == 200


def test_an_idle_view_is_closed_and_reopens_on_request(tmp_path: Path) -> None:
    viewer = Viewer(Settings(data_dir=tmp_path / "data", **PATIENT, viewer_idle_s=0.0), fake("viewer"))
    with running(tmp_path / "data", viewer=viewer) as web:
        project = web.sample()
        url = web.post(f"/api/projects/{project}/viewer")["url"]
        opening = web.client.websocket_connect(SOCKETS + url, subprotocols=[PROTOCOL], headers={"origin": ORIGIN})
        with opening as socket:
            viewer.close_idle()
            socket.send_text("still there")
            assert socket.receive_text() == "still there"
            assert web.client.get(url).status_code == 200
        web.until(lambda: not any(view.watching for view in viewer._views.values()))
        viewer.close_idle()
        assert web.client.get(url).status_code == 200
        assert web.post(f"/api/projects/{project}/viewer")["url"] == url


def test_a_view_closed_before_a_request_reaches_it_is_reopened(seen: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    project, viewer = seen.sample(), seen.context.viewer
    show = f"/api/projects/{project}/viewer/show"
    seen.post(show, {"mode": "cloud"})
    (view,) = viewer._views.values()
    ask, closings = viewer._ask, [0]  # how often it is closed as idle before the request

    def ask_late(command: dict[str, Any]) -> dict[str, Any]:
        if command["cmd"] != "open" and closings[0] > 0:
            closings[0] -= 1
            ask({"cmd": "close", "view": view.name})
        return ask(command)

    monkeypatch.setattr(viewer, "_ask", ask_late)
    for path, body in (("show", {"mode": "cloud"}), ("joints", {"values": {"door": 0.5}}), ("place", {"pose": None})):
        closings[0] = 1
        seen.post(f"/api/projects/{project}/viewer/{path}", body, 200)
    closings[0] = 99
    refused = seen.post(show, {"mode": "cloud"}, 503)
    assert (refused["kind"], "closed meanwhile" in refused["message"]) == ("unavailable", True)


def test_viewer_commands_are_validated_and_forwarded(seen: Running) -> None:
    project = seen.sample()
    seen.post(f"/api/projects/{project}/viewer")
    shown = seen.post(f"/api/projects/{project}/viewer/show", {"mode": "cloud"})
    assert shown["mode"] == "cloud"
    moved = seen.post(f"/api/projects/{project}/viewer/joints", {"values": {"door": 0.5}})
    assert moved["joints"] == [{"name": "door", "lower": 0.0, "upper": 1.0, "value": 0.5}]
    nowhere = {"content": '{"values": {"door": NaN}}', "headers": {"content-type": "application/json"}}
    assert seen.client.post(f"/api/projects/{project}/viewer/joints", **nowhere).status_code == 422
    assert seen.post(f"/api/projects/{project}/viewer/show", {"mode": "dance"}, 422)["kind"] == "invalid"


def test_each_session_has_its_own_view(seen: Running) -> None:
    project = seen.sample()
    other = TestClient(seen.app, base_url=ORIGIN, headers={"X-Requested-With": "t"})
    other.get(seen.printed())
    mine, theirs = (client.post(f"/api/projects/{project}/viewer").json()["url"] for client in (seen.client, other))
    assert mine != theirs
    show = f"/api/projects/{project}/viewer/show"
    assert seen.post(show, {"mode": "cloud"})["text"] == "shown 1 times"
    assert other.post(show, json={"mode": "cloud"}).json()["text"] == "shown 1 times"
    assert seen.post(show, {"mode": "cloud"})["text"] == "shown 2 times"


def test_a_slow_scene_delays_no_other_view(seen: Running) -> None:
    viewer, folder = seen.context.viewer, seen.settings.data_dir
    for session in ("a", "b"):
        viewer.open("p", folder, session)
    shown: list[dict[str, Any]] = []
    wish = {"mode": "cloud", "opacity": 0.222}  # answered after the next command
    thread = threading.Thread(target=lambda: shown.append(viewer.show("p", folder, "a", wish)), daemon=True)
    thread.start()
    process = viewer._worker
    assert process is not None
    seen.until(lambda: process._waiting)
    assert viewer.move("p", folder, "b", {"door": 0.5})["text"] == "moved"
    thread.join(PATIENCE_S)
    assert [answer["mode"] for answer in shown] == ["cloud"]


def test_the_viewer_process_answers_other_views_during_a_slow_command(monkeypatch: pytest.MonkeyPatch) -> None:
    lines = [{"key": "k"}, {"id": 1, "cmd": "show", "view": "a"}, {"id": 2, "cmd": "camera", "view": "b"}]
    answered = threading.Event()

    def show(*_: Any) -> dict[str, Any]:
        return {"after": answered.wait(PATIENCE_S)}

    def camera(*_: Any) -> dict[str, Any]:
        answered.set()
        return {}

    monkeypatch.setattr(worker, "_COMMANDS", {"show": show, "camera": camera})
    monkeypatch.setattr("sys.stdin", io.StringIO("".join(json.dumps(line) + "\n" for line in lines)))
    monkeypatch.setattr("sys.stdout", said := io.StringIO())
    assert worker.main() == 0
    answers = {answer["id"]: answer for answer in map(json.loads, said.getvalue().splitlines())}
    assert answers == {1: {"id": 1, "ok": {"after": True}}, 2: {"id": 2, "ok": {}}}


def test_a_restarted_view_shows_its_last_content(seen: Running) -> None:
    project = seen.sample()
    show = f"/api/projects/{project}/viewer/show"
    seen.post(show, {"mode": "cloud"})
    assert seen.context.viewer._worker
    seen.context.viewer._worker.kill()
    seen.until(lambda: not (seen.context.viewer._worker and seen.context.viewer._worker.alive))
    assert seen.post(show, {"mode": "cloud"})["text"] == "shown 2 times"  # the first one repeated the last view


def test_the_least_recently_used_view_is_evicted(seen: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("app.viewer.client.MOST_VIEWS", 2)
    viewer, folder = seen.context.viewer, seen.settings.data_dir
    tokens = [viewer.open("p", folder, session) for session in ("a", "b")]
    with viewer.watched(tokens[0], "ann"):
        viewer.open("p", folder, "c")
        assert [view.session for view in viewer._views.values() if view.port] == ["a", "c"]
        with viewer.watched(viewer.open("p", folder, "c"), "bob"), pytest.raises(Unavailable, match="2 people"):
            viewer.open("p", folder, "d")


def test_the_installed_viser_fulfils_the_contract() -> None:
    assert contract.check() == []


def test_the_raw_viewer_port_requires_the_key() -> None:
    server = contract.open_server("the-key")
    try:
        port = server.get_port()
        assert _status(port, {}) == 403
        assert _status(port, {contract.KEY_HEADER: "guess"}) == 403
        assert _status(port, {contract.KEY_HEADER: "the-key"}) == 200
        with pytest.raises(Exception, match="403"):
            connect(f"ws://127.0.0.1:{port}/", subprotocols=[PROTOCOL], origin="http://evil.example", proxy=None)  # type: ignore[list-item,arg-type]
        key = {contract.KEY_HEADER: "the-key"}
        with connect(f"ws://127.0.0.1:{port}/", subprotocols=[PROTOCOL], additional_headers=key, proxy=None) as socket:  # type: ignore[list-item]
            assert socket.subprotocol == PROTOCOL
    finally:
        server.stop()


def _status(port: int, headers: dict[str, str]) -> int:
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=PATIENCE_S)
    try:
        connection.request("GET", "/", headers=headers)
        return connection.getresponse().status
    finally:
        connection.close()


def test_the_real_viewer_shows_cloud_candidate_placement_and_scene(web: Running) -> None:
    project = web.sample()
    web.job(run(web, project), "done")
    finish(web.settings.data_dir / "projects" / project / "work")
    (drawer,) = [o["id"] for o in web.get(f"/api/projects/{project}/objects") if o["name"] == "drawer_1"]
    url = web.post(f"/api/projects/{project}/viewer")["url"]
    assert "document.hasFocus" in web.client.get(url).text
    show = f"/api/projects/{project}/viewer/show"
    assert "500 of 500 points" in web.post(show, {"mode": "cloud"})["text"]
    assert "c1" in web.post(show, {"mode": "candidate", "object": drawer, "candidate": "c1"})["text"]
    assert "1 placed mesh" in web.post(show, {"mode": "aligned", "opacity": 0.5})["text"]
    scene = web.post(show, {"mode": "scene", "draw": "colliders"})
    assert scene["joints"] == [{"name": "drawer_1_slide", "lower": 0.0, "upper": 0.4, "value": 0.0}]
    moved = web.post(f"/api/projects/{project}/viewer/joints", {"values": {"drawer_1_slide": 9.0}})
    assert moved["joints"][0]["value"] == 0.4  # clamped
    web.post(f"/api/projects/{project}/viewer/joints", {"values": {"absent": 1.0}}, 422)
    place = f"/api/projects/{project}/viewer/place"
    assert web.post(place, {"pose": None})["pose"] is None  # no object is being moved
    web.post(place, {"pose": MOVED}, 422)
    web.post(show, {"mode": "aligned", "object": drawer, "box": {"pose": STANDING, "size": [0.5, 0.6, 0.2]}})
    assert web.post(place, {"pose": None})["pose"] == STANDING
    assert np.allclose(web.post(place, {"pose": MOVED})["pose"], MOVED, atol=1e-6)  # single precision in transit
    web.post(place, {"pose": [[0.0] * 4] * 3}, 422)
    web.post(show, {"mode": "aligned", "object": drawer + 1}, 409)
    with web.client.websocket_connect(SOCKETS + url, subprotocols=[PROTOCOL], headers={"origin": ORIGIN}) as socket:
        assert len(socket.receive_bytes()) > 0
