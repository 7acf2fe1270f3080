"""A change that is sent again, because its answer got lost, is not made again."""

import contextlib
import threading
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from sqlmodel import select

from app.db import engine as engines
from app.db import once
from app.db.engine import reading
from app.db.tables import SentChange
from app.services import sending
from tests.app.conftest import Running

CLICK = {"frame": 3, "x": 20.0, "y": 20.0, "label": 1}


@pytest.fixture
def at(web: Running) -> str:
    return f"/api/projects/{web.sample()}"


def keyed(web: Running, method: str, path: str, key: str, body: Any = None) -> Any:
    return web.client.request(method, path, json=body, headers={"Idempotency-Key": key})


def test_a_click_sent_twice_is_one_click(web: Running, at: str) -> None:
    first = keyed(web, "POST", f"{at}/objects/1/points", "k1", CLICK)
    again = keyed(web, "POST", f"{at}/objects/1/points", "k1", CLICK)
    assert (first.status_code, again.status_code) == (201, 201)
    assert again.json() == first.json()
    assert again.headers["idempotency-replayed"] == "true"
    assert web.get(f"{at}/objects")[0]["points"] == first.json()["points"]


def test_two_keys_and_no_key_are_changes_of_their_own(web: Running, at: str) -> None:
    before = len(web.get(f"{at}/objects")[0]["points"])
    for key in ("a", "b"):
        keyed(web, "POST", f"{at}/objects/1/points", key, CLICK)
    for _ in range(2):
        web.post(f"{at}/objects/1/points", CLICK)
    assert len(web.get(f"{at}/objects")[0]["points"]) == before + 4


def test_a_change_kept_for_one_person_is_not_made_by_another(web: Running, at: str) -> None:
    before = web.get(f"{at}/objects")[0]["points"]
    headers = {"Idempotency-Key": "whose", "X-R2C2R-Person": "J%C3%BCrgen"}
    refused = web.client.post(f"{at}/objects/1/points", json=CLICK, headers=headers)
    assert refused.status_code == 401
    assert "Jürgen" in refused.json()["message"]
    assert web.get(f"{at}/objects")[0]["points"] == before
    own = {**headers, "X-R2C2R-Person": web.get("/api/system")["user"]}
    assert web.client.post(f"{at}/objects/1/points", json=CLICK, headers=own).status_code == 201


def test_the_answer_is_lost_on_the_way_and_the_undo_is_still_one(web: Running, at: str) -> None:
    for _ in range(3):
        web.post(f"{at}/objects/1/points", CLICK)
    before = len(web.get(f"{at}/objects")[0]["points"])
    _cut_off(web, f"{at}/undo", b'{"object": 1}', "undo-1")
    assert len(web.get(f"{at}/objects")[0]["points"]) == before - 1
    assert keyed(web, "POST", f"{at}/undo", "undo-1", {"object": 1}).status_code == 200
    assert len(web.get(f"{at}/objects")[0]["points"]) == before - 1


