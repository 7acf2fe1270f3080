"""Identity from a trusted proxy: accepted from that proxy only, with an account created on first use."""

import logging
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest
from starlette.testclient import TestClient
from starlette.websockets import WebSocketDisconnect

from app import schemas
from app.serve import serve
from app.services import accounts, audit, tokens
from app.services.people import LOOK_UPS
from r2c2r_core.errors import InputError
from tests.app.conftest import ORIGIN, SOCKETS, Running
from tests.app.people import PASSWORD
from tests.app.test_people import closed_with

PROXY, ELSEWHERE = "10.20.0.7", "10.20.1.7"
TRUSTING = {
    "accounts_only": True,
    "identity": "proxy:X-Forwarded-User",
    "trusted_proxies": ("10.20.0.0/24",),
    "default_role": "annotator",
}


@pytest.fixture
def web(start: Callable[..., Any]) -> Iterator[Running]:
    with start(**TRUSTING) as found:
        yield found


def by(web: Running, peer: str, named: str = "", **headers: str) -> TestClient:
    """A client whose requests come from that address and carry that name."""
    given = {"X-Requested-With": "tests", **headers, **({"X-Forwarded-User": named} if named else {})}
    return TestClient(web.app, base_url=ORIGIN, headers=given, client=(peer, 50000), raise_server_exceptions=False)


def record(web: Running) -> list[schemas.AuditEntry]:
    """The audit without the entry of the browser that `running` signs in."""
    return [line for line in audit.entries(web.context.engine, None, 200).entries if line.client != "testclient"]


def test_a_user_named_by_the_proxy_gets_an_account_with_the_default_role(web: Running) -> None:
    ann = by(web, PROXY, "Ann@lab.example", **{"X-Forwarded-For": "203.0.113.7"})
    said = ann.get("/api/system").json()
    assert (said["user"], said["role"], said["account"], said["sign_out"]) == ("ann@lab.example", "annotator", True, None)
    assert ann.get("/api/accounts").status_code == 403
    assert [(line.action, line.account, line.who, line.client) for line in record(web)] == [
        ("signed in", "ann@lab.example", "ann@lab.example", "203.0.113.7"),
        ("added", "ann@lab.example", "a trusted proxy", ""),
    ]


def test_concurrent_first_requests_create_one_account_and_one_session(web: Running) -> None:
    ann = by(web, PROXY, "ann")
    with ThreadPoolExecutor(LOOK_UPS) as crowd:  # each has its own event loop here: no look-up may wait for another
        assert {answer.status_code for answer in crowd.map(lambda _: ann.get("/api/projects"), range(24))} == {200}
    assert [line.action for line in record(web)] == ["signed in", "added"]


def test_a_user_with_an_existing_account_keeps_its_role(web: Running) -> None:
    accounts.add(web.context.engine, "ann", "admin", PASSWORD)
    assert by(web, PROXY, "ann").get("/api/accounts").status_code == 200


def test_a_changed_role_applies_from_the_next_request(web: Running) -> None:
    accounts.add(web.context.engine, "ann", "admin", PASSWORD)
    ann, bob = by(web, PROXY, "ann"), by(web, PROXY, "bob")
    assert bob.get("/api/audit").status_code == 403
    assert ann.patch("/api/accounts/bob", json={"role": "admin"}).status_code == 200
    assert bob.get("/api/audit").status_code == 200


@pytest.mark.parametrize("path", ["/api/projects", "/", "/login", "/healthz", "/static/css/base.css"])
def test_user_headers_from_untrusted_addresses_are_refused_and_logged(
    web: Running, path: str, caplog: pytest.LogCaptureFixture
) -> None:
    accounts.add(web.context.engine, "ann", "admin", PASSWORD)
    with caplog.at_level(logging.WARNING, "app.security"):
        answer = by(web, ELSEWHERE, "ann", **{"X-Forwarded-For": PROXY}).get(path)
    assert answer.status_code == 403
    assert f"this request came from {ELSEWHERE}" in answer.json()["message"]
    assert f"X-Forwarded-User from {ELSEWHERE}" in caplog.text
    assert {line.action for line in record(web)} == {"added"}


