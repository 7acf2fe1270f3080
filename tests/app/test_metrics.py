"""Prometheus metrics and log lines: requests by route, stages by outcome, the queue, and ids that correlate the lines."""

import json
import logging
import re

import pytest
from starlette.testclient import TestClient

from app.logs import JsonLines
from app.metrics import Histogram
from r2c2r_core.cli import main
from tests.app.conftest import ORIGIN, Running
from tests.app.test_jobs import behave, run


def samples(web: Running) -> dict[str, float]:
    """Every sample of /metrics, checked against the text format."""
    answer = web.client.get("/metrics")
    assert answer.headers["content-type"].startswith("text/plain; version=0.0.4")
    found = {}
    for line in answer.text.splitlines():
        if not line.startswith("#"):
            match = re.fullmatch(r'([a-z][a-z0-9_]*(?:\{(?:[a-z]+="[^"]*",?)+\})?) (-?[0-9.e+-]+)', line)
            assert match, line
            assert match[1] not in found, line
            found[match[1]] = float(match[2])
    return found


def test_requests_are_counted_by_route_and_not_by_path(web: Running) -> None:
    project = web.sample()
    for number in range(3):
        web.get(f"/api/projects/nothing-{number}", 404)
    web.get(f"/api/projects/{project}")
    web.get("/no/such/page", 404)
    found = samples(web)
    of_missing = '{method="GET",route="/api/projects/{project}",status="404"}'
    assert found[f"r2c2r_request_seconds_count{of_missing}"] == 3
    assert found['r2c2r_request_seconds_bucket{method="GET",route="/api/projects/{project}",status="404",le="+Inf"}'] == 3
    assert not any("nothing" in name or "/no/such" in name for name in found)


def test_stages_and_the_queue_are_exported_as_metrics(web: Running) -> None:
    project = web.sample()
    folder = behave(web, project, generate="hang")
    job = run(web, project)
    web.until(lambda: (folder / "hanging").exists())
    found = samples(web)
    assert found['r2c2r_jobs{state="running"}'] == found["r2c2r_seats_busy"] == found["r2c2r_seats"] == 1
    assert found["r2c2r_projects"] == 1
    web.post(f"/api/jobs/{job}/cancel")
    web.job(job, "cancelled")
    found = samples(web)
    assert found['r2c2r_stage_seconds_count{stage="segment",outcome="done"}'] == 1
    assert found['r2c2r_stage_seconds_count{stage="generate",outcome="cancelled"}'] == 1
    assert found['r2c2r_jobs{state="running"}'] == 0


def test_metrics_require_a_session(web: Running) -> None:
    assert TestClient(web.app, base_url=ORIGIN).get("/metrics").status_code == 401


def test_a_histogram_bucket_counts_values_up_to_its_bound() -> None:
    times = Histogram("t", "help", ("kind",), (1.0, 2.0))
    for seconds in (0.5, 1.0, 1.5, 5.0):
        times.observe(seconds, 'a "name"')
    assert list(times.lines())[2:] == [
        't_bucket{kind="a \\"name\\"",le="1"} 2',
        't_bucket{kind="a \\"name\\"",le="2"} 3',
        't_bucket{kind="a \\"name\\"",le="+Inf"} 4',
        't_sum{kind="a \\"name\\""} 8',
        't_count{kind="a \\"name\\""} 4',
    ]


class Lines(logging.Handler):
    """Log handler that stores lines as the server would write them."""

    def __init__(self) -> None:
        super().__init__(logging.INFO)
        self.setFormatter(JsonLines())
        self.said: list[dict[str, object]] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.said.append(json.loads(self.format(record)))


@pytest.fixture
def lines(monkeypatch: pytest.MonkeyPatch) -> Lines:
    found, ours = Lines(), logging.getLogger("app")
    monkeypatch.setattr(ours, "handlers", [found])
    monkeypatch.setattr(ours, "level", logging.INFO)
    ours.manager._clear_cache()  # type: ignore[attr-defined]
    return found


def test_log_lines_contain_the_request_id_and_the_job_id(web: Running, lines: Lines) -> None:
    project = web.sample()
    job = run(web, project)
    web.job(job, "done")
    answer = web.client.get(f"/api/projects/{project}", headers={"X-Request-ID": "of-the-proxy.7"})
    assert answer.headers["x-request-id"] == "of-the-proxy.7"
    of_it = [line for line in lines.said if line.get("request") == "of-the-proxy.7"]
    assert [(line["status"], line["route"], line["who"]) for line in of_it] == [(200, "/api/projects/{project}", "tester")]
    stages = [line["stage"] for line in lines.said if line.get("job") == job and "stage" in line]
    assert stages == ["segment", "generate", "align", "synthesize", "warp", "export"]


@pytest.mark.parametrize("given", ["", "two words", "x" * 65, "a\tb"])
def test_an_invalid_request_id_is_replaced(web: Running, given: str) -> None:
    told = web.client.get("/healthz", headers={"X-Request-ID": given}).headers["x-request-id"]
    assert re.fullmatch(r"[0-9a-f]{16}", told)


def test_an_unknown_log_format_is_refused_in_one_line(
    tmp_path_factory: pytest.TempPathFactory, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("R2C2R_LOG", "xml")
    assert main(["serve", "--port", "0", "--data", str(tmp_path_factory.mktemp("data"))]) == 2
    assert "R2C2R_LOG 'xml': not json" in capsys.readouterr().err
