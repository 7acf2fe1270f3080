"""Server paths are shown to admins only."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from argon2 import PasswordHasher
from starlette.testclient import TestClient

from app.errors import NoSpace
from app.privacy import without_places
from app.services import accounts, projects
from tests.app.conftest import ORIGIN, Running, running

PASSWORD = "correct horse battery"


@pytest.fixture
def web(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Running]:
    quick = PasswordHasher(time_cost=1, memory_cost=8, parallelism=1)
    monkeypatch.setattr(accounts, "_hasher", lambda: quick)
    with running(tmp_path / "data") as web:
        accounts.add(web.context.engine, "rita", "reviewer", PASSWORD)
        yield web


@pytest.fixture
def rita(web: Running) -> TestClient:
    client = TestClient(web.app, base_url=ORIGIN, headers={"X-Requested-With": "t"}, raise_server_exceptions=False)
    assert client.post("/api/login", json={"name": "rita", "password": PASSWORD}).status_code == 204
    return client


def test_error_messages_show_full_server_paths_to_admins_only(
    web: Running, rita: TestClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    place = str(web.settings.data_dir)

    def full(*_: object) -> None:
        raise NoSpace(f"no room for {place}/projects/ab/overrides.json", hint=f"look at {place}/projects")

    monkeypatch.setattr(projects, "get_project", full)
    told = rita.get("/api/projects/ab")
    assert told.status_code == 507
    assert place not in told.text
    assert told.json()["message"] == "no room for …/projects/ab/overrides.json"
    assert told.json()["hint"] == "look at …/projects"
    assert place in web.client.get("/api/projects/ab").text


def test_import_roots_are_listed_for_admins_only(web: Running, rita: TestClient) -> None:
    assert web.get("/api/system")["import_roots"] == [str(root) for root in web.settings.roots]
    assert rita.get("/api/system").json()["import_roots"] == []


def test_hidden_folders_cannot_be_browsed_or_imported_by_path(web: Running, tmp_path: Path) -> None:
    (tmp_path / ".ssh" / "inner").mkdir(parents=True)
    for folder in (".ssh", ".ssh/inner"):
        assert web.client.get("/api/browse", params={"path": str(tmp_path / folder)}).status_code == 403
        assert web.client.post("/api/projects/import", json={"path": str(tmp_path / folder)}).status_code == 403
    assert web.client.get("/api/browse", params={"path": str(tmp_path)}).status_code == 200


def test_only_the_prefix_of_the_data_folder_is_removed_from_messages(web: Running) -> None:
    text = f"{web.settings.data_dir}/projects/ab/clicks/overrides.json: a/b is no pose; see /api/openapi.json"
    assert without_places(f"{web.settings.data_dir}-2/x", web.settings) != "…-2/x"
    assert without_places(text, web.settings) == "…/projects/ab/clicks/overrides.json: a/b is no pose; see /api/openapi.json"