def test_a_forwarded_client_address_is_not_checked_as_the_proxy(web: Running) -> None:
    told = {"X-Forwarded-For": ELSEWHERE}
    assert by(web, PROXY, "ann", **told).get("/api/system").status_code == 200


def test_websockets_are_accepted_from_the_proxy_only_and_follow_the_account(web: Running) -> None:
    at = {"headers": {"Origin": ORIGIN}}
    with (
        pytest.raises(WebSocketDisconnect) as refused,
        by(web, ELSEWHERE, "ann").websocket_connect(f"{SOCKETS}/api/live", **at),
    ):
        pass
    assert refused.value.code == 4403
    with by(web, PROXY, "ann").websocket_connect(f"{SOCKETS}/api/live", **at) as live:
        assert live.receive_json()["type"] == "hello"
        accounts.change(web.context.engine, "ann", role="reviewer")
        web.context.people.look_again()
        assert live.receive_json() == {"type": "you", "seq": 0, "project": None, "name": "ann", "role": "reviewer"}
        accounts.remove(web.context.engine, "ann")
        web.context.people.look_again()
        assert closed_with(live) == 4401


def test_a_duplicated_user_header_is_refused(web: Running) -> None:
    answer = by(web, PROXY).get("/api/system", headers=[("X-Forwarded-User", "ann"), ("X-Forwarded-User", "root")])
    assert (answer.status_code, answer.json()["message"]) == (403, "X-Forwarded-User occurs twice in the request")


@pytest.mark.parametrize("name", ["", "two words", "a" * 61, "../admin", "{http.auth.user.id}"])
def test_an_empty_or_invalid_user_name_creates_no_account(web: Running, name: str) -> None:
    answer = by(web, PROXY).get("/api/system", headers={"X-Forwarded-User": name})
    assert answer.status_code == (422 if name else 401)
    assert record(web) == []


def test_password_sign_in_and_tokens_work_behind_the_proxy(web: Running) -> None:
    accounts.add(web.context.engine, "ann", "admin", PASSWORD)
    browser = by(web, PROXY)
    assert browser.get("/api/projects").status_code == 401
    assert browser.post("/api/login", json={"name": "ann", "password": PASSWORD}).status_code == 204
    assert browser.get("/api/system").json()["user"] == "ann"
    token = tokens.add(web.context.engine, "ann", "a script", "read")[0]
    program = by(web, PROXY, "bob", Authorization=f"Bearer {token}")
    assert program.get("/api/system").json()["user"] == "ann"


@pytest.mark.parametrize("password", ["", "no such account"])
def test_an_account_without_a_password_accepts_no_password(web: Running, password: str) -> None:
    assert by(web, PROXY, "ann").get("/api/system").status_code == 200
    assert accounts.verified(web.context.engine, "ann", password) is None


def test_cross_site_requests_of_proxy_users_are_refused(web: Running) -> None:
    foreign = by(web, PROXY, "ann", Origin="http://evil.example")
    assert foreign.post("/api/projects/sample", json={}).status_code == 403
    plain = by(web, PROXY, "ann")
    del plain.headers["X-Requested-With"]
    assert plain.post("/api/projects/sample", json={}).status_code == 403


@pytest.mark.parametrize(
    ("named", "value", "said"),
    [
        ("R2C2R_IDENTITY", "proxy:X-Forwarded-User", "no proxy is trusted"),
        ("R2C2R_IDENTITY", "X-Forwarded-User", "not known"),
        ("R2C2R_IDENTITY", "proxy:two words", "not known"),
        ("R2C2R_DEFAULT_ROLE", "owner", "no role"),
        ("R2C2R_TRUSTED_PROXIES", "proxy.example", "R2C2R_TRUSTED_PROXIES proxy.example"),
    ],
)
def test_invalid_proxy_settings_are_refused_before_the_server_starts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, named: str, value: str, said: str
) -> None:
    monkeypatch.setenv(named, value)
    with pytest.raises(InputError, match=said):
        serve(host="127.0.0.1", port=0, data_dir=tmp_path / "data")
    assert not (tmp_path / "data").exists()
