import errno
import sqlite3

import pytest
from sqlalchemy.exc import OperationalError

from app.errors import KINDS, error_body, kind_of
from r2c2r_core import errors as core
from tests.app.conftest import Running, refusing

SHAPE = {"kind", "message", "hint", "current"}


def routes(web: Running) -> list[tuple[str, str]]:
    document = web.app.openapi()
    return [(method.upper(), path) for path, methods in document["paths"].items() for method in methods]


def test_every_endpoint_returns_errors_in_the_same_format(web: Running) -> None:
    for method, path in routes(web):
        filled = path.replace("{project}", "none").replace("{object}", "1").replace("{job}", "1").replace("{point}", "1")
        filled = filled.replace("{frame}", "1").replace("{candidate}", "c0").replace("{version}", "1")
        if "{" not in path:
            continue
        answer = web.client.request(
            method, filled, params={"filename": "x.glb"}, json={} if method in ("POST", "PATCH") else None
        )
        assert 400 <= answer.status_code < 500, (method, path, answer.status_code)
        if method != "HEAD":  # has no body
            assert set(answer.json()) == SHAPE, (method, path)


@pytest.mark.parametrize(
    ("method", "path", "status", "kind"),
    [
        ("GET", "/nowhere", 404, "not-found"),
        ("PUT", "/api/projects", 405, "method-not-allowed"),
        ("GET", "/api/jobs/notanumber", 422, "invalid"),
        ("GET", "/api/jobs/99999999999999999999999", 422, "invalid"),
        ("GET", "/api/jobs?limit=99999999999999999999999", 422, "invalid"),
    ],
)
def test_framework_errors_have_the_same_format(shared_web: Running, method: str, path: str, status: int, kind: str) -> None:
    answer = shared_web.client.request(method, path)
    assert (answer.status_code, answer.json()["kind"]) == (status, kind)
    assert set(answer.json()) == SHAPE


@pytest.mark.parametrize("body", [b"{", b"[]", b'{"seed": "x"}', b'{"seed": 1, "unknown": 2}', b'{"seed": NaN}', b"\xff\xfe"])
def test_a_malformed_body_is_rejected_as_invalid(shared_web: Running, body: bytes) -> None:
    answer = shared_web.client.post("/api/projects/sample", content=body, headers={"content-type": "application/json"})
    assert (answer.status_code, answer.json()["kind"]) == (422, "invalid")
    assert set(answer.json()) == SHAPE


def test_an_unexpected_error_is_detailed_in_the_log_only(
    web: Running, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def boom(*_: object) -> None:
        raise RuntimeError("secret detail")

    monkeypatch.setattr("app.services.projects.list_projects", boom)
    answer = web.client.get("/api/projects")
    assert (answer.status_code, answer.json()["kind"]) == (500, "internal")
    assert "secret" not in answer.text
    assert "secret detail" in caplog.text


def test_every_core_error_has_a_kind_a_status_and_its_hint() -> None:
    def below(cls: type[core.R2C2RError]) -> list[type[core.R2C2RError]]:
        return [cls, *(found for sub in cls.__subclasses__() for found in below(sub))]

    for cls in below(core.R2C2RError):
        error = cls("what", hint="next")
        kind, status = kind_of(error)
        assert kind.islower()
        assert 400 <= status < 600
        assert error_body(error)["hint"] == "next"


def test_error_kinds_list_subclasses_before_their_base_classes() -> None:
    seen: list[type[core.R2C2RError]] = []
    for cls, _, _ in KINDS:
        assert not any(issubclass(cls, earlier) for earlier in seen), cls
        seen.append(cls)


def test_every_route_has_a_unique_operation_id(shared_web: Running) -> None:
    names = [
        operation["operationId"] for methods in shared_web.app.openapi()["paths"].values() for operation in methods.values()
    ]
    assert len(names) == len(set(names))


def test_a_full_disk_is_reported_and_no_data_is_lost(web: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    project = web.sample()

    def full(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("anyio.open_file", full)
    refused = web.client.post("/api/projects/upload?filename=a.r3d", content=b"PK\3\4abc")
    assert (refused.status_code, refused.json()["kind"]) == (507, "no-space")
    assert [p["id"] for p in web.get("/api/projects")] == [project]
    monkeypatch.setattr("app.jobs.compute.Worker", full)
    job = web.job(web.post(f"/api/projects/{project}/run", {}, 202)["id"], "failed")
    assert job["error"]["kind"] == "no-space"
    assert len(web.get(f"/api/projects/{project}/objects")) == 2


@pytest.mark.parametrize(
    ("said", "code", "status", "kind"),
    [
        ("database is locked", sqlite3.SQLITE_BUSY, 503, "unavailable"),
        ("database or disk is full", sqlite3.SQLITE_FULL, 507, "no-space"),
        ("database disk image is malformed", sqlite3.SQLITE_CORRUPT, 503, "database"),
        ("disk I/O error", sqlite3.SQLITE_IOERR_READ, 503, "database"),
    ],
)
def test_database_failures_are_reported_by_every_kind_of_request(
    web: Running, said: str, code: int, status: int, kind: str
) -> None:
    found = sqlite3.OperationalError(said)
    found.sqlite_errorcode = code
    marked = {"Idempotency-Key": "k"}
    asked = [
        lambda: web.client.get("/api/projects"),
        lambda: web.client.post("/api/projects/sample", json={}),
        lambda: web.client.post("/api/projects/sample", json={}, headers=marked),  # raised in the code that stores keys
        lambda: web.client.get("/media/x/thumbnail.jpg"),  # raised in the session look-up
    ]
    with refusing(web.context.engine, OperationalError("BEGIN", None, found)):
        for ask in asked:
            web.context.people.look_again()
            answer = ask()
            assert (answer.status_code, answer.json()["kind"], set(answer.json())) == (status, kind, SHAPE)
        assert web.client.get("/static/index.html").status_code == 200  # public
    assert web.get("/api/projects") == []


def test_the_queue_continues_after_an_unexpected_error(web: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    project = web.sample()

    def boom(*_: object) -> None:
        raise ZeroDivisionError

    with monkeypatch.context() as broken:
        broken.setattr("app.jobs.rows.steps_of", boom)
        job = web.job(web.post(f"/api/projects/{project}/run", {}, 202)["id"], "failed")
    assert job["error"]["kind"] == "internal"
    again = web.post(f"/api/jobs/{job['id']}/retry", status=202)
    assert web.job(again["id"], "done")["state"] == "done"
