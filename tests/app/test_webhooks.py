"""Webhooks: stored with the change, signed, retried, and sent to internal addresses only if allowed."""

import hashlib
import hmac
import json
import socket
import ssl
import threading
from collections.abc import Callable, Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import pytest
from sqlmodel import select

from app import posting
from app.db.engine import reading, writing
from app.db.tables import Delivery, Project
from app.errors import Forbidden
from app.services import posting as sender
from r2c2r_core.errors import InputError
from tests.app.conftest import Running
from tests.app.people import signed_in, with_accounts
from tests.app.tls import certificate
from tests.waiting import LOOK_S, held

HERE = "127.0.0.0/8"


class Listening(BaseHTTPRequestHandler):
    """HTTP handler that records posts and responds with the test's next status."""

    heard: list[tuple[dict[str, str], bytes]]
    statuses: list[int]

    def do_POST(self) -> None:
        content = self.rfile.read(int(self.headers["content-length"]))
        self.heard.append(({name.lower(): value for name, value in self.headers.items()}, content))
        self.send_response(self.statuses.pop(0) if self.statuses else 204)
        self.send_header("Location", "/elsewhere")
        self.end_headers()

    def log_message(self, *_: object) -> None:
        pass


@pytest.fixture
def listener() -> Iterator[tuple[str, type[Listening]]]:
    handler = type("OfThisTest", (Listening,), {"heard": [], "statuses": []})
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_address[1]}/hook?lab=1", handler
        server.shutdown()


def _change_and_refuse(web: Running, project: str) -> None:
    with writing(web.context.engine) as session:
        row = session.get_one(Project, project)
        row.review_state = "ready"
        session.add(row)
        session.flush()
        raise InputError("after all not")


def run_of(web: Running, project: str) -> Any:
    return web.job(web.post(f"/api/projects/{project}/run", {}, 202)["id"], "done", "failed")


def test_finished_runs_and_state_changes_are_posted_with_a_signature(
    start: Callable[..., Any], listener: tuple[str, type[Listening]]
) -> None:
    url, handler = listener
    with start(webhooks_to=HERE) as web:
        project = web.sample()
        hook = web.post("/api/webhooks", {"url": url}, 201)
        job = run_of(web, project)
        web.post(f"/api/projects/{project}/review", {"from_state": "draft", "to": "ready", "reason": "so"})
        web.until(lambda: len(handler.heard) == 2)
        headers, content = handler.heard[0]
        signed = hmac.new(hook["secret"].encode(), headers["x-r2c2r-timestamp"].encode() + b"." + content, hashlib.sha256)
        assert headers["x-r2c2r-signature"] == f"sha256={signed.hexdigest()}"
        said = [json.loads(content) for _, content in handler.heard]
        assert [(each["event"], each["project"], each["state"]) for each in said] == [
            ("run.finished", project, "done"),
            ("state.changed", project, "ready"),
        ]
        assert said[0]["job"] == job["id"]
        web.until(lambda: web.get(f"/api/webhooks/{hook['id']}/deliveries")[0]["answer"] == "204")
        shown = web.get("/api/webhooks")[0]
        assert (shown["answer"], "secret" in shown) == ("204", False)
        assert web.client.delete(f"/api/webhooks/{hook['id']}").status_code == 204
        assert web.get("/api/webhooks") == []


def test_a_failed_delivery_is_retried_after_a_restart(
    start: Callable[..., Any], listener: tuple[str, type[Listening]], monkeypatch: pytest.MonkeyPatch
) -> None:
    url, handler = listener
    handler.statuses = [500]
    with start(webhooks_to=HERE) as web:
        project = web.sample()
        hook = web.post("/api/webhooks", {"url": url, "project": project}, 201)["id"]
        run_of(web, project)
        web.until(lambda: web.get(f"/api/webhooks/{hook}/deliveries")[0]["answer"] == "500")
        waiting = web.get(f"/api/webhooks/{hook}/deliveries")[0]
        assert waiting["attempts"] == 1
        assert waiting["due"] > waiting["created"]
        with writing(web.context.engine) as session:
            row = session.exec(select(Delivery)).one()
            row.due = 0.0
            session.add(row)
    with start(webhooks_to=HERE) as web:
        web.until(lambda: web.get(f"/api/webhooks/{hook}/deliveries")[0]["delivered"] is not None)
        assert [content for _, content in handler.heard] == [handler.heard[0][1]] * 2


