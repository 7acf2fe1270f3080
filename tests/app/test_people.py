"""Who may come in, and what each may do."""

import re
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from functools import partial
from typing import Any

import pytest
from argon2 import PasswordHasher
from starlette.testclient import TestClient
from starlette.websockets import WebSocketDisconnect

from app.errors import Conflict, TooMany
from app.services import accounts, audit, people
from app.services.attempts import MOST_WAIT_S, Attempts
from app.services.passwords import weakness
from tests.app.conftest import COOKIE, ORIGIN, SOCKETS, Running, running

PASSWORD = "correct horse battery"
REVIEWER = {"uploadCandidate", "giveVerdict", "setOverride"}
ADMIN = {
    "importProject",
    "deleteProject",
    "browse",
    "listAccounts",
    "addAccount",
    "changeAccount",
    "removeAccount",
    "listAudit",
    "listUnknown",
    "adoptUnknown",
    "leaveUnknown",
}
OPEN = {"health", "signIn"}


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    """A server that others can reach, and three accounts whose passwords are hashed quickly."""
    quick = PasswordHasher(time_cost=1, memory_cost=8, parallelism=1)
    data = tmp_path_factory.mktemp("people") / "data"
    with pytest.MonkeyPatch.context() as patch, running(data, accounts_only=True) as web:
        patch.setattr(accounts, "_hasher", lambda: quick)
        for role in ("annotator", "reviewer", "admin"):
            accounts.add(web.context.engine, f"the-{role}", role, PASSWORD)
        yield web


@contextmanager
def signed_in(web: Running, name: str) -> Iterator[TestClient]:
    client = browser(web)
    assert client.post("/api/login", json={"name": name, "password": PASSWORD}).status_code == 204
    yield client
    client.post("/api/logout")


def browser(web: Running) -> TestClient:
    headers = {"X-Requested-With": "tests"}
    return TestClient(web.app, base_url=ORIGIN, headers=headers, raise_server_exceptions=False)


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
def test_every_operation_knows_who_may(shared: Running, role: str, forbidden: set[str]) -> None:
    found = operations(shared)
    assert {operation for operation, _, _ in found} >= REVIEWER | ADMIN | OPEN
    with signed_in(shared, f"the-{role}") as client:
        for operation, method, path in found:
            if operation in ("signIn", "signOut", "sampleProject"):
                continue
            refused = client.request(method, path, json={}, params={"filename": "x"}).status_code == 403
            assert refused == (operation in forbidden), operation


def test_undoing_a_review_is_reviewing(shared: Running) -> None:
    with signed_in(shared, "the-annotator") as client:
        assert client.post("/api/projects/x/undo", json={"scope": "review"}).status_code == 403
        assert client.post("/api/projects/x/undo", json={"scope": "prompts"}).status_code == 404


def test_the_history_says_who_did_what(shared: Running) -> None:
    with signed_in(shared, "the-reviewer") as client:
        project = client.post("/api/projects/sample", json={}).json()["id"]
        Running.until(lambda: client.get(f"/api/projects/{project}").json()["status"] == "ready")
        assert client.patch(f"/api/projects/{project}", json={"name": "Ours"}).status_code == 200
        assert client.get(f"/api/projects/{project}/history").json()[0]["who"] == "the-reviewer"
        system = client.get("/api/system").json()
        assert (system["user"], system["role"], system["account"]) == ("the-reviewer", "reviewer", True)


def test_the_printed_key_opens_nothing_where_others_can_reach_it(shared: Running) -> None:
    stranger = browser(shared)
    assert stranger.get(f"/?token={shared.settings.launch_token}", follow_redirects=False).status_code == 401
    assert COOKIE not in stranger.cookies


def test_the_sign_in_page_is_shown_to_strangers(shared: Running) -> None:
    stranger = browser(shared)
    page = stranger.get("/p/x/annotate?frame=3")
    assert page.status_code == 200
    assert page.url.path == "/login"
    for asset in re.findall(r'(?:href|src)="(/static/[^"]+)"', page.text):
        assert stranger.get(asset).status_code == 200, asset


def test_signing_out_ends_the_session_at_once(shared: Running) -> None:
    with signed_in(shared, "the-admin") as client:
        cookie = client.cookies[COOKIE]
    other = browser(shared)
    other.cookies.set(COOKIE, cookie)
    assert other.get("/api/projects").status_code == 401


