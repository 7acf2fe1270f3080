"""A project restricted to its members is invisible to everybody else."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from argon2 import PasswordHasher
from starlette.testclient import TestClient
from starlette.websockets import WebSocketDisconnect

from app.services import accounts
from app.viewer.client import Opened
from tests.app.conftest import ORIGIN, SOCKETS, Running, running

pytestmark = pytest.mark.both_databases


PASSWORD = "correct horse battery"
PEOPLE = {"alice": "annotator", "bob": "reviewer", "carol": "reviewer", "root": "admin"}


class Kept:
    """A server, a client for each person, and Alice's project, restricted to her and Bob."""

    def __init__(self, web: Running) -> None:
        self.web = web
        self.of = {name: TestClient(web.app, base_url=ORIGIN, headers={"X-Requested-With": "t"}) for name in PEOPLE}
        for name, client in self.of.items():
            assert client.post("/api/login", json={"name": name, "password": PASSWORD}).status_code == 204
        self.project = self.of["alice"].post("/api/projects/sample", json={}).json()["id"]
        web.until(lambda: self.of["alice"].get(f"/api/projects/{self.project}").json()["status"] == "ready")
        self.jobs = [job["id"] for job in self.of["alice"].get("/api/jobs").json()]

    @property
    def members(self) -> str:
        return f"/api/projects/{self.project}/members"

    def keep_to(self, *names: str, by: str = "alice", members_only: bool = True) -> Any:
        return self.of[by].put(self.members, json={"members_only": members_only, "members": list(names)})


@pytest.fixture
def kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Kept]:
    quick = PasswordHasher(time_cost=1, memory_cost=8, parallelism=1)
    monkeypatch.setattr(accounts, "_hasher", lambda: quick)
    with running(tmp_path / "data") as web:
        for name, role in PEOPLE.items():
            accounts.add(web.context.engine, name, role, PASSWORD)
        yield Kept(web)


def about(kept: Kept) -> list[tuple[str, str, str]]:
    """(operation, method, its path for Alice's project) of all operations about a project or a job."""
    found = []
    for path, methods in kept.web.app.openapi()["paths"].items():
        if "{project}" in path or "{job}" in path:
            filled = path.replace("{project}", kept.project).replace("{job}", str(kept.jobs[0]))
            filled = re.sub(r"\{side\}", "plan", re.sub(r"\{(object|point|frame|version|comment|elevation)\}", "1", filled))
            found += [
                (said["operationId"], method.upper(), re.sub(r"\{\w+\}", "c0", filled)) for method, said in methods.items()
            ]
    return found


@pytest.mark.both_databases(quick=False)
def test_every_operation_on_the_project_is_not_found_by_non_members(kept: Kept) -> None:
    assert kept.keep_to("bob").json()["members"] == ["bob"]
    operations = about(kept)
    assert len(operations) > 60
    for operation, method, path in operations:
        answer = kept.of["carol"].request(method, path, json={})
        assert answer.status_code == 404, operation
        assert answer.json()["kind"] == "not-found"
    assert kept.of["carol"].post(f"/api/jobs/+{kept.jobs[0]}/cancel").status_code == 404
    for name in ("alice", "bob", "root"):
        assert kept.of[name].get(f"/api/projects/{kept.project}").status_code == 200
        assert kept.of[name].get(f"/api/jobs/{kept.jobs[0]}").status_code == 200


@pytest.mark.both_databases(quick=False)
def test_lists_and_pages_hide_the_project_from_non_members(kept: Kept) -> None:
    kept.keep_to("bob")
    for name, seen in (("alice", 1), ("bob", 1), ("root", 1), ("carol", 0)):
        assert len(kept.of[name].get("/api/projects").json()) == seen
        assert len(kept.of[name].get("/api/jobs").json()) == len(kept.of[name].get(f"/api/jobs?project={kept.project}").json())
        assert bool(kept.of[name].get("/api/jobs").json()) == bool(seen)
        page = kept.of[name].get(f"/p/{kept.project}/annotate")
        assert page.status_code == 200
        assert (f"/media/{kept.project}" in page.text) == bool(seen)


@pytest.mark.both_databases(quick=False)
def test_live_messages_are_sent_to_members_only(kept: Kept) -> None:
    address, sockets = f"{SOCKETS}/api/live?project={kept.project}", {"headers": {"origin": ORIGIN}}
    with (
        kept.of["carol"].websocket_connect(address, **sockets) as carol,
        kept.of["bob"].websocket_connect(address, **sockets) as bob,
    ):
        kept.keep_to("bob")
        kept.of["bob"].post(f"/api/projects/{kept.project}/comments", json={"text": "for us"})
        kept.web.context.hub.publish("job", kept.project, job=1)
        kept.web.context.hub.publish("projects", None, last=True)

        def until_last(socket: Any) -> list[str]:
            types: list[str] = []
            while not (message := socket.receive_json()).get("last"):
                types.append(message["type"])
            return types

        assert {"comments", "job"} <= set(until_last(bob))
        assert not {"comments", "job"} & set(until_last(carol))


