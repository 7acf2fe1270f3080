"""Resource limits of a worker: a process that exceeds them reports so in one line."""

import json
import resource
import subprocess
import sys
from pathlib import Path

import pytest

from app.jobs.steps import outcome
from r2c2r_core.limits import free_memory

WORKERS = (
    "r2c2r_core.worker",
    "app.jobs.live_segment",
    "app.jobs.sample",
    "app.viewer.worker",
    "app.jobs.probe",
    "app.jobs.ingest",
)

LIMITED = """
import json, resource
from r2c2r_core.limits import limit_this_process, memory_met
limit_this_process()
try:
    bytearray(3 << 30)
except MemoryError:
    print(json.dumps([str(memory_met()), resource.getrlimit(resource.RLIMIT_CPU)[0]]))
"""


def test_exceeding_the_memory_limit_gives_a_one_line_error_with_a_hint(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("R2C2R_WORKER_MEMORY_GB", "2")
    monkeypatch.setenv("R2C2R_WORKER_HOURS", "1.5")
    done = subprocess.run([sys.executable, "-c", LIMITED], capture_output=True, text=True, check=True)
    said, cpu_s = json.loads(done.stdout)
    assert said.startswith("it needs more memory than its limit of 2.0 GB; ")
    assert "R2C2R_WORKER_MEMORY_GB" in said
    assert cpu_s == 5400


@pytest.mark.parametrize("module", WORKERS)
def test_every_worker_module_calls_limit_this_process(module: str) -> None:
    source = (Path(__file__).parents[2] / f"{module.replace('.', '/')}.py").read_text()
    assert "    limit_this_process(" in source


@pytest.mark.parametrize("said", ["", "a lot", "-1", "nan", "inf", "0"])
def test_with_an_invalid_limit_free_memory_is_positive_and_finite(said: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("R2C2R_WORKER_MEMORY_GB", said)
    assert 0 < free_memory(0.5) < 1 << 50


def test_exhausted_cpu_time_is_an_environment_problem_with_a_hint() -> None:
    failure = outcome({}, -24, "align")
    assert failure is not None
    assert failure["kind"] == "EnvironmentProblem"
    assert "processor time" in failure["message"]
    assert "R2C2R_WORKER_HOURS" in failure["hint"]


def test_the_test_process_has_no_reduced_memory_limit() -> None:
    assert resource.getrlimit(resource.RLIMIT_DATA)[0] == resource.getrlimit(resource.RLIMIT_DATA)[1]