def test_each_sign_in_is_a_session_of_its_own(shared: Running) -> None:
    with signed_in(shared, "the-admin") as one, signed_in(shared, "the-admin") as two:
        assert one.cookies[COOKIE] != two.cookies[COOKIE]


@pytest.mark.parametrize("body", [{"name": "nobody", "password": PASSWORD}, {"name": "the-admin", "password": "wrong"}])
def test_a_wrong_name_and_a_wrong_password_look_the_same(shared: Running, body: dict[str, str]) -> None:
    answer = browser(shared).post("/api/login", json=body)
    assert (answer.status_code, answer.json()["message"]) == (401, "the name or the password is wrong")
    assert "set-cookie" not in answer.headers


def test_signing_in_from_another_site_is_refused(shared: Running) -> None:
    body = {"name": "the-admin", "password": PASSWORD}
    stranger = browser(shared)
    assert stranger.post("/api/login", json=body, headers={"origin": "http://evil.example"}).status_code == 403
    del stranger.headers["X-Requested-With"]
    assert stranger.post("/api/login", json=body).status_code == 403


def test_after_five_wrong_passwords_each_waits_and_many_at_once_are_no_more(
    shared: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    accounts.add(shared.context.engine, "guessed", "annotator", PASSWORD)
    waited: list[float] = []

    async def skip(seconds: float) -> None:
        waited.append(seconds)

    monkeypatch.setattr(people, "pause", skip)
    wrong, right = ({"name": "guessed", "password": word} for word in ("x", PASSWORD))
    with ThreadPoolExecutor(20) as crowd:
        answers = list(crowd.map(lambda _: shared.client.post("/api/login", json=wrong), range(60)))
    heard, refused = ([each for each in answers if each.status_code == code] for code in (401, 429))
    assert (len(heard) + len(refused), 5 <= len(heard) <= 9) == (60, True)
    assert {each.json()["kind"] for each in refused} == {"too-many"}
    assert all(0 < int(each.headers["retry-after"]) <= 4 for each in refused)
    assert sorted(waited)[:5] == [0.0] * 5
    assert max(waited) <= MOST_WAIT_S
    shared.context.people._attempts = Attempts()
    for _ in range(5):
        shared.context.people._attempts.take("guessed", "testclient")
    assert browser(shared).post("/api/login", json=right).status_code == 204
    assert 3.0 < waited[-1] <= 4.0  # late, and in


def test_sign_ins_wait_outside_the_threads_that_requests_share(shared: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    verified, going = accounts.verified, threading.Event()

    def late(*arguments: Any) -> Any:
        going.wait(120)
        return verified(*arguments)

    async def at_once(_: float) -> None:
        """Without the wait that slows guessing down."""

    monkeypatch.setattr(accounts, "verified", late)
    monkeypatch.setattr(people, "pause", at_once)

    def sign_in(number: int) -> int:
        answer = shared.client.post("/api/login", json={"name": f"nobody-{number}", "password": "x"})
        return int(answer.status_code)

    with ThreadPoolExecutor(51) as crowd:
        asked = [crowd.submit(sign_in, number) for number in range(50)]
        try:
            Running.until(lambda: sum(each.done() for each in asked) == 20)  # 30 of an address are taken on
            assert {each.result() for each in asked if each.done()} == {429}
            assert crowd.submit(shared.client.get, "/login").result(60).status_code == 200  # one that takes a shared thread
        finally:
            going.set()
    assert sorted({each.result() for each in asked}) == [401, 429]


def test_whatever_was_guessed_the_right_password_is_in_after_a_bounded_wait() -> None:
    now = [0.0]
    attempts = Attempts(lambda: now[0])
    for number in range(30):  # behind a proxy that says nothing of who asks: one address for all
        attempts.take(f"person-{number}", "proxy")
    assert attempts.take("ann", "proxy") <= 1.0
    for number in range(500):
        attempts.take("ann", f"10.0.{number}.1")
    assert attempts.take("ann", "home") <= MOST_WAIT_S
    for _ in range(100):
        with suppress(TooMany):
            attempts.take("bob", "home")
    now[0] += 4.0
    assert attempts.take("bob", "home") <= MOST_WAIT_S
    now[0] += 300.0
    assert attempts.take("bob", "home") == 0.0
    attempts.succeeded("bob", "home")


def test_guesses_are_forgotten_after_a_while_and_with_the_right_password() -> None:
    now = [0.0]
    attempts = Attempts(lambda: now[0])
    for _ in range(5):
        assert attempts.take("Ann", "10.0.0.1") == 0.0
    assert attempts.take("ann", "10.0.0.1") == 4.0
    assert attempts.take("ann", "10.0.0.2") == 0.0
    assert attempts.take("bob", "10.0.0.1") == 0.0
    attempts.succeeded("ANN", "10.0.0.1")
    assert attempts.take("ann", "10.0.0.1") == 0.0
    now[0] = 300.0
    assert [attempts.take("ann", "10.0.0.2") for _ in range(5)] == [0.0] * 5
    assert {key[1:] for key in attempts._due} == {("ann", "10.0.0.2"), ("", "10.0.0.2"), ("ann", "")}  # no more is kept


@pytest.mark.parametrize(
    ("password", "reason"),
    [
        ("short", "has 5 characters"),
        ("aaaaaaaaaa", "one character over and over"),
        ("ababababab", "only 2 different"),
        ("1234567890", "in order"),
        ("9876543210", "in order"),
        ("234567890123", "in order"),
        ("qwertyuiop", "in order"),
        ("ann.smith1", "own name"),
        ("AnnSmith2026!", "own name"),
        ("password12", "commonest"),
        ("P4ssw0rd!!!", "commonest"),
        ("letmein-2026", "commonest"),
        ("correct horse battery", ""),
        ("ann.smith likes blue doors", ""),
        ("password of the third drawer", ""),
        ("8461937250", ""),
        ("tr0ub4dor&3x", ""),
    ],
)
def test_passwords_that_are_tried_first_are_refused_with_the_reason(password: str, reason: str) -> None:
    said = weakness("ann.smith", password)
    assert (reason in said, bool(said)) == (True, bool(reason)), said


def test_a_weak_password_is_refused_wherever_one_is_set(shared: Running) -> None:
    with signed_in(shared, "the-admin") as admin:
        new = {"name": "weak", "role": "annotator", "password": "1234567890"}
        assert "in order" in admin.post("/api/accounts", json=new).json()["message"]
        assert admin.patch("/api/accounts/the-reviewer", json={"password": "the-reviewer!"}).status_code == 422
        change = {"old": PASSWORD, "new": "aaaaaaaaaa"}
        assert "over and over" in admin.post("/api/account/password", json=change).json()["message"]
        assert admin.get("/api/system").status_code == 200  # nothing ended


def test_the_record_says_who_came_in_who_was_refused_and_who_changed_whose_account(shared: Running) -> None:
    with signed_in(shared, "the-admin") as admin:
        newest = admin.get("/api/audit").json()["entries"][0]["id"]
        admin.post("/api/accounts", json={"name": "noted", "role": "annotator", "password": PASSWORD})
        admin.patch("/api/accounts/noted", json={"role": "reviewer"})
        browser(shared).post("/api/login", json={"name": "Noted", "password": "wrong"})
        browser(shared).post("/api/login", json={"name": "typed a password here", "password": "wrong"})
        with signed_in(shared, "noted") as theirs:
            theirs.post("/api/account/password", json={"old": PASSWORD, "new": PASSWORD + "?"})
        accounts.change(shared.context.engine, "noted", role="annotator")
        admin.delete("/api/accounts/noted")
        page = admin.get("/api/audit").json()
        found = [each for each in page["entries"] if each["id"] > newest]
        assert [(each["action"], each["account"], each["who"]) for each in reversed(found)] == [
            ("added", "noted", "the-admin"),
            ("role", "noted", "the-admin"),
            ("refused", "noted", ""),
            ("refused", "", ""),
            ("signed in", "noted", "noted"),
            ("password", "noted", "noted"),
            ("signed in", "noted", "noted"),
            ("signed out", "noted", "noted"),
            ("role", "noted", audit.COMMAND_LINE),
            ("removed", "noted", "the-admin"),
        ]
        assert {each["client"] for each in found if each["action"] == "refused"} == {"testclient"}
        assert "typed a password" not in str(page)
        pages = [admin.get("/api/audit", params={"limit": 1, **more}).json() for more in ({}, {"before": found[0]["id"]})]
        assert [[each["id"] for each in one["entries"]] for one in pages] == [[found[0]["id"]], [found[1]["id"]]]
        assert page["total"] >= len(found)


def test_of_refusals_only_the_newest_are_kept(shared: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(audit, "MOST_REFUSALS", 3)
    before = audit.entries(shared.context.engine, None, 200).total
    for number in range(6):
        audit.note_refusal(shared.context.engine, "nobody", "10.0.0.1", str(number))
    found = audit.entries(shared.context.engine, None, 200)
    assert [each.detail for each in found.entries if each.action == "refused"] == ["5", "4", "3"]
    assert [each.id for each in found.entries if each.action != "refused"]  # the rest stays
    assert found.total <= before + 3


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
    """The code that an open connection is closed with, whatever it says before."""
    while True:
        try:
            socket.receive_json()
        except WebSocketDisconnect as closed:
            return closed.code


def connection(client: TestClient) -> Any:
    return client.websocket_connect(f"{SOCKETS}/api/live", headers={"origin": ORIGIN})


def test_signing_out_closes_the_open_connections_of_that_session_and_no_other(shared: Running) -> None:
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
        assert {kept.receive_json()["type"] for _ in range(2)} == {"hello", "presence"}


def test_an_admin_lets_somebody_in_changes_what_they_may_and_removes_them(shared: Running) -> None:
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


def test_what_the_command_line_changes_reaches_open_connections(shared: Running) -> None:
    engine = shared.context.engine
    accounts.add(engine, "visitor", "annotator", PASSWORD)
    client = browser(shared)
    client.post("/api/login", json={"name": "visitor", "password": PASSWORD})
    with connection(client) as socket:
        socket.receive_json()
        accounts.remove(engine, "visitor")
        assert closed_with(socket) == 4401


def test_who_has_no_account_is_not_found(shared: Running) -> None:
    with signed_in(shared, "the-admin") as admin:
        for body in ({}, {"role": "reviewer"}, {"password": PASSWORD}):
            assert admin.patch("/api/accounts/nobody", json=body).status_code == 404
        assert admin.delete("/api/accounts/nobody").status_code == 404


def test_the_last_admin_stays(shared: Running) -> None:
    with signed_in(shared, "the-admin") as admin:
        assert admin.delete("/api/accounts/the-admin").status_code == 409
        assert admin.patch("/api/accounts/the-admin", json={"role": "annotator"}).status_code == 409
    for change in (accounts.remove, partial(accounts.change, role="reviewer")):  # as r2c2r user does it
        with pytest.raises(Conflict, match="only admin"):
            change(shared.context.engine, "the-admin")


def test_of_two_admins_who_remove_each_other_at_once_one_stays(shared: Running) -> None:
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


def test_ones_own_password_needs_the_old_one_and_ends_other_sessions(shared: Running) -> None:
    accounts.add(shared.context.engine, "careful", "annotator", PASSWORD)
    here, there = browser(shared), browser(shared)
    for client in (here, there):
        client.post("/api/login", json={"name": "careful", "password": PASSWORD})
    wrong = {"old": "not this one", "new": PASSWORD + "?"}
    assert here.post("/api/account/password", json=wrong).status_code == 403
    assert here.post("/api/account/password", json={**wrong, "old": PASSWORD}).status_code == 204
    assert here.get("/api/projects").status_code == 200
    assert there.get("/api/projects").status_code == 401


def test_a_local_session_is_worth_nothing_once_others_can_reach_the_server(start: Callable[..., Any]) -> None:
    with start() as web:
        cookie = web.client.cookies[COOKIE]
    with start(accounts_only=True) as web:
        other = browser(web)
        other.cookies.set(COOKIE, cookie)
        assert other.get("/api/projects").status_code == 401
        refused = pytest.raises(WebSocketDisconnect, check=lambda error: error.code == 4401)
        with refused, other.websocket_connect(f"{SOCKETS}/api/live", headers={"origin": ORIGIN}):
            pass
