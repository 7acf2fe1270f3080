"""Idempotency keys: a change that is repeated because its response was lost is not applied twice."""

import contextlib
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest
from sqlmodel import select

from app.db import once
from app.db.engine import reading, writing
from app.db.once import Sending
from app.db.tables import (
    Comment,
    Event,
    Job,
    Override,
    Point,
    Project,
    ProjectMember,
    SceneObject,
    SentChange,
    TrueLength,
    Verdict,
)
from app.errors import Conflict
from app.routes.once import COVERED
from app.services import accounts, prompts, sending
from app.settings import Settings
from app.viewer.client import Viewer
from tests.app.conftest import PATIENT, Running, commits, fake
from tests.app.nouns import finish
from tests.app.test_honeypots import write_truth
from tests.app.test_imports import R3D
from tests.app.test_jobs import behave, run
from tests.app.test_uploads import begin, send

pytestmark = pytest.mark.both_databases


CLICK = {"frame": 3, "x": 20.0, "y": 20.0, "label": 1}


@pytest.fixture
def at(web: Running) -> str:
    return f"/api/projects/{web.sample()}"


def keyed(web: Running, method: str, path: str, key: str, body: Any = None) -> Any:
    return web.client.request(method, path, json=body, headers={"Idempotency-Key": key})


def test_a_click_sent_twice_with_one_key_is_added_once(web: Running, at: str) -> None:
    first = keyed(web, "POST", f"{at}/objects/1/points", "k1", CLICK)
    again = keyed(web, "POST", f"{at}/objects/1/points", "k1", CLICK)
    assert (first.status_code, again.status_code) == (201, 201)
    assert again.json() == first.json()
    assert again.headers["idempotency-replayed"] == "true"
    assert web.get(f"{at}/objects")[0]["points"] == first.json()["points"]


def test_requests_with_different_keys_or_none_are_separate_changes(web: Running, at: str) -> None:
    before = len(web.get(f"{at}/objects")[0]["points"])
    for key in ("a", "b"):
        keyed(web, "POST", f"{at}/objects/1/points", key, CLICK)
    for _ in range(2):
        web.post(f"{at}/objects/1/points", CLICK)
    assert len(web.get(f"{at}/objects")[0]["points"]) == before + 4


def test_a_change_queued_by_one_person_is_refused_for_another(web: Running, at: str) -> None:
    before = web.get(f"{at}/objects")[0]["points"]
    headers = {"Idempotency-Key": "whose", "X-R2C2R-Person": "J%C3%BCrgen"}
    refused = web.client.post(f"{at}/objects/1/points", json=CLICK, headers=headers)
    assert refused.status_code == 401
    assert "Jürgen" in refused.json()["message"]
    assert web.get(f"{at}/objects")[0]["points"] == before
    own = {**headers, "X-R2C2R-Person": web.get("/api/system")["user"]}
    assert web.client.post(f"{at}/objects/1/points", json=CLICK, headers=own).status_code == 201


def test_an_undo_repeated_after_a_lost_response_is_applied_once(web: Running, at: str) -> None:
    for _ in range(3):
        web.post(f"{at}/objects/1/points", CLICK)
    before = len(web.get(f"{at}/objects")[0]["points"])
    _cut_off(web, f"{at}/undo", b'{"object": 1}', "undo-1")
    assert len(web.get(f"{at}/objects")[0]["points"]) == before - 1
    assert keyed(web, "POST", f"{at}/undo", "undo-1", {"object": 1}).status_code == 200
    assert len(web.get(f"{at}/objects")[0]["points"]) == before - 1


