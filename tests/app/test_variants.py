"""Training variants of a bundle, requested with a number and a seed, and made by a job."""

import shutil
from collections import namedtuple
from typing import Any

import pytest

from app import files
from app.schemas import MOST_VARIANTS
from tests.app.conftest import Running
from tests.app.test_jobs import behave, run


@pytest.fixture
def project(web: Running) -> str:
    found = web.sample()
    web.job(run(web, found), "done")
    return found


def make(web: Running, project: str, status: int = 202, **wish: Any) -> Any:
    return web.post(f"/api/projects/{project}/variants", {"version": 1, "count": 2, "seed": 5} | wish, status)


def test_variants_are_made_by_a_separate_job_and_can_be_downloaded(web: Running, project: str) -> None:
    assert web.get(f"/api/projects/{project}/variants")["sets"] == []
    job = web.job(make(web, project)["id"], "done")
    assert (job["kind"], [stage["name"] for stage in job["stages"]]) == ("vary", ["vary"])
    (made,) = web.get(f"/api/projects/{project}/variants")["sets"]
    assert (made["version"], made["count"], made["seed"]) == (1, 2, 5)
    assert web.client.get(made["url"]).content.startswith(b"PK")
    assert web.get(f"/api/projects/{project}")["result"] == "current"  # people's inputs are unchanged


def test_existing_variants_are_a_conflict_and_another_seed_adds_a_set(web: Running, project: str) -> None:
    web.job(make(web, project)["id"], "done")
    assert make(web, project, 409)["hint"] == "download them, or give another seed"
    web.job(make(web, project, seed=6)["id"], "done")
    assert [made["seed"] for made in web.get(f"/api/projects/{project}/variants")["sets"]] == [6, 5]


def test_a_repeated_variants_request_is_one_cancellable_retryable_job(web: Running, project: str) -> None:
    held = behave(web, project, vary="hang")
    job = make(web, project)["id"]
    assert make(web, project)["id"] == job
    web.until(lambda: (held / "hanging").exists())
    web.until(lambda: web.get(f"/api/jobs/{job}")["progress"] == 0.5)
    web.post(f"/api/jobs/{job}/cancel")
    web.job(job, "cancelled")
    assert web.get(f"/api/projects/{project}/variants")["sets"] == []
    behave(web, project)
    again = web.post(f"/api/jobs/{job}/retry", status=202)
    web.job(again["id"], "done")
    assert web.get(f"/api/projects/{project}")["status"] == "ready"
    assert len(web.get(f"/api/projects/{project}/variants")["sets"]) == 1


def test_variants_are_deleted_and_other_folders_cannot_be(web: Running, project: str) -> None:
    web.job(make(web, project)["id"], "done")
    (made,) = web.get(f"/api/projects/{project}/variants")["sets"]
    assert web.delete(f"/api/projects/{project}/variants/{made['name']}")["sets"] == []
    assert web.client.get(made["url"]).status_code == 404
    assert not (web.settings.data_dir / "projects" / project / "variants" / made["name"]).exists()
    assert web.delete(f"/api/projects/{project}/variants/{made['name']}")["sets"] == []  # a repeated request
    for name in ("%2e%2e", "v1-n2-s5%2f..%2f..%2fbundles", "bundles"):
        assert web.client.delete(f"/api/projects/{project}/variants/{name}").status_code in (404, 422)
    assert len(web.get(f"/api/projects/{project}/bundles")) == 1


def test_the_number_of_variants_is_bounded_and_a_bundle_is_required(web: Running, project: str) -> None:
    assert web.get(f"/api/projects/{project}/variants")["offer"]["most"] == MOST_VARIANTS
    for wish in ({"count": MOST_VARIANTS + 1}, {"count": 0}, {"seed": -1}):
        make(web, project, 422, **wish)
    make(web, project, 404, version=9)
    assert web.get(f"/api/projects/{web.sample()}/variants") == {"offer": None, "sets": []}


def test_variants_are_refused_without_enough_disk_space(web: Running, project: str, monkeypatch: pytest.MonkeyPatch) -> None:
    usage = namedtuple("usage", "total used free")
    needed = web.get(f"/api/projects/{project}/variants")["offer"]
    monkeypatch.setattr(files.shutil, "disk_usage", lambda _: usage(10**9, 0, needed["zip_bytes"] + needed["disk_bytes"] - 1))
    said = make(web, project, 507)
    assert "needed" in said["message"]
    monkeypatch.undo()
    assert "vary" not in [job["kind"] for job in web.get(f"/api/jobs?project={project}")]
    shutil.rmtree(web.settings.data_dir / "projects" / project / "bundles")
    make(web, project, 404)


def test_a_duplicated_project_has_the_variants(web: Running, project: str) -> None:
    web.job(make(web, project)["id"], "done")
    copy = web.post(f"/api/projects/{project}/duplicate", status=201)["id"]
    (made,) = web.get(f"/api/projects/{copy}/variants")["sets"]
    assert web.client.get(made["url"]).status_code == 200
