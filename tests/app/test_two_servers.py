"""Two servers on one Postgres and one store: events at one server are seen at the other."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import Engine

from app import hub as hubs
from app.db import channel as channels
from app.db.channel import Channel, join_hubs
from app.db.engine import opened
from app.hub import Hub
from tests import waiting
from tests.app.conftest import Running, running
from tests.app.object_server import REQUIRED
from tests.app.postgres import PostgresServer
from tests.app.test_jobs import run
from tests.app.test_live import CLICK, listening, until
from tests.waiting import LOOK_S, PATIENCE_S

if not REQUIRED:
    pytest.importorskip("obstore", reason="no obstore: pip install 'r2c2r[store]'")


@pytest.fixture
def address(postgres_server: PostgresServer, tmp_path: Path) -> Iterator[str]:
    yield postgres_server.of_folder(tmp_path)
    postgres_server.drop_all()


@pytest.fixture
def two(address: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[Running, Running]]:
    monkeypatch.setattr(hubs, "PRESENCE_S", 0.0)
    options = {"postgres": address, "store": f"file://{tmp_path / 'store'}", "beat_s": 5.0}
    with (
        running(tmp_path / "a", user="ann", **options) as a,
        running(tmp_path / "b", user="bob", run_jobs=False, **options) as b,
    ):
        yield a, b


@pytest.fixture
def engine(address: str) -> Iterator[Engine]:
    with opened(address) as found:
        yield found


def test_presence_masks_and_jobs_are_shared_between_servers(two: tuple[Running, Running]) -> None:
    a, b = two
    project = a.sample()
    with listening(a, project) as at_a, listening(b, project) as at_b:
        both = {"ann", "bob"}
        assert (
            {person["who"] for person in presence(at_b, at_least=2)}
            == {person["who"] for person in presence(at_a, at_least=2)}
            == both
        )
        at_a.send_json({"type": "watch", "project": project, "page": "review", "object": None})
        waiting.until(lambda: ("ann", "review") in [(one["who"], one["page"]) for one in presence(at_b, at_least=2)])
        made = b.post(f"/api/projects/{project}/objects", {"category": "drawer", "points": [CLICK]}, 201)
        seen, _ = until(at_a, type="segment", object=made["id"], state="done")
        assert [message["frame"] for message in seen if message["type"] == "mask"] == [3, 0, 7]
        lane = {"object": made["id"], "frames": [0, 3, 7], "complete": True}
        a.until(lambda: [one for one in a.get(f"/api/projects/{project}/lanes") if lane.items() <= one.items()] != [])
        job = run(b, project)  # runs at a
        told: list[dict[str, Any]] = []
        while not told or told[-1]["state"] != "done":
            message = at_b.receive_json()
            if message["type"] == "job" and message["job"]["id"] == job:
                told.append(message["job"])
        assert len({one["stage"] for one in told}) > 3
        until(at_b, type="projects")
        at_a.close()
        waiting.until(lambda: {person["who"] for person in presence(at_b)} == {"bob"})


def test_a_project_trashed_at_one_server_is_hidden_at_the_other(two: tuple[Running, Running]) -> None:
    a, b = two
    project = a.sample()
    with listening(b, project) as at_b:
        a.delete(f"/api/projects/{project}")
        until(at_b, type="projects")
        b.until(lambda: b.client.get(f"/api/projects/{project}").status_code == 404)


def test_messages_arrive_in_order_despite_broken_connections(engine: Engine, postgres_server: PostgresServer) -> None:
    told: list[int] = []
    gaps: list[None] = []
    with channel(engine, "a") as a, channel(engine, "b") as b:
        b.hears["number"] = lambda sender, said: told.append(said["number"])
        b.on_gap.append(lambda: gaps.append(None))
        for number in range(300):
            a.say("number", {"number": number})
            if number % 100 == 50:
                waiting.until(lambda number=number: len(told) > number - 50)
                postgres_server.run("SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE application_name = 'r2c2r'")
        waiting.until(lambda: bool(told) and told[-1] == 299)
    assert list(dict.fromkeys(told)) == list(range(300))  # one whose commit notification is lost is sent again
    assert gaps == []


def test_a_server_that_missed_deleted_messages_detects_a_gap(engine: Engine) -> None:
    gaps = threading.Event()
    with channel(engine, "a") as one:
        one.on_gap.append(gaps.set)
        waiting.until(lambda: one._newest is not None and one._newest[0] > 0)
        with engine.connect().execution_options(write=True) as connection:
            connection.exec_driver_sql("DELETE FROM messages")
            connection.exec_driver_sql("SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE pid <> pg_backend_pid()")
            connection.commit()
        assert gaps.wait(PATIENCE_S)


@pytest.mark.parametrize("loop", ["_take_later", "_taken"])
def test_an_unexpected_error_does_not_end_the_channel(engine: Engine, loop: str, monkeypatch: pytest.MonkeyPatch) -> None:
    failures, sound = list[str](), getattr(Channel, loop)

    def fail_once(self: Channel, *given: Any) -> Any:
        if self.name == "a" and not failures:
            failures.append(loop)
            raise RuntimeError("unexpected")
        return sound(self, *given)

    monkeypatch.setattr(Channel, loop, fail_once)
    monkeypatch.setattr(channels, "AGAIN_S", LOOK_S)
    heard: list[str] = []
    with channel(engine, "a") as a, channel(engine, "b") as b:
        for one in (a, b):
            one.hears["hello"] = lambda sender, _: heard.append(sender)
        waiting.until(lambda: failures)

        def is_heard() -> bool:
            for one in (a, b):
                one.say("hello", {})
            return {"a", "b"} <= set(heard)

        waiting.until(is_heard)


def test_a_vanished_server_is_forgotten_and_forces_a_refetch(engine: Engine) -> None:
    gone: list[tuple[str, bool]] = []
    hub = Hub()
    with channel(engine, "a") as a:
        a.on_gone.append(lambda sender, vanished: gone.append((sender, vanished)))
        join_hubs(a, hub)
        epoch = hub.epoch
        with channel(engine, "in order"):
            waiting.until(lambda: "in order" in a._heard)
        waiting.until(lambda: gone == [("in order", False)])
        assert hub.epoch == epoch
    hub = Hub()
    with channel(engine, "b", beat_s=0.2) as b:
        b.on_gone.append(lambda sender, vanished: gone.append((sender, vanished)))
        join_hubs(b, hub)
        epoch = hub.epoch
        lost = Channel(engine, "lost", 3600.0)
        lost.start()
        try:
            waiting.until(lambda: hub.epoch != epoch)
            assert gone == [("in order", False), ("lost", True)]
        finally:
            lost.stop()


def test_messages_waiting_for_the_database_are_bounded(engine: Engine, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(channels, "WAITING_BYTES", 10_000)
    kinds: list[str] = []
    with channel(engine, "b") as b:
        b.hears["x"] = lambda *_: kinds.append("x")
        b.on_gap.append(lambda: kinds.append("gap"))
        a = Channel(engine, "a", 3600.0)
        for _ in range(3):
            a.say("x", {"bits": "1" * 4_000})
        a.start()
        try:
            waiting.until(lambda: kinds)
        finally:
            a.stop()
    assert kinds == ["gap"]


def test_an_older_row_version_of_another_server_is_not_published(engine: Engine) -> None:
    first, second = Hub(), Hub()
    with channel(engine, "a") as a, channel(engine, "b") as b:
        join_hubs(a, first)
        join_hubs(b, second)
        first.publish_state("object", "p", 1, 2, name="newer")
        waiting.until(lambda: second.seq == 1)
        second.publish_state("object", "p", 1, 1, name="older")
        second.publish("review", "p")
        waiting.until(lambda: first.seq == 2)
    assert (first.seq, second.seq) == (2, 2)


@contextmanager
def channel(engine: Engine, name: str, beat_s: float = 3600.0) -> Iterator[Channel]:
    one = Channel(engine, name, beat_s)
    one.start()
    try:
        assert one._listening.wait(PATIENCE_S)
        yield one
    finally:
        one.stop()


def presence(socket: Any, *, at_least: int = 0) -> list[dict[str, Any]]:
    """The people present, from the next presence message or the next one with at least that many."""
    while True:
        message = socket.receive_json()
        if message["type"] == "presence" and len(message["people"]) >= at_least:
            return list(message["people"])