def test_a_test_delivery_is_posted_once_for_any_response(
    start: Callable[..., Any], listener: tuple[str, type[Listening]]
) -> None:
    url, handler = listener
    handler.statuses = [500, 204]
    with start(webhooks_to=HERE) as web:
        hook = web.post("/api/webhooks", {"url": url}, 201)["id"]
        for answer in ("500", "204"):
            made = web.post(f"/api/webhooks/{hook}/test", None, 201)
            assert (made["event"], made["attempts"]) == ("test", 0)
            web.until(lambda answer=answer: web.get(f"/api/webhooks/{hook}/deliveries")[0]["answer"] == answer)
            assert web.get(f"/api/webhooks/{hook}/deliveries")[0]["due"] is None
        assert [json.loads(content)["event"] for _, content in handler.heard] == ["test", "test"]
        assert web.client.post("/api/webhooks/99/test").status_code == 404


def test_retry_pauses_grow_and_end_after_about_two_days() -> None:
    pauses = [sender.pause_s(attempt) for attempt in range(1, sender.TRIES)]
    assert pauses == sorted(pauses)
    assert 36 * 3600 < sum(pauses) < 60 * 3600


def test_a_rolled_back_change_creates_no_delivery(start: Callable[..., Any]) -> None:
    with start() as web:
        project = web.sample()
        web.post("/api/webhooks", {"url": "https://lab.example/"}, 201)
        with pytest.raises(InputError):
            _change_and_refuse(web, project)
        with reading(web.context.engine) as session:
            assert session.exec(select(Delivery)).all() == []