@pytest.mark.both_databases(quick=False)
def test_a_person_who_loses_access_to_an_open_project_is_notified(kept: Kept) -> None:
    address, sockets = f"{SOCKETS}/api/live?project={kept.project}", {"headers": {"origin": ORIGIN}}

    def told_gone(socket: Any) -> bool:
        """Whether its deletion is reported among the messages sent so far."""
        kept.web.context.hub.publish("projects", None, last=True)
        gone = False
        while not (message := socket.receive_json()).get("last"):
            gone |= message["type"] == "gone" and message["project"] == kept.project
        return gone

    with (
        kept.of["carol"].websocket_connect(address, **sockets) as carol,
        kept.of["bob"].websocket_connect(address, **sockets) as bob,
        kept.of["root"].websocket_connect(address, **sockets) as root,
    ):
        assert not told_gone(carol)
        kept.keep_to("bob")
        assert [told_gone(each) for each in (carol, bob, root)] == [True, False, False]
        accounts.add(kept.web.context.engine, "second", "admin", PASSWORD)
        accounts.change(kept.web.context.engine, "root", role="reviewer")
        kept.web.context.people.look_again()
        while (message := root.receive_json())["type"] != "gone":
            pass
        assert message["project"] == kept.project


@pytest.mark.both_databases(quick=False)
def test_a_person_in_a_project_that_is_deleted_is_notified(kept: Kept) -> None:
    with kept.of["carol"].websocket_connect(f"{SOCKETS}/api/live?project={kept.project}", headers={"origin": ORIGIN}) as carol:
        assert kept.of["root"].delete(f"/api/projects/{kept.project}").status_code == 200
        while (message := carol.receive_json())["type"] != "gone":
            pass
        assert (message["project"], message["why"]) == (kept.project, "was put into the trash")


@pytest.mark.both_databases(quick=False)
def test_a_person_without_access_cannot_reach_a_3d_view(kept: Kept, monkeypatch: pytest.MonkeyPatch) -> None:
    kept.keep_to("bob")
    monkeypatch.setattr(type(kept.web.context.viewer), "project_of", lambda _, token: kept.project)
    assert kept.of["carol"].get("/viewer/token/").status_code == 404
    with (
        pytest.raises(WebSocketDisconnect) as closed,
        kept.of["carol"].websocket_connect(f"{SOCKETS}/viewer/token/", headers={"origin": ORIGIN}),
    ):
        pass
    assert closed.value.code == 4404


@pytest.mark.both_databases(quick=False)
def test_restricting_a_project_closes_the_3d_views_of_non_members(kept: Kept) -> None:
    project, viewer = kept.project, kept.web.context.viewer
    sessions = {name: next(iter(kept.of[name].cookies.values())) for name in PEOPLE}
    views = {name: Opened(project, session, Path()) for name, session in sessions.items()}
    vars(viewer)["_views"].update({(project, view.session): view for view in views.values()})
    kept.keep_to("bob")
    assert {name for name in PEOPLE if viewer.project_of(views[name].token) == project} == {"alice", "bob", "root"}


def test_only_the_owner_and_admins_set_members(kept: Kept) -> None:
    assert kept.keep_to("bob", by="bob").status_code == 403
    assert kept.keep_to("nobody").status_code == 422
    assert kept.keep_to("bob", by="root").json()["owner"] == "alice"
    assert kept.of["bob"].get(kept.members).json() == {
        "members_only": True, "owner": "alice", "members": ["bob"], "may_change": False, "accounts": [],
    }  # fmt: skip
    assert kept.of["alice"].get(kept.members).json()["accounts"] == ["bob", "carol", "root"]
    history = kept.of["alice"].get(f"/api/projects/{kept.project}/history").json()
    assert history[0]["text"] == "only its owner and bob see it"


@pytest.mark.both_databases(quick=False)
def test_a_project_is_restricted_only_while_members_only_is_set(kept: Kept) -> None:
    for change in ((), (True,), (False,)):
        if change:
            kept.keep_to(members_only=change[0])
        expected = 404 if change == (True,) else 200
        assert kept.of["carol"].get(f"/api/projects/{kept.project}").status_code == expected


def test_a_recreated_account_does_not_inherit_membership(kept: Kept) -> None:
    kept.keep_to("bob")
    for name in ("bob", "alice"):
        assert kept.of["root"].delete(f"/api/accounts/{name}").status_code == 204
    accounts.add(kept.web.context.engine, "bob", "reviewer", PASSWORD)
    assert kept.of["bob"].post("/api/login", json={"name": "bob", "password": PASSWORD}).status_code == 204
    assert kept.of["bob"].get(f"/api/projects/{kept.project}").status_code == 404
    assert kept.of["root"].get(kept.members).json()["owner"] is None


def test_members_are_kept_after_a_restart(kept: Kept) -> None:
    kept.keep_to("bob")
    kept.web.context.access.look_again()  # as at a restart
    assert kept.of["carol"].get(f"/api/projects/{kept.project}").status_code == 404
    assert kept.of["bob"].get(f"/api/projects/{kept.project}").status_code == 200
