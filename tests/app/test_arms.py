"""Choice of a robot arm that tests every joint of the bundle."""

import importlib.util
import json
from typing import Any

import pytest

from tests.app.conftest import Running
from tests.app.test_jobs import request_of, run


@pytest.fixture
def bare(monkeypatch: pytest.MonkeyPatch) -> None:
    """An installation without the extra."""
    found = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name, *more: None if name == "pybullet_data" else found(name, *more)
    )


def config_of(web: Running, project: str, job: int) -> Any:
    return json.loads((request_of(web, project, job) / "request.json").read_text()).get("config")


def test_choosing_an_arm_makes_the_result_stale_and_configures_the_next_run(web: Running) -> None:
    project = web.sample()
    first = run(web, project)
    web.job(first, "done")
    assert config_of(web, project, first) is None
    assert web.patch(f"/api/projects/{project}", {"arm": "panda"})["result"] == "stale"
    second = run(web, project)
    web.job(second, "done")
    assert config_of(web, project, second) == {"export": {"arm": True}}
    assert web.get(f"/api/projects/{project}")["result"] == "current"
    assert web.patch(f"/api/projects/{project}", {"arm": "none"})["result"] == "stale"


def test_arms_are_listed_with_licence_and_install_hint_if_missing(web: Running, bare: None) -> None:
    none, panda = web.get("/api/system")["arms"]
    assert (none["name"], none["available"]) == ("none", True)
    assert panda["licence"].startswith("Apache-2.0")
    assert not panda["available"]
    assert panda["reason"] == "missing pybullet_data: pip install 'r2c2r[arm]'"
    project = web.sample()
    assert "r2c2r[arm]" in web.patch(f"/api/projects/{project}", {"arm": "panda"}, 503)["hint"]
    assert web.get(f"/api/projects/{project}")["arm"] == "none"
