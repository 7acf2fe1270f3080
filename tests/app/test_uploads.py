"""Interruption and resumption of uploads."""

import os
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import pytest
from sqlmodel import select
from starlette.testclient import TestClient

from app.db.engine import writing
from app.db.tables import Project, Upload
from app.errors import Unavailable
from app.services import accounts, leftovers, uploads
from app.services.at_work import AtWork
from tests.app.conftest import ORIGIN, Running
from tests.app.test_imports import R3D, archive, break_off, left_behind
from tests.app.test_states import step


def begin(web: Running, content: bytes = R3D, **more: Any) -> str:
    return str(web.post("/api/uploads", {"file_name": "Kitchen.r3d", "size": len(content), **more}, 201)["id"])


def send(client: TestClient, upload: str, offset: int, content: Any) -> Any:
    return client.patch(f"/api/uploads/{upload}", content=content, headers={"Upload-Offset": str(offset)})


def finish(web: Running, upload: str, status: int = 202) -> Any:
    return web.post(f"/api/uploads/{upload}/finish", status=status)


def test_an_upload_continues_after_a_server_restart(start: Callable[..., Any]) -> None:
    with start() as web:
        upload = begin(web, name="Aunt's", modified=12.5)
        assert send(web.client, upload, 0, R3D[:100]).headers["upload-offset"] == "100"
    with start() as web:
        head = web.client.head(f"/api/uploads/{upload}")
        assert (head.headers["upload-offset"], head.headers["upload-length"]) == ("100", str(len(R3D)))
        assert head.headers["cache-control"] == "no-store"
        (found,) = web.get("/api/uploads")
        assert (found["file_name"], found["offset"], found["modified"]) == ("Kitchen.r3d", 100, 12.5)
        assert finish(web, upload, 409)["current"] == 100
        assert send(web.client, upload, 100, R3D[100:]).status_code == 204
        project = finish(web, upload)
        assert (project["id"], project["name"]) == (upload, "Aunt's")
        web.until(lambda: web.get(f"/api/projects/{upload}")["status"] == "ready")
        assert web.get("/api/uploads") == []
        assert finish(web, upload)["id"] == upload
        stored = web.settings.data_dir / "projects" / upload / "source" / "Kitchen.r3d"
        assert stored.read_bytes() == R3D
        assert list(web.settings.uploads.iterdir()) == []


def test_the_time_to_approval_includes_the_upload(web: Running) -> None:
    upload = begin(web)
    with writing(web.context.engine) as session:
        row = session.get(Upload, upload)
        assert row is not None
        row.created -= 1000.0  # duration of the upload in seconds
    send(web.client, upload, 0, R3D)
    finish(web, upload)
    web.until(lambda: web.get(f"/api/projects/{upload}")["status"] == "ready")
    for to in ("ready", "in review", "approved"):
        step(web, upload, to, "it is time")
    figures = web.get(f"/api/projects/{upload}/figures")
    assert 1000.0 < figures["upload_to_approval_s"] <= figures["age_s"]


def test_a_piece_at_a_wrong_offset_is_refused_with_the_expected_one(web: Running) -> None:
    upload = begin(web)
    send(web.client, upload, 0, R3D[:50])
    for wrong in (0, 49, 51, 10**9):
        answer = send(web.client, upload, wrong, b"x")
        assert (answer.status_code, answer.json()["current"]) == (409, 50)
    assert send(web.client, upload, 50, R3D[50:] + b"too much").status_code == 413
    for value in ("-1", "x", "1e3", str(2**60)):
        assert web.client.patch(f"/api/uploads/{upload}", headers={"Upload-Offset": value}).status_code == 422
    assert web.client.patch(f"/api/uploads/{upload}").status_code == 422


def test_an_interrupted_piece_is_kept_and_the_upload_resumes(web: Running) -> None:
    upload = begin(web)
    break_off(web, "PATCH", f"/api/uploads/{upload}", R3D[:100], headers={"upload-offset": "0"})
    assert web.client.head(f"/api/uploads/{upload}").headers["upload-offset"] == "100"
    assert send(web.client, upload, 100, R3D[100:]).status_code == 204
    assert finish(web, upload)["id"] == upload


def test_an_unreadable_upload_is_refused_at_its_end_and_leaves_nothing(web: Running) -> None:
    for content, words in ((b"not a zip" * 9, "not a zip"), (archive(("unreadable", b"x")), "no frame can be read")):
        upload = begin(web, content)
        send(web.client, upload, 0, content)
        error = finish(web, upload, 422)
        assert words in error["message"]
        assert "Kitchen.r3d" in error["message"]
        assert str(web.settings.data_dir) not in error["message"]
        assert web.get("/api/uploads") == []
        assert web.get("/api/projects") == []
        assert left_behind(web) == []


def test_a_file_that_is_too_large_is_refused_before_it_is_sent(start: Callable[..., Any]) -> None:
    with start(max_upload_bytes=100) as web:
        assert web.post("/api/uploads", {"file_name": "a", "size": 101}, 413)["kind"] == "too-large"
    with start(min_free_bytes=1 << 60) as web:
        assert web.post("/api/uploads", {"file_name": "a", "size": 1}, 507)["kind"] == "no-space"


@pytest.mark.parametrize(("name", "words"), [("Kitchen.usdz", "a finished 3D model"), ("room.bag", "RealSense bag")])
def test_a_file_with_a_wrong_extension_is_refused_before_it_is_sent(web: Running, name: str, words: str) -> None:
    refused = web.post("/api/uploads", {"file_name": name, "size": 10}, 422)
    assert (refused["kind"], words in refused["message"], bool(refused["hint"])) == ("capture", True, True)
    assert web.get("/api/uploads") == []


