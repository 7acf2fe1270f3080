"""Traces of requests and stages, enabled by a setting; tests/test_architecture.py checks that they are imported only then."""

from pathlib import Path
from typing import Any

import pytest
from starlette.testclient import TestClient

from app.main import create_app
from app.settings import Settings
from app.traces import exporting, open_traces
from r2c2r_core.errors import InputError
from tests.app.conftest import FAKE_COMMANDS, ORIGIN, Running
from tests.app.test_jobs import behave, run

ASKED = {"traceparent": "00-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01"}


def test_requests_and_the_stages_of_jobs_are_traced(tmp_path: Path) -> None:
    memory = pytest.importorskip("opentelemetry.sdk.trace.export.in_memory_span_exporter")
    exporter = memory.InMemorySpanExporter()
    settings = Settings(data_dir=tmp_path / "data", min_free_bytes=0, job_memory_bytes=0)
    provider: Any = exporting(exporter)
    app = create_app(settings, commands=FAKE_COMMANDS, traces=provider)
    with TestClient(app, base_url=ORIGIN, headers={"X-Requested-With": "tests"}, raise_server_exceptions=False) as client:
        client.get(f"/?token={settings.launch_token}")
        web = Running(app, client, settings)
        project = web.sample()
        web.get(f"/api/projects/{project}", headers={**ASKED, "X-Request-ID": "mine"})
        folder = behave(web, project, generate="fail")
        web.job(run(web, project), "failed")
        (folder / "behave.json").unlink()
        web.job(run(web, project), "done")
    provider.shutdown()
    spans = exporter.get_finished_spans()
    (asked,) = [span for span in spans if span.attributes.get("request") == "mine"]
    assert asked.name == "GET /api/projects/{project}"
    assert asked.attributes["http.response.status_code"] == 200
    assert f"{asked.context.trace_id:032x}" in ASKED["traceparent"]
    assert asked.kind.name == "SERVER"
    jobs = {span.context.span_id: span for span in spans if span.name == "job"}
    stages = [span for span in spans if span.name.startswith("stage ")]
    assert {"stage segment", "stage export"} <= {span.name for span in stages}
    assert all(jobs[span.parent.span_id].attributes["job"] == span.attributes["job"] for span in stages)
    assert [span.name for span in stages if not span.status.is_unset] == ["stage generate"]
    assert asked.resource.attributes["service.name"] == "r2c2r"


def test_an_unknown_trace_exporter_is_refused() -> None:
    with pytest.raises(InputError, match="R2C2R_TRACES 'jaeger': not otlp"):
        open_traces("jaeger")
