from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any
from urllib.parse import parse_qs, urlsplit

import pytest
from sqlmodel import select
from starlette.testclient import TestClient
from starlette.websockets import WebSocketDisconnect

from app.db.engine import reading
from app.db.tables import SignIn
from app.errors import NoSpace
from tests.app.conftest import COOKIE, ORIGIN, SOCKETS, Running


def fresh(web: Running, **options: Any) -> TestClient:
    """A client without a session, for the same app."""
    return TestClient(web.app, base_url=options.pop("base_url", ORIGIN), raise_server_exceptions=False, **options)


def refused(code: int) -> Any:
    return pytest.raises(WebSocketDisconnect, check=lambda error: error.code == code)


def test_requests_without_a_session_are_refused_or_sent_to_the_login(shared_web: Running) -> None:
    other = fresh(shared_web, headers={"X-Requested-With": "tests"})
    for path in (
        "/api/projects",
        "/api/system",
        "/api/openapi.json",
        "/media/x/thumbnail.jpg",
        "/viewer/t/",
    ):
        assert other.get(path).status_code == 401, path
    for page in ("/", "/p/x/annotate"):
        answer = other.get(page, follow_redirects=False)
        assert (answer.status_code, answer.headers["location"]) == (303, f"/login?next={page}")
    shared = other.get("/p/x/review?object=3&frame=7", follow_redirects=False)
    assert parse_qs(urlsplit(shared.headers["location"]).query) == {"next": ["/p/x/review?object=3&frame=7"]}
    assert other.post("/api/projects/sample", json={}).status_code == 401
    assert other.get("/api/health").json() == {"state": "ok"}


def test_the_printed_token_is_exchanged_for_a_cookie_and_a_clean_url(shared_web: Running) -> None:
    other = fresh(shared_web)
    address = f"/p/abc/annotate{shared_web.printed()[1:]}"
    answer = other.get(address, follow_redirects=False)
    assert (answer.status_code, answer.headers["location"]) == (303, "/p/abc/annotate")
    cookie = answer.headers["set-cookie"].lower()
    assert cookie.startswith("r2c2r_session_8000=")
    assert "httponly" in cookie
    assert "samesite=lax" in cookie
    assert other.get("/api/projects").status_code == 200
    again = other.get(address, follow_redirects=False)  # reopening it in the browser that used it is harmless
    assert (again.status_code, again.headers["location"]) == (303, "/p/abc/annotate")
    assert "set-cookie" not in again.headers


def test_a_printed_address_signs_in_one_browser_only(shared_web: Running) -> None:
    address = shared_web.printed()
    with ThreadPoolExecutor(8) as crowd:
        opened = list(crowd.map(lambda _: fresh(shared_web).get(address, follow_redirects=False).status_code, range(8)))
    assert sorted(opened) == [303] + [401] * 7
    page = fresh(shared_web).get(address)
    assert "r2c2r key" in page.text
    assert "<form>" in page.text


def test_servers_on_different_ports_use_different_cookies(web: Running) -> None:
    there = fresh(web, base_url="http://127.0.0.1:9000", headers={"X-Requested-With": "tests"})
    there.cookies = web.client.cookies  # browsers send cookies to every port
    assert there.get("/api/projects").status_code == 401
    there.get(web.printed())
    assert {cookie.name for cookie in there.cookies.jar} == {"r2c2r_session_8000", "r2c2r_session_9000"}
    assert there.post("/api/logout").status_code == 204
    assert web.client.get("/api/projects").status_code == 200


def test_hsts_is_sent_over_tls_and_camera_and_microphone_are_denied(shared_web: Running) -> None:
    plain, tls = (
        shared_web.client.get("/api/health").headers,
        fresh(shared_web, base_url="https://127.0.0.1:8000").get("/api/health").headers,
    )
    assert "strict-transport-security" not in plain
    assert tls["strict-transport-security"] == "max-age=31536000"
    for headers in (plain, tls):
        assert "camera=(), microphone=()" in headers["permissions-policy"]


