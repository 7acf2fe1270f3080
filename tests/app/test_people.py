"""Permissions of each role, and management of accounts."""

import re
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any

import pytest
from starlette.testclient import TestClient
from starlette.websockets import WebSocketDisconnect

from app.errors import Conflict
from app.services import accounts
from tests.app.conftest import COOKIE, ORIGIN, SOCKETS, Running
from tests.app.people import PASSWORD, browser, signed_in, with_accounts

REVIEWER = {"uploadCandidate", "lookAtMesh", "giveVerdict", "setOverride", "correctMade"}
ADMIN = {
    "importProject",
    "deleteProject",
    "listTrash",
    "restoreProject",
    "deleteForGood",
    "browse",
    "listAccounts",
    "addAccount",
    "changeAccount",
    "removeAccount",
    "listAudit",
    "listUnknown",
    "adoptUnknown",
    "leaveUnknown",
    "discardUnknown",
    "listSeats",
    "drainSeat",
    "listHoneypots",
    "slipHoneypot",
    "scoreHoneypot",
}
OPEN = {"health", "signIn"}


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    with with_accounts(tmp_path_factory.mktemp("people") / "data") as web:
        yield web


def operations(web: Running) -> list[tuple[str, str, str]]:
    """(operation, method, a path of it)."""
    paths = web.app.openapi()["paths"]
    found = []
    for path, methods in paths.items():
        filled = re.sub(r"\{(object|job|point|frame|version)\}", "1", path)
        filled = re.sub(r"\{side\}", "plan", filled)
        filled = re.sub(r"\{\w+\}", "none", filled)
        found += [(said["operationId"], method.upper(), filled) for method, said in methods.items()]
    return found


def test_every_operation_needs_a_session(shared: Running) -> None:
    stranger = browser(shared)
    found = operations(shared)
    assert len(found) > 50
    for operation, method, path in found:
        if operation not in OPEN:
            assert stranger.request(method, path, json={}).status_code == 401, operation


@pytest.mark.parametrize(("role", "forbidden"), [("annotator", REVIEWER | ADMIN), ("reviewer", ADMIN), ("admin", set())])
def test_every_operation_allows_exactly_its_roles(shared: Running, role: str, forbidden: set[str]) -> None:
    found = operations(shared)
    assert {operation for operation, _, _ in found} >= REVIEWER | ADMIN | OPEN
    with signed_in(shared, f"the-{role}") as client:
        for operation, method, path in found:
            if operation in ("signIn", "signOut", "sampleProject"):
                continue
            refused = client.request(method, path, json={}, params={"filename": "x"}).status_code == 403
            assert refused == (operation in forbidden), operation


def test_undoing_a_review_needs_the_role_of_a_reviewer(shared: Running) -> None:
    with signed_in(shared, "the-annotator") as client:
        assert client.post("/api/projects/x/undo", json={"scope": "review"}).status_code == 403
        assert client.post("/api/projects/x/undo", json={"scope": "prompts"}).status_code == 404


def test_the_history_names_the_person_of_a_change(shared: Running) -> None:
    with signed_in(shared, "the-reviewer") as client:
        project = client.post("/api/projects/sample", json={}).json()["id"]
        Running.until(lambda: client.get(f"/api/projects/{project}").json()["status"] == "ready")
        assert client.patch(f"/api/projects/{project}", json={"name": "Ours"}).status_code == 200
        assert client.get(f"/api/projects/{project}/history").json()[0]["who"] == "the-reviewer"
        system = client.get("/api/system").json()
        assert (system["user"], system["role"], system["account"]) == ("the-reviewer", "reviewer", True)


def test_a_new_password_and_a_removed_account_end_sessions(shared: Running) -> None:
    engine = shared.context.engine
    accounts.add(engine, "leaving", "annotator", PASSWORD)
    client = browser(shared)
    client.post("/api/login", json={"name": "leaving", "password": PASSWORD})
    assert client.get("/api/projects").status_code == 200
    accounts.change(engine, "leaving", password=PASSWORD + "!")
    Running.until(lambda: client.get("/api/projects").status_code == 401)
    assert client.post("/api/login", json={"name": "leaving", "password": PASSWORD + "!"}).status_code == 204
    accounts.remove(engine, "leaving")
    Running.until(lambda: client.get("/api/projects").status_code == 401)


def closed_with(socket: Any) -> int:
    """Close code of an open connection, after any messages."""
    while True:
        try:
            socket.receive_json()
        except WebSocketDisconnect as closed:
            return closed.code


def connection(client: TestClient) -> Any:
    return client.websocket_connect(f"{SOCKETS}/api/live", headers={"origin": ORIGIN})