def test_a_server_that_died_before_it_could_answer_says_that_the_change_is_stored(
    start: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    with start() as web:
        at = f"/api/projects/{web.sample()}"
        before = len(web.get(f"{at}/objects")[0]["points"])
        with monkeypatch.context() as patch:
            patch.setattr(sending, "keep", lambda *_: None)  # the server is gone
            keyed(web, "POST", f"{at}/objects/1/points", "k", CLICK)
    with start() as web:
        again = keyed(web, "POST", f"{at}/objects/1/points", "k", CLICK)
        assert (again.status_code, "is stored" in again.json()["message"]) == (409, True)
        assert len(web.get(f"{at}/objects")[0]["points"]) == before + 1


def test_what_was_refused_is_not_remembered(web: Running, at: str) -> None:
    assert keyed(web, "POST", f"{at}/redo", "r", {"object": 1}).status_code == 409
    web.post(f"{at}/objects/1/points", CLICK)
    web.post(f"{at}/undo", {"object": 1})
    assert keyed(web, "POST", f"{at}/redo", "r", {"object": 1}).status_code == 200


def test_a_key_is_for_one_change(web: Running, at: str) -> None:
    keyed(web, "POST", f"{at}/objects/1/points", "k", CLICK)
    refused = keyed(web, "POST", f"{at}/objects/2/points", "k", CLICK)
    assert (refused.status_code, refused.json()["kind"]) == (422, "input")
    assert keyed(web, "POST", f"{at}/objects/1/points", "k" * 200, CLICK).status_code == 422


def test_the_same_change_sent_at_once_is_made_once(web: Running, at: str) -> None:
    before = len(web.get(f"{at}/objects")[0]["points"])
    threads = [threading.Thread(target=keyed, args=(web, "POST", f"{at}/objects/1/points", "twin", CLICK)) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(web.get(f"{at}/objects")[0]["points"]) == before + 1


def test_keys_are_forgotten_after_a_while_and_with_their_project(
    web: Running, at: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    keyed(web, "POST", f"{at}/objects/1/points", "k", CLICK)
    assert _kept(web) == 1
    sending.tidy(web.context)
    assert _kept(web) == 1
    with monkeypatch.context() as patch:
        patch.setattr(once, "KEPT_S", -1.0)
        sending.tidy(web.context)
    assert _kept(web) == 0
    keyed(web, "POST", f"{at}/objects/1/points", "k2", CLICK)
    web.delete(at)
    assert _kept(web) == 0


@pytest.mark.parametrize(
    ("method", "path", "body"),
    [
        ("POST", "/objects", {"category": "mug", "points": [CLICK]}),
        ("PATCH", "/objects/1", {"category": "oven"}),
        ("DELETE", "/objects/2", None),
        ("POST", "/objects/1/clicks", {"points": [CLICK, CLICK]}),
        ("POST", "/undo", {"object": 1}),
        ("PATCH", "/objects/1/override", {"hinge": "left"}),
        ("POST", "/comments", {"text": "look"}),
        ("POST", "/review", {"from_state": "draft", "to": "ready", "reason": "go"}),
        ("POST", "/run", {}),
        ("POST", "/prompts.json", {"version": 1, "objects": [{"name": "a", "category": "mug", "points": [CLICK]}] * 2}),
    ],
)
def test_a_marked_change_is_one_transaction(
    web: Running, at: str, method: str, path: str, body: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    web.post(f"{at}/objects/1/points", CLICK)
    claimed: list[int] = []
    claim = once.claim

    def count(session: Any) -> None:
        if once._sending.get() is not None:
            claimed.append(1)
        claim(session)

    monkeypatch.setattr(engines.once, "claim", count)
    answer = keyed(web, method, at + path, "one", body)
    assert answer.status_code in (200, 201, 202, 422), answer.text
    assert len(claimed) <= 1


def _kept(web: Running) -> int:
    with reading(web.context.engine) as session:
        return len(session.exec(select(SentChange)).all())


def _cut_off(web: Running, path: str, body: bytes, key: str) -> None:
    """Send a change, and vanish before the answer."""
    cookies = "; ".join(f"{name}={value}" for name, value in web.client.cookies.items())
    told = {"host": "127.0.0.1:8000", "cookie": cookies, "x-requested-with": "t", "idempotency-key": key}
    headers = [(name.encode(), value.encode()) for name, value in {**told, "content-type": "application/json"}.items()]
    scope = {"type": "http", "method": "POST", "path": path, "query_string": b"", "headers": headers}
    asked: Iterator[dict[str, Any]] = iter([{"type": "http.request", "body": body}])

    async def receive() -> dict[str, Any]:
        return next(asked, {"type": "http.disconnect"})

    async def send(_: Any) -> None:
        raise ConnectionResetError

    async def ask() -> None:
        with contextlib.suppress(ConnectionResetError):
            await web.app({**scope, "http_version": "1.1", "scheme": "http", "client": None}, receive, send)

    portal = web.client.portal
    assert portal is not None
    portal.call(ask)