def test_signing_out_ends_the_session_also_on_a_full_disk(web: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    other = fresh(web, headers={"X-Requested-With": "tests"})
    other.get(web.printed())
    cookie = other.cookies[COOKIE]
    with monkeypatch.context() as patch:
        patch.setattr("app.services.people.writing", full_disk)
        assert other.post("/api/logout").status_code == 204
        other.cookies.set(COOKIE, cookie)
        assert other.get("/api/projects").status_code == 401
    stored = {row.digest for row in sessions(web)}
    web.context.people.forget_ended()
    gone = stored - {row.digest for row in sessions(web)}
    assert len(gone) == 1  # the row is removed too, once there is space
    assert other.get("/api/projects").status_code == 401


@contextmanager
def full_disk(_: Any) -> Iterator[Any]:
    raise NoSpace("the disk is full", hint="free some space")
    yield


def sessions(web: Running) -> list[SignIn]:
    with reading(web.context.engine) as session:
        return list(session.exec(select(SignIn)))


@pytest.mark.parametrize("token", ["wrong", "x" * 4_000, "é"])
def test_a_wrong_launch_token_is_unauthorized(shared_web: Running, token: str) -> None:
    answer = fresh(shared_web).get("/", params={"token": token}, follow_redirects=False)
    assert answer.status_code == 401
    assert "set-cookie" not in answer.headers


@pytest.mark.parametrize("value", ["", "x", "x.y", "." * 50, f"{'a' * 22}.{'0' * 64}", "ä.ö"])
def test_an_invalid_session_cookie_is_unauthorized(shared_web: Running, value: str) -> None:
    other = fresh(shared_web)
    assert other.get("/api/projects", headers={"cookie": f"{COOKIE}={value}".encode()}).status_code == 401


def test_a_session_survives_a_server_restart(start: Callable[..., Any]) -> None:
    with start() as web:
        cookie = web.client.cookies[COOKIE]
    with start() as web:
        other = fresh(web, cookies={COOKIE: cookie})
        assert other.get("/api/projects").status_code == 200


@pytest.mark.parametrize("others", ['a={"b": [1, 2]}; ', "plain; ", "x=\x01; ", 'q="half; '])
def test_cookies_of_other_apps_do_not_break_the_session(shared_web: Running, others: str) -> None:
    cookie = shared_web.client.cookies[COOKIE]
    headers = {"cookie": f"{others}{COOKIE}={cookie}; theirs=2".encode()}
    assert fresh(shared_web).get("/api/projects", headers=headers).status_code == 200


def test_the_session_cookie_is_not_stored_in_plain_text(shared_web: Running) -> None:
    stored = b"".join(path.read_bytes() for path in shared_web.settings.data_dir.glob("r2c2r.db*"))
    assert shared_web.client.cookies[COOKIE].encode() not in stored


@pytest.mark.parametrize("host", ["evil.example", "127.0.0.1.evil.example", "", "[::1", "localhost.evil:8000", "10.0.0.7:8000"])
def test_requests_for_other_host_names_are_refused(shared_web: Running, host: str) -> None:
    assert shared_web.client.get("/api/projects", headers={"host": host}).status_code == 421


@pytest.mark.parametrize("host", ["localhost:8000", "127.0.0.1", "[::1]:8000", "LOCALHOST:1"])
def test_requests_for_loopback_host_names_are_answered(shared_web: Running, host: str) -> None:
    assert shared_web.client.get("/api/health", headers={"host": host}).status_code == 200


@pytest.mark.parametrize(
    "origin", ["http://evil.example", "null", "http://127.0.0.1:9999", "http://localhost:8000", "http://["]
)
def test_requests_from_other_sites_are_refused(shared_web: Running, origin: str) -> None:
    for method, path in (("POST", "/api/projects/sample"), ("GET", "/api/projects"), ("DELETE", "/api/projects/x")):
        answer = shared_web.client.request(method, path, headers={"origin": origin})
        assert answer.status_code == 403, (method, path)
        assert answer.json()["kind"] == "forbidden"


def test_state_changing_requests_need_a_header_that_forms_cannot_send(web: Running) -> None:
    del web.client.headers["X-Requested-With"]
    for method in ("POST", "PATCH", "PUT", "DELETE"):
        answer = web.client.request(method, "/api/projects/x", headers={"origin": ORIGIN})
        assert answer.status_code == 403, method
    assert web.client.get("/api/projects").status_code == 200


@pytest.mark.parametrize("headers", [{}, {"origin": "http://evil.example"}, {"origin": "null"}])
def test_websockets_from_other_origins_are_refused(shared_web: Running, headers: dict[str, str]) -> None:
    for path in ("/api/live", "/viewer/token"):
        with (
            refused(4403),
            shared_web.client.websocket_connect(SOCKETS + path, headers=headers),
        ):
            pass


def test_a_websocket_needs_a_session(shared_web: Running) -> None:
    with (
        refused(4401),
        fresh(shared_web).websocket_connect(f"{SOCKETS}/api/live", headers={"origin": ORIGIN}),
    ):
        pass


def test_every_response_has_the_security_headers(shared_web: Running) -> None:
    for path in ("/", "/api/projects", "/static/index.html", "/nowhere", "/api/projects/none"):
        headers = shared_web.client.get(path).headers
        assert headers["x-content-type-options"] == "nosniff"
        assert headers["referrer-policy"] == "same-origin"
        policy = headers["content-security-policy"]
        assert "script-src 'self';" in policy
        assert "unsafe" not in policy
        assert "frame-ancestors 'self'" in policy


def test_request_bodies_are_bounded_also_without_a_session(web: Running) -> None:
    def pieces() -> Iterator[bytes]:
        yield from (b"x" * (1 << 20) for _ in range(20))

    known = {"content-type": "application/json"}
    stranger = fresh(web, headers={"X-Requested-With": "tests"})
    for client, path in ((stranger, "/api/login"), (web.client, "/api/projects/sample"), (web.client, "/api/uploads")):
        for content in (pieces(), b"x" * (20 << 20)):  # without and with a Content-Length
            assert client.post(path, content=content, headers=known).status_code == 413, path
    upload = web.post("/api/uploads", {"file_name": "a", "size": 40 << 20}, 201)["id"]
    sent = web.client.patch(f"/api/uploads/{upload}", content=b"x" * (20 << 20), headers={"Upload-Offset": "0"})
    assert sent.headers["upload-offset"] == str(20 << 20)


ESCAPES = (
    "/static/../app/main.py",
    "/static/%2e%2e/pyproject.toml",
    "/static/js/..%2f..%2fpackage.json",
    "/static/package.json",
    "/static/node_modules/typescript/package.json",
    "/media/../../etc/passwd",
    "/media/x/frames/..%2f..%2f1.jpg",
    "/media/PROJECT/candidates/1/..%2f..%2f..%2fframes.glb",
    "/media/PROJECT/candidates/1/%2e%2e%2fx.png",
    "/media/PROJECT/bundles/..%2f1.zip",
    "/media/PROJECT/frames/-1.jpg",
    "/viewer/..%2f..%2fetc/passwd",
    "/viewer/x/..%2f..%2fetc%2fpasswd",
)


def test_path_traversal_is_rejected(shared_web: Running) -> None:
    (project,) = (each["id"] for each in shared_web.get("/api/projects"))
    for path in ESCAPES:
        answer = shared_web.client.get(path.replace("PROJECT", project))
        assert 400 <= answer.status_code < 500, path
        assert b"root:" not in answer.content


def test_the_launch_token_is_not_revealed_by_the_api(shared_web: Running) -> None:
    assert shared_web.settings.launch_token not in shared_web.client.get("/api/system").text
    assert shared_web.settings.launch_token not in shared_web.client.get("/api/openapi.json").text


@pytest.mark.parametrize("path", ["/", "/api/projects", "/static/js/main.js"])
def test_a_proxy_with_a_path_prefix_is_refused_with_a_hint(shared_web: Running, path: str) -> None:
    answer = shared_web.client.get(path, headers={"X-Forwarded-Prefix": "/lab/r2c2r"})
    assert answer.status_code == 421
    assert "/lab/r2c2r" in answer.json()["message"]
    assert "host name of its own" in answer.json()["hint"]
    assert shared_web.client.get(path, headers={"X-Forwarded-Prefix": "/"}).is_success