@pytest.mark.parametrize(
    "url",
    [
        "http://127.0.0.1:1/",
        "http://localhost:1/",
        "http://[::1]:1/",
        "http://[::ffff:127.0.0.1]:1/",
        "http://10.1.2.3/",
        "http://169.254.169.254/latest/meta-data",
        "http://0.0.0.0:1/",
        "http://224.0.0.1/",
        "http://[fe80::1]/",
        "http://[fec0::1]/",
        "http://[::10.0.0.1]/",
        "http://[2002:7f00:1::1]/",
        "http://[64:ff9b::a00:1]/",
        "http://[64:ff9b:1::a00:1]/",
        "http://2130706433:1/",
    ],
)
def test_internal_addresses_are_never_connected_to(url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    connected: list[Any] = []
    monkeypatch.setattr(posting.socket, "create_connection", lambda *given, **_: connected.append(given))
    with pytest.raises(Forbidden, match="not a public address"):
        posting.post(url, b"{}", {})
    assert connected == []


def test_a_host_name_is_resolved_once_against_dns_rebinding(monkeypatch: pytest.MonkeyPatch) -> None:
    looked: list[str] = []

    def changes(host: str, port: int, **_: Any) -> list[Any]:
        looked.append(host)
        address = "93.184.216.34" if len(looked) == 1 else "127.0.0.1"
        return [(socket.AF_INET, socket.SOCK_STREAM, 6, "", (address, port))]

    def connect(address: tuple[str, int], **_: Any) -> Any:
        raise OSError(address[0])

    monkeypatch.setattr(posting.socket, "getaddrinfo", changes)
    monkeypatch.setattr(posting.socket, "create_connection", connect)
    with pytest.raises(OSError, match=r"93\.184\.216\.34"):
        posting.post("http://rebinding.example/", b"{}", {})


def test_a_webhook_redirect_is_not_followed(listener: tuple[str, type[Listening]]) -> None:
    url, handler = listener
    handler.statuses = [307]
    assert posting.post(url, b"{}", {}, posting.networks(HERE)) == 307
    assert len(handler.heard) == 1


def _dripping(listening: socket.socket, ended: threading.Event, encrypted: ssl.SSLContext | None) -> None:
    """Answer one connection with one byte every LOOK_S: no single read times out."""
    connection, _ = listening.accept()
    try:
        with encrypted.wrap_socket(connection, server_side=True) if encrypted else connection as made:
            while not ended.wait(LOOK_S):
                made.sendall(b"H")
    except OSError:  # the other end closed the connection, as expected
        return


@pytest.mark.parametrize("scheme", ["http", "https"])
def test_a_slow_response_does_not_exceed_the_total_timeout(
    scheme: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(posting, "TOTAL_S", 0.3)
    made, key = certificate(tmp_path)
    trusting, serving = ssl.create_default_context(cafile=made), ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    serving.load_cert_chain(made, key)
    monkeypatch.setattr(posting.ssl, "create_default_context", lambda: trusting)
    with socket.create_server(("127.0.0.1", 0)) as listening, held() as ended:
        given = (listening, ended, serving if scheme == "https" else None)
        thread = threading.Thread(target=_dripping, args=given, daemon=True)
        thread.start()
        with pytest.raises((OSError, posting.http.client.HTTPException)):
            posting.post(f"{scheme}://127.0.0.1:{listening.getsockname()[1]}/", b"{}", {}, posting.networks(HERE))
        thread.join()


def test_a_slow_receiver_delays_only_its_own_messages(start: Callable[..., Any], monkeypatch: pytest.MonkeyPatch) -> None:
    under_way: list[str] = []

    def post(url: str, *_: Any) -> int:
        under_way.append(url)
        if "slow" in url:
            ended.wait()
        return 204

    monkeypatch.setattr(sender, "post", post)
    monkeypatch.setattr(sender, "STOP_S", 0.1)
    with held() as ended:
        with start() as web:
            for path in ("1", "2", "3", "4", "5"):
                web.post("/api/webhooks", {"url": f"https://slow.example/{path}"}, 201)
            quick = web.post("/api/webhooks", {"url": "https://quick.example/"}, 201)["id"]
            for hook in web.get("/api/webhooks"):
                web.post(f"/api/webhooks/{hook['id']}/test", None, 201)
            web.until(lambda: web.get(f"/api/webhooks/{quick}/deliveries")[0]["answer"] == "204")
            assert sum("slow" in url for url in under_way) == 1  # one message a host
        assert not ended.is_set()  # the server stopped although a receiver had not answered


@pytest.mark.parametrize("url", ["file:///etc/passwd", "ftp://a.example", "https://", "https://a:b@c.example", "http://a b/"])
def test_an_invalid_webhook_address_is_refused(web: Running, url: str) -> None:
    assert web.client.post("/api/webhooks", json={"url": url}).status_code == 422


def test_webhooks_are_managed_by_project_owners_and_admins(tmp_path: Path) -> None:
    with with_accounts(tmp_path / "data") as web:
        with signed_in(web, "the-annotator") as owner:
            project = owner.post("/api/projects/sample", json={}).json()["id"]
            assert owner.post("/api/webhooks", json={"url": "https://a.example/"}).status_code == 403
            hook = owner.post("/api/webhooks", json={"url": "https://a.example/", "project": project}).json()["id"]
        with signed_in(web, "the-reviewer") as other:
            wish = {"url": "https://b.example/", "project": project}
            assert other.post("/api/webhooks", json=wish).status_code == 403
            assert other.get("/api/webhooks").json() == []
            assert other.get(f"/api/webhooks/{hook}/deliveries").status_code == 404
            assert other.delete(f"/api/webhooks/{hook}").status_code == 404
        with signed_in(web, "the-admin") as admin:
            assert [each["owner"] for each in admin.get("/api/webhooks").json()] == ["the-annotator"]
            assert admin.delete(f"/api/webhooks/{hook}").status_code == 204
