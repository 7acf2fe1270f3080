"""Sign-in: sessions, password guessing, passwords, and the audit."""

import re
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from typing import Any

import pytest

from app.errors import TooMany
from app.services import accounts, audit, people
from app.services.attempts import MOST_WAIT_S, Attempts
from app.services.passwords import weakness
from tests.app.conftest import COOKIE, Running
from tests.app.people import PASSWORD, browser, signed_in, with_accounts
from tests.waiting import PATIENCE_S


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    with with_accounts(tmp_path_factory.mktemp("people") / "data") as web:
        yield web


def test_the_launch_token_is_refused_when_accounts_are_required(shared: Running) -> None:
    stranger = browser(shared)
    assert stranger.get(f"/?token={shared.settings.launch_token}", follow_redirects=False).status_code == 401
    assert COOKIE not in stranger.cookies


def test_the_sign_in_page_is_shown_without_a_session(shared: Running) -> None:
    stranger = browser(shared)
    page = stranger.get("/p/x/annotate?frame=3")
    assert page.status_code == 200
    assert page.url.path == "/login"
    for asset in re.findall(r'(?:href|src)="(/static/[^"]+)"', page.text):
        assert stranger.get(asset).status_code == 200, asset


def test_signing_out_ends_the_session_immediately(shared: Running) -> None:
    with signed_in(shared, "the-admin") as client:
        cookie = client.cookies[COOKIE]
    other = browser(shared)
    other.cookies.set(COOKIE, cookie)
    assert other.get("/api/projects").status_code == 401


def test_each_sign_in_creates_a_separate_session(shared: Running) -> None:
    with signed_in(shared, "the-admin") as one, signed_in(shared, "the-admin") as two:
        assert one.cookies[COOKIE] != two.cookies[COOKIE]


@pytest.mark.parametrize("body", [{"name": "nobody", "password": PASSWORD}, {"name": "the-admin", "password": "wrong"}])
def test_wrong_names_and_wrong_passwords_return_the_same_error(shared: Running, body: dict[str, str]) -> None:
    answer = browser(shared).post("/api/login", json=body)
    assert (answer.status_code, answer.json()["message"]) == (401, "the name or the password is wrong")
    assert "set-cookie" not in answer.headers


def test_signing_in_from_another_site_is_refused(shared: Running) -> None:
    body = {"name": "the-admin", "password": PASSWORD}
    stranger = browser(shared)
    assert stranger.post("/api/login", json=body, headers={"origin": "http://evil.example"}).status_code == 403
    del stranger.headers["X-Requested-With"]
    assert stranger.post("/api/login", json=body).status_code == 403


def test_sign_in_is_delayed_and_limited_after_five_wrong_passwords(shared: Running, monkeypatch: pytest.MonkeyPatch) -> None:
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
    assert 3.0 < waited[-1] <= 4.0  # delayed, but accepted


def test_pending_sign_ins_do_not_block_other_requests(shared: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    verified, going = accounts.verified, threading.Event()

    def late(*arguments: Any) -> Any:
        going.wait(PATIENCE_S)
        return verified(*arguments)

    async def at_once(_: float) -> None:
        """No delay after wrong passwords."""

    monkeypatch.setattr(accounts, "verified", late)
    monkeypatch.setattr(people, "pause", at_once)

    def sign_in(number: int) -> int:
        answer = shared.client.post("/api/login", json={"name": f"nobody-{number}", "password": "x"})
        return int(answer.status_code)

    with ThreadPoolExecutor(51) as crowd:
        asked = [crowd.submit(sign_in, number) for number in range(50)]
        try:
            Running.until(lambda: sum(each.done() for each in asked) == 20)  # 30 per address are accepted
            assert {each.result() for each in asked if each.done()} == {429}
            page = crowd.submit(shared.client.get, "/login")  # uses a shared thread
            assert page.result(PATIENCE_S).status_code == 200
        finally:
            going.set()
    assert sorted({each.result() for each in asked}) == [401, 429]


def test_the_wait_before_a_sign_in_is_bounded_despite_wrong_guesses() -> None:
    now = [0.0]
    attempts = Attempts(lambda: now[0])
    for number in range(30):  # behind a proxy that does not identify clients: one address for all
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


def test_wrong_guesses_expire_and_are_cleared_by_a_successful_sign_in() -> None:
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
    assert {key[1:] for key in attempts._due} == {("ann", "10.0.0.2"), ("", "10.0.0.2"), ("ann", "")}  # nothing else is stored


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
def test_common_passwords_are_refused_with_the_reason(password: str, reason: str) -> None:
    said = weakness("ann.smith", password)
    assert (reason in said, bool(said)) == (True, bool(reason)), said


def test_weak_passwords_are_refused_by_every_operation_that_sets_one(shared: Running) -> None:
    with signed_in(shared, "the-admin") as admin:
        new = {"name": "weak", "role": "annotator", "password": "1234567890"}
        assert "in order" in admin.post("/api/accounts", json=new).json()["message"]
        assert admin.patch("/api/accounts/the-reviewer", json={"password": "the-reviewer!"}).status_code == 422
        change = {"old": PASSWORD, "new": "aaaaaaaaaa"}
        assert "over and over" in admin.post("/api/account/password", json=change).json()["message"]
        assert admin.get("/api/system").status_code == 200  # the session continues


def test_the_audit_records_sign_ins_refusals_and_account_changes(shared: Running) -> None:
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


def test_the_audit_keeps_only_the_newest_refusals(shared: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(audit, "MOST_REFUSALS", 3)
    before = audit.entries(shared.context.engine, None, 200).total
    for number in range(6):
        audit.note_refusal(shared.context.engine, "nobody", "10.0.0.1", str(number))
    found = audit.entries(shared.context.engine, None, 200)
    assert [each.detail for each in found.entries if each.action == "refused"] == ["5", "4", "3"]
    assert [each.id for each in found.entries if each.action != "refused"]  # other entries remain
    assert found.total <= before + 3