def test_an_upload_is_visible_to_its_sender_only(start: Callable[..., Any]) -> None:
    with start() as web:
        accounts.add(web.context.engine, "eve", "reviewer", "three plain words")
        upload = begin(web)
        eve = TestClient(web.app, base_url=ORIGIN, headers={"X-Requested-With": "tests"})
        eve.post("/api/login", json={"name": "eve", "password": "three plain words"})
        assert eve.get("/api/uploads").json() == []
        assert send(eve, upload, 0, b"x").status_code == 404
        assert eve.delete(f"/api/uploads/{upload}").status_code == 404
        assert web.client.delete(f"/api/uploads/{upload}").status_code == 204
        assert web.client.head(f"/api/uploads/{upload}").status_code == 404


def test_conflicting_requests_for_one_upload_are_refused() -> None:
    mine, others = AtWork(), AtWork()
    for first, second, waits in (
        ("sent", "sent", True),
        ("sent", "finished", True),
        ("sent", "deleted", False),  # a cancellation need not wait for the last piece
        ("finished", "deleted", True),
        ("deleted", "finished", True),
    ):
        with mine.on("a", first):
            with others.on("a", second), mine.on("b", second):
                pass
            with pytest.raises(Unavailable) if waits else nullcontext(), mine.on("a", second):
                pass
    with mine.on("a", "finished"):
        pass  # no files are left


def test_abandoned_uploads_are_deleted(web: Running) -> None:
    old, new = begin(web), begin(web)
    os.utime(web.settings.uploads / f"{old}.part", (1, 1))
    uploads.forget_stopped(web.context)
    assert [found["id"] for found in web.get("/api/uploads")] == [new]
    assert [path.name for path in Path(web.settings.uploads).iterdir()] == [f"{new}.part"]


def test_files_without_a_row_are_set_aside_and_half_made_ones_deleted(web: Running, caplog: pytest.LogCaptureFixture) -> None:
    upload, project, finishing = begin(web), web.sample(), interrupted(web)
    data, projects = web.settings.data_dir, web.settings.data_dir / "projects"
    recording = projects / "0123456789ab" / "source" / "scan.r3d"
    half = [web.settings.uploads / "receiving-1f.glb", projects / "given-up"]
    for path in (recording, half[1] / "half-made", half[0], web.settings.uploads / "stray.part"):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(b"bytes")
    leftovers.tidy(web.context)
    assert recording.exists()  # recent files may belong to an operation that is starting
    assert all(path.exists() for path in half)
    for path in (*projects.iterdir(), *web.settings.uploads.iterdir()):
        os.utime(path, (1, 1))
    leftovers.tidy(web.context)
    assert not any(path.exists() for path in half)
    assert {path.name for path in projects.iterdir()} == {project, finishing}
    assert (data / "unknown" / "0123456789ab" / "source" / "scan.r3d").read_bytes() == b"bytes"
    assert (data / "unknown" / "stray.part").read_bytes() == b"bytes"
    assert "0123456789ab" in caplog.text
    assert {found["id"] for found in web.get("/api/uploads")} == {upload, finishing}
    assert web.client.get(f"/media/{project}/frames/3.jpg").status_code == 200


def test_deleting_an_upload_of_a_restored_database_keeps_the_project(web: Running) -> None:
    upload = interrupted(web)
    finish(web, upload)
    with writing(web.context.engine) as session:  # the state before finishing
        session.delete(session.get(Project, upload))
        session.add(Upload(id=upload, file_name="Kitchen.r3d", size=len(R3D), who="tester", created=1.0))
    uploads.forget_stopped(web.context)
    leftovers.tidy(web.context)
    assert (web.settings.data_dir / "projects" / upload / "source" / "Kitchen.r3d").read_bytes() == R3D


def interrupted(web: Running, content: bytes = R3D) -> str:
    """Id of an upload whose server was killed while finishing it, after its bytes were moved."""
    upload = begin(web, content)
    send(web.client, upload, 0, content)
    source = web.settings.data_dir / "projects" / upload / "source"
    source.mkdir(parents=True)
    (source.parent / "half-made").touch()
    (web.settings.uploads / f"{upload}.part").rename(source / "Kitchen.r3d")
    return upload


def test_finishing_an_upload_again_recovers_from_a_crash(web: Running) -> None:
    upload = interrupted(web)
    assert int(web.client.head(f"/api/uploads/{upload}").headers["upload-offset"]) == len(R3D)
    assert finish(web, upload)["id"] == upload


def test_an_upload_refused_or_deleted_after_a_crash_leaves_nothing(web: Running) -> None:
    finish(web, interrupted(web, archive(("unreadable", b"x"))), 422)
    assert left_behind(web) == []
    assert web.client.delete(f"/api/uploads/{interrupted(web)}").status_code == 204
    assert left_behind(web) == []
    upload = interrupted(web)
    with writing(web.context.engine) as session:
        for row in session.exec(select(Upload)):
            row.created = 1.0
            session.add(row)
    uploads.forget_stopped(web.context)
    assert (left_behind(web), web.get("/api/uploads")) == ([], [])
    assert finish(web, upload, 404)["kind"] == "not-found"


def test_an_upload_whose_file_was_deleted_restarts_at_zero(web: Running) -> None:
    upload = begin(web)
    send(web.client, upload, 0, R3D[:50])
    (web.settings.uploads / f"{upload}.part").unlink()
    assert [found["offset"] for found in web.get("/api/uploads")] == [0]
    assert send(web.client, upload, 0, R3D).status_code == 204
    assert finish(web, upload)["id"] == upload