def test_a_repeat_after_a_crash_reports_that_the_change_is_stored(
    start: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    with start() as web:
        at = f"/api/projects/{web.sample()}"
        with monkeypatch.context() as patch:
            patch.setattr(sending, "keep", lambda *_: None)  # the server has died
            keyed(web, "POST", f"{at}/comments", "k", {"text": "look"})
    with start() as web:
        again = keyed(web, "POST", f"{at}/comments", "k", {"text": "look"})
        assert (again.status_code, "is stored" in again.json()["message"]) == (409, True)
        assert len(web.get(f"{at}/comments")) == 1


def test_a_click_and_its_response_are_stored_in_one_transaction(
    start: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    with start() as web:
        at = f"/api/projects/{web.sample()}"
        monkeypatch.setattr(sending, "keep", lambda *_: None)  # the server dies after the change is stored
        with commits(web.context.engine) as stored:
            first = keyed(web, "POST", f"{at}/objects/1/points?infer=false", "k", CLICK)
            undone = keyed(web, "POST", f"{at}/undo", "u", {"object": 1})
            assert len(stored) == 2
    with start() as web:
        click = keyed(web, "POST", f"{at}/objects/1/points?infer=false", "k", CLICK)
        undo = keyed(web, "POST", f"{at}/undo", "u", {"object": 1})
        assert (click.status_code, click.content) == (201, first.content)
        assert (undo.status_code, undo.json()["object"]["version"]) == (200, undone.json()["object"]["version"])
        assert web.get(f"{at}/objects")[0]["points"] == undone.json()["object"]["points"]


def test_refused_requests_do_not_consume_their_key(web: Running, at: str) -> None:
    assert keyed(web, "POST", f"{at}/redo", "r", {"object": 1}).status_code == 409
    web.post(f"{at}/objects/1/points", CLICK)
    web.post(f"{at}/undo", {"object": 1})
    assert keyed(web, "POST", f"{at}/redo", "r", {"object": 1}).status_code == 200


def test_a_key_reused_for_another_change_is_rejected(web: Running, at: str) -> None:
    keyed(web, "POST", f"{at}/objects/1/points", "k", CLICK)
    refused = keyed(web, "POST", f"{at}/objects/2/points", "k", CLICK)
    assert (refused.status_code, refused.json()["kind"]) == (422, "input")
    assert [len(item["points"]) for item in web.get(f"{at}/objects")] == [2, 1]
    assert keyed(web, "POST", f"{at}/objects/1/points", "k" * 200, CLICK).status_code == 422


def test_concurrent_repeats_apply_once_and_are_all_answered(web: Running, at: str, monkeypatch: pytest.MonkeyPatch) -> None:
    before = len(web.get(f"{at}/objects")[0]["points"])
    came: list[int] = []
    check, add = sending.check_person, prompts.add_point

    def arrive(*given: Any) -> None:
        came.append(1)
        check(*given)

    def add_late(*given: Any) -> Any:
        web.until(lambda: len(came) == 4)  # the first is still in progress when the last arrives
        return add(*given)

    monkeypatch.setattr(sending, "check_person", arrive)
    monkeypatch.setattr(prompts, "add_point", add_late)
    with ThreadPoolExecutor(4) as pool:
        sent = [pool.submit(keyed, web, "POST", f"{at}/objects/1/points", "twin", CLICK) for _ in range(4)]
        answers = [each.result() for each in sent]
    assert [answer.status_code for answer in answers] == [201] * 4
    assert len({answer.content for answer in answers}) == 1
    assert ["idempotency-replayed" in answer.headers for answer in answers].count(True) == 3
    assert len(web.get(f"{at}/objects")[0]["points"]) == before + 1


def test_keys_expire_and_are_deleted_with_their_project(web: Running, at: str, monkeypatch: pytest.MonkeyPatch) -> None:
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
    assert _kept(web) == 1  # a project in the trash is complete
    web.delete(at.replace("/projects/", "/trash/"))
    assert _kept(web) == 0


@pytest.mark.both_databases(quick=False)
def test_every_repeatable_operation_is_idempotent(start: Callable[..., Any], tmp_path: Path) -> None:
    viewer = Viewer(Settings(data_dir=tmp_path / "data", **PATIENT), fake("viewer"))
    with start(viewer=viewer) as web:
        tried = set()
        for operation, method, path, sent in changes(web, tmp_path):
            before = stored(web)
            first = send_marked(web, method, path, operation, sent)
            assert first.status_code in (200, 201, 202), f"{operation}: {first.text}"
            after = stored(web)
            assert (after == before) == (operation in CHANGES_NOTHING_STORED), operation
            again = send_marked(web, method, path, operation, sent)
            assert again.status_code == first.status_code, f"{operation}: {again.text}"
            assert stored(web) == after, operation
            if operation not in CHANGES_NOTHING_STORED:
                assert (again.content, again.headers["idempotency-replayed"]) == (first.content, "true"), operation
            tried.add(operation)
    assert tried == covered(web)


CHANGES_NOTHING_STORED = {"openLive", "segmentObject", "cancelSegment", "cancelJob", "deleteVariants"} | {
    "openViewer", "showInViewer", "setJoints", "placeInViewer",
    "lookAtMesh", "assignProject", "markSeen",  # there are no accounts here
}  # fmt: skip


def changes(web: Running, folder: Path) -> Iterator[tuple[str, str, str, Any]]:
    """(operation, method, path, body) of every repeatable change, in an order in which each is possible."""
    project = web.sample()
    at, on = f"/api/projects/{project}", f"/api/projects/{project}/objects/1"
    web.job(run(web, project), "done")
    finish(web.settings.data_dir / "projects" / project / "work")
    (folder / "elsewhere").mkdir()
    (folder / "elsewhere" / "frame.txt").touch()
    yield "sampleProject", "POST", "/api/projects/sample", {}
    yield "importProject", "POST", "/api/projects/import", {"path": str(folder / "elsewhere")}
    yield "duplicateProject", "POST", f"{at}/duplicate", None
    yield "createObject", "POST", f"{at}/objects", {"category": "mug", "points": [CLICK]}
    yield "editObject", "PATCH", on, {"colour": 5}
    yield "addPoint", "POST", f"{on}/points", CLICK
    yield "addPoints", "POST", f"{on}/clicks", {"points": [CLICK, CLICK]}
    first, *_, last = web.get(f"{at}/objects")[0]["points"]
    yield "movePoint", "PATCH", f"{on}/points/{first['id']}", {"x": 11.0}
    yield "deletePoint", "DELETE", f"{on}/points/{last['id']}", None
    yield "setFrame", "PUT", f"{on}/frames/3", {"mask": None}
    yield "leaveFrame", "DELETE", f"{on}/frames/3", None
    yield "undo", "POST", f"{at}/undo", {"object": 1}
    yield "redo", "POST", f"{at}/redo", {"object": 1}
    named = {"name": "of_the_file", "category": "mug", "points": [CLICK]}
    yield "importPrompts", "POST", f"{at}/prompts.json", {"version": 1, "objects": [named]}
    yield "openLive", "POST", f"{at}/live/open", None
    yield "segmentObject", "POST", f"{on}/segment", None
    yield "cancelSegment", "POST", f"{on}/segment/cancel", None
    web.until(lambda: web.get(f"{at}/proposals")["state"] == "done")
    one, another = (proposal["id"] for proposal in web.get(f"{at}/proposals")["items"][:2])
    yield "confirmProposals", "POST", f"{at}/proposals/confirm", {"ids": [one]}
    yield "dismissProposals", "POST", f"{at}/proposals/dismiss", {"ids": [another]}
    yield "restoreProposals", "POST", f"{at}/proposals/restore", None
    yield "giveVerdict", "POST", f"{on}/verdicts", {"candidate": "c1", "verdict": "accepted", "rerun": False}
    yield "setOverride", "PATCH", f"{on}/override", {"hinge": "left", "rerun": False}
    yield "correctMade", "PATCH", f"{at}/scene/drawer_1/override", {"joint_upper": 0.3, "rerun": False}
    yield "lookAtMesh", "POST", f"{on}/mesh-look?filename=mine.glb", b"glTF"
    yield "uploadCandidate", "POST", f"{on}/candidates?filename=mine.glb&rerun=false", b"glTF"
    yield "addComment", "POST", f"{at}/comments", {"text": "look"}
    yield "changeComment", "PATCH", f"{at}/comments/1", {"resolved": True}
    points = [[0.0, 0.0, 0.9], [0.6, 0.0, 0.9]]
    yield "addLength", "POST", f"{at}/lengths", {"metres": 0.6, "points_world": points}
    yield "removeLength", "DELETE", f"{at}/lengths/1", None
    yield "setMembers", "PUT", f"{at}/members", {"members_only": True}
    yield "makeVariants", "POST", f"{at}/variants", {"version": 1, "count": 2}
    web.until(lambda: web.get(f"{at}/variants")["sets"] != [])
    yield "deleteVariants", "DELETE", f"{at}/variants/v1-n2-s0", None
    objects = [{"name": "left_door", "category": "cabinet"}]
    listed = web.post("/api/templates", {"name": "narrow", "objects": objects}, 201)["id"]
    yield "setChecklist", "PUT", f"{at}/checklist", {"template": listed}
    yield "askOpinion", "POST", f"{at}/opinions", {"name": None}
    yield "assignProject", "PUT", f"{at}/assignee", {"name": None}
    yield "markSeen", "PUT", f"{at}/news", {"event": 1}
    yield "openViewer", "POST", f"{at}/viewer", None
    yield "showInViewer", "POST", f"{at}/viewer/show", {"mode": "cloud"}
    yield "setJoints", "POST", f"{at}/viewer/joints", {"values": {"door": 0.5}}
    yield "placeInViewer", "POST", f"{at}/viewer/place", {"pose": None}
    yield "readAgain", "PUT", f"{at}/reading", {"register_depth": True}
    yield "giveRecording", "PUT", *_missing_recording(web, at)
    write_truth(web.settings.data_dir / "projects" / project / "source")
    accounts.add(web.context.engine, "alice", "annotator", "correct horse battery")
    yield "slipHoneypot", "POST", f"{at}/honeypot", {"person": "alice", "name": "Flat 7"}
    held = behave(web, project, segment="hang")
    yield "runProject", "POST", f"{at}/run", {}
    web.until(lambda: (held / "hanging").exists())
    job = web.get(f"/api/jobs?project={project}")[0]["id"]
    yield "cancelJob", "POST", f"/api/jobs/{job}/cancel", None
    web.job(job, "cancelled")
    yield "retryJob", "POST", f"/api/jobs/{job}/retry", None
    yield "stepReview", "POST", f"{at}/review", {"from_state": "draft", "to": "ready", "reason": "go"}
    yield "deleteObject", "DELETE", on, None


def _missing_recording(web: Running, at: str) -> tuple[str, dict[str, str]]:
    """A project without its recording, which has been uploaded."""
    web.until(lambda: web.get(at)["status"] == "ready")
    said = web.client.get(f"/media/{at.removeprefix('/api/projects/')}/project.zip").content
    lacks = web.post("/api/projects/upload?filename=x.zip", content=said, status=202)["id"]
    sent = begin(web)
    send(web.client, sent, 0, R3D)
    return f"/api/projects/{lacks}/recording", {"upload": sent}


def covered(web: Running) -> set[str]:
    """Every operation that changes something and may be repeated."""
    paths = web.app.openapi()["paths"]
    return {
        said["operationId"]
        for path, methods in paths.items()
        for method, said in methods.items()
        if method not in ("get", "head") and COVERED.fullmatch(path)
    }


def stored(web: Running) -> Any:
    """People's inputs and queued jobs: all that a change may affect, once no import is about to add something."""
    busy = ("queued", "running")
    web.until(lambda: not [job for job in web.get("/api/jobs") if job["kind"] != "run" and job["state"] in busy])
    people = (Project.id, Project.members_only, ProjectMember, Job.id, Comment, Event)
    tables = (*people, SceneObject, Point, Override, Verdict, TrueLength)
    with reading(web.context.engine) as session:
        rows = [sorted(repr(row) for row in session.exec(select(table))) for table in tables]
    return rows, sorted(path.name for path in web.settings.data_dir.glob("projects/*/uploads/*/*"))


def send_marked(web: Running, method: str, path: str, key: str, sent: Any) -> Any:
    if isinstance(sent, bytes):
        return web.client.request(method, path, content=sent, headers={"Idempotency-Key": key})
    return keyed(web, method, path, key, sent)


def test_the_database_rejects_a_second_transaction_of_one_change(web: Running, at: str) -> None:
    change = Sending("digest", "POST /x", None)
    with once.marked(change):
        with writing(web.context.engine) as session:
            session.get(Project, at)
        with pytest.raises(Conflict, match="stored already"), writing(web.context.engine) as session:
            session.add(Job(project_id=at.split("/")[3], kind="run", state="done", created=1.0))
    assert "run" not in [job["kind"] for job in web.get("/api/jobs")]


def _kept(web: Running) -> int:
    with reading(web.context.engine) as session:
        return len(session.exec(select(SentChange)).all())


def _cut_off(web: Running, path: str, body: bytes, key: str) -> None:
    """Send a change, and disconnect before the response."""
    cookies = "; ".join(f"{name}={value}" for name, value in web.client.cookies.items())
    told = {"host": "127.0.0.1:8000", "cookie": cookies, "x-requested-with": "t", "idempotency-key": key}
    headers = [(name.encode(), value.encode()) for name, value in {**told, "content-type": "application/json"}.items()]
    scope = {"type": "http", "method": "POST", "path": path, "query_string": b"", "headers": headers}
    scope["server"] = ("127.0.0.1", 8000)  # the session cookie's name contains the port
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
