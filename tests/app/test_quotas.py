"""Quotas per person, refused with a one-line message that states the remedy."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from argon2 import PasswordHasher
from sqlalchemy import update
from starlette.testclient import TestClient

from app.db.engine import writing
from app.db.tables import Project
from app.services import accounts
from app.settings import Quotas, quotas_from
from r2c2r_core.errors import InputError
from tests.app.conftest import ORIGIN, Running, running

pytestmark = pytest.mark.both_databases


PASSWORD = "correct horse battery"


@pytest.fixture
def web(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Running]:
    quick = PasswordHasher(time_cost=1, memory_cost=8, parallelism=1)
    monkeypatch.setattr(accounts, "_hasher", lambda: quick)
    quotas = Quotas(jobs=2, uploads=2, upload_gb=1, samples=3, projects=4)
    with running(tmp_path / "data", quotas=quotas, run_jobs=False) as web:
        for name, role in (("alice", "annotator"), ("bob", "reviewer"), ("root", "admin")):
            accounts.add(web.context.engine, name, role, PASSWORD)
        yield web


def browser(web: Running, name: str) -> TestClient:
    client = TestClient(web.app, base_url=ORIGIN, headers={"X-Requested-With": "t"}, raise_server_exceptions=False)
    assert client.post("/api/login", json={"name": name, "password": PASSWORD}).status_code == 204
    return client


def refused(answer: Any, status: int, *words: str) -> None:
    assert answer.status_code == status, answer.text
    said = answer.json()
    assert all(word in said["message"] + said["hint"] for word in (*words, "r2c2r serve --quota"))
    assert "\n" not in said["message"] + said["hint"]
    assert (status == 429) == ("retry-after" in answer.headers)


def sample(client: TestClient) -> Any:
    return client.post("/api/projects/sample", json={})


def test_unfinished_jobs_are_limited_per_person(web: Running) -> None:
    alice, bob = browser(web, "alice"), browser(web, "bob")
    made = [sample(alice).json()["job"]["id"] for _ in range(2)]
    refused(sample(alice), 429, "2 of your jobs", "the limit is 2", "cancel")
    assert sample(bob).status_code == 202
    assert alice.post(f"/api/jobs/{made[0]}/cancel").status_code == 200
    assert sample(alice).status_code == 202
    refused(alice.post(f"/api/jobs/{made[0]}/retry"), 429, "jobs")


def test_samples_and_projects_are_limited_per_person(web: Running) -> None:
    alice = browser(web, "alice")

    def make() -> None:
        job = sample(alice).json()["job"]["id"]
        alice.post(f"/api/jobs/{job}/cancel")

    for _ in range(3):
        make()
    refused(sample(alice), 409, "3 samples", "admin")
    with writing(web.context.engine) as session:
        session.exec(update(Project).values(source_name="scan.r3d"))
    make()
    refused(sample(alice), 409, "4 projects", "admin")
    assert sample(browser(web, "bob")).status_code == 202


def test_open_uploads_are_limited_per_person_in_number_and_bytes(web: Running) -> None:
    alice = browser(web, "alice")
    begun = alice.post("/api/uploads", json={"file_name": "a.r3d", "size": 2**29})
    assert begun.status_code == 201
    refused(alice.post("/api/uploads", json={"file_name": "b.r3d", "size": 2**30}), 429, "1.5 GB", "the limit is 1 GB")
    assert alice.post("/api/uploads", json={"file_name": "b.r3d", "size": 5}).status_code == 201
    refused(alice.post("/api/uploads", json={"file_name": "c.r3d", "size": 5}), 429, "2 of your uploads", "cancel")
    assert alice.delete(f"/api/uploads/{begun.json()['id']}").status_code == 204
    assert alice.post("/api/uploads", json={"file_name": "c.r3d", "size": 5}).status_code == 201
    assert len(list((web.settings.data_dir / "uploads").iterdir())) == 2


def test_admins_have_no_quotas(web: Running) -> None:
    root = browser(web, "root")
    assert [sample(root).status_code for _ in range(5)] == [202] * 5


def test_quotas_are_parsed_from_name_and_number() -> None:
    assert quotas_from([]) == Quotas()
    assert quotas_from(["jobs=3", "upload_gb=500"]) == Quotas(jobs=3, upload_gb=500)
    for wish in ("jobs", "jobs=-1", "jobs=1.5", "clicks=3", "=", "jobs=9999999999"):
        with pytest.raises(InputError, match="NAME=N"):
            quotas_from([wish])