def test_signing_out_closes_only_the_connections_of_that_session(shared: Running) -> None:
    with (
        signed_in(shared, "the-reviewer") as leaving,
        signed_in(shared, "the-reviewer") as staying,
        connection(leaving) as gone,
        connection(staying) as kept,
    ):
        gone.receive_json()
        leaving.post("/api/logout")
        assert closed_with(gone) == 4401
        kept.send_text('{"type": "watch", "project": "p"}')
        assert {kept.receive_json()["type"] for _ in range(3)} == {"hello", "project", "presence"}


def test_an_admin_adds_an_account_changes_its_role_and_removes_it(shared: Running) -> None:
    with signed_in(shared, "the-admin") as admin:
        new = {"name": "Eve", "role": "annotator", "password": PASSWORD}
        assert admin.post("/api/accounts", json=new).json()["name"] == "eve"
        assert admin.post("/api/accounts", json=new).status_code == 409
        assert admin.post("/api/accounts", json={**new, "name": "short", "password": "short"}).status_code == 422
        eve = browser(shared)
        eve.post("/api/login", json={"name": "eve", "password": PASSWORD})
        assert eve.get("/api/system").json()["role"] == "annotator"
        with connection(eve) as socket:
            socket.receive_json()
            assert admin.patch("/api/accounts/eve", json={"role": "reviewer"}).json()["role"] == "reviewer"
            assert socket.receive_json().items() >= {"type": "you", "name": "eve", "role": "reviewer"}.items()
            assert eve.get("/api/system").json()["role"] == "reviewer"
            assert admin.delete("/api/accounts/eve").status_code == 204
            assert closed_with(socket) == 4401
        assert eve.get("/api/projects").status_code == 401
        assert {each["name"]: each["you"] for each in admin.get("/api/accounts").json()}["the-admin"] is True


def test_removing_an_account_outside_the_api_closes_its_connections(shared: Running) -> None:
    engine = shared.context.engine
    accounts.add(engine, "visitor", "annotator", PASSWORD)
    client = browser(shared)
    client.post("/api/login", json={"name": "visitor", "password": PASSWORD})
    with connection(client) as socket:
        socket.receive_json()
        accounts.remove(engine, "visitor")
        assert closed_with(socket) == 4401


def test_an_unknown_account_is_not_found(shared: Running) -> None:
    with signed_in(shared, "the-admin") as admin:
        for body in ({}, {"role": "reviewer"}, {"password": PASSWORD}):
            assert admin.patch("/api/accounts/nobody", json=body).status_code == 404
        assert admin.delete("/api/accounts/nobody").status_code == 404


def test_the_last_admin_cannot_be_removed_or_demoted(shared: Running) -> None:
    with signed_in(shared, "the-admin") as admin:
        assert admin.delete("/api/accounts/the-admin").status_code == 409
        assert admin.patch("/api/accounts/the-admin", json={"role": "annotator"}).status_code == 409
    for change in (accounts.remove, partial(accounts.change, role="reviewer")):  # as `r2c2r user` does it
        with pytest.raises(Conflict, match="only admin"):
            change(shared.context.engine, "the-admin")


def test_concurrent_demotion_of_both_admins_keeps_one(shared: Running) -> None:
    engine = shared.context.engine
    accounts.add(engine, "second", "admin", PASSWORD)

    def end(name: str) -> bool:
        try:
            accounts.change(engine, name, role="reviewer")
        except Conflict:
            return False
        return True

    with ThreadPoolExecutor(2) as both:
        assert sorted(both.map(end, ["the-admin", "second"])) == [False, True]
    for name, role in (("the-admin", "admin"), ("second", "annotator")):
        accounts.change(engine, name, role=role)


def test_changing_a_password_needs_the_old_one_and_ends_other_sessions(shared: Running) -> None:
    accounts.add(shared.context.engine, "careful", "annotator", PASSWORD)
    here, there = browser(shared), browser(shared)
    for client in (here, there):
        client.post("/api/login", json={"name": "careful", "password": PASSWORD})
    wrong = {"old": "not this one", "new": PASSWORD + "?"}
    assert here.post("/api/account/password", json=wrong).status_code == 403
    assert here.post("/api/account/password", json={**wrong, "old": PASSWORD}).status_code == 204
    assert here.get("/api/projects").status_code == 200
    assert there.get("/api/projects").status_code == 401


def test_a_local_session_is_invalid_once_accounts_are_required(start: Callable[..., Any]) -> None:
    with start() as web:
        cookie = web.client.cookies[COOKIE]
    with start(accounts_only=True) as web:
        other = browser(web)
        other.cookies.set(COOKIE, cookie)
        assert other.get("/api/projects").status_code == 401
        refused = pytest.raises(WebSocketDisconnect, check=lambda error: error.code == 4401)
        with refused, other.websocket_connect(f"{SOCKETS}/api/live", headers={"origin": ORIGIN}):
            pass
