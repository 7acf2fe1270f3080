"""The test runner: a failed test is rerun once, alone, and only the rerun counts."""

import importlib.util
import os
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

from tests.waiting import held, until

ROOT = Path(__file__).resolve().parent.parent
ONCE = """
from pathlib import Path

def test_once():
    before = Path(__file__).with_name("before")
    seen = before.exists()
    before.touch()
    assert seen, "too early"
"""
BLOCKED = """
import ctypes
from pathlib import Path

def test_blocked():
    before = Path(__file__).with_name("before")
    seen = before.exists()
    before.touch()
    if not seen:
        mutex, locked = ctypes.create_string_buffer(64), ctypes.PyDLL(None).pthread_mutex_lock
        locked(mutex), locked(mutex)  # blocks for ever, holding the GIL
"""


@pytest.fixture
def runner(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """`scripts/run_tests.py` for an empty project."""
    spec = importlib.util.spec_from_file_location("run_tests", ROOT / "scripts" / "run_tests.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    monkeypatch.setattr(module, "ROOT", tmp_path)
    monkeypatch.setattr(module, "BUILD", tmp_path / "build")
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    monkeypatch.setenv("PYTEST_ADDOPTS", "-p xdist -p pytest_timeout")
    return module


def test_a_test_that_passes_on_rerun_is_reported_as_flaky(
    runner: ModuleType, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "test_a.py").write_text(ONCE)
    assert runner.run_python([("-n", "2")], []) == 0
    said = capsys.readouterr().out
    assert "AssertionError: too early" in said
    assert said.splitlines()[-1] == "FLAKY test_a.py::test_once: failed in the suite, passed alone"
    assert (tmp_path / "build" / "flaky.txt").read_text() == "test_a.py::test_once\n"


def test_a_repeated_failure_or_a_collection_error_fails_the_run(
    runner: ModuleType, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "test_a.py").write_text(ONCE)
    (tmp_path / "test_b.py").write_text("def test_never():\n    assert False\n")
    assert runner.run_python([("-n", "0")], []) == 1
    assert capsys.readouterr().out.splitlines()[-2:] == [
        "FLAKY test_a.py::test_once: failed in the suite, passed alone",
        "FAILED test_b.py::test_never: in the suite and alone",
    ]
    (tmp_path / "test_b.py").write_text("import nothing_of_this_name\n")
    assert runner.run_python([("-n", "0")], []) != 0


def test_a_worker_that_blocks_outside_python_is_ended_and_its_test_is_rerun(
    runner: ModuleType, tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(runner, "LONGEST_S", 1)
    monkeypatch.setattr(runner, "BLOCKED_S", 0)
    (tmp_path / "test_a.py").write_text(BLOCKED)
    (tmp_path / "test_b.py").write_text("def test_always():\n    pass\n")
    assert runner.run_python([("-n", "2", "--dist", "worksteal")], []) == 0
    said = capfd.readouterr().out
    assert "1 failed, 1 passed" in said
    assert said.splitlines()[-1] == "FLAKY test_a.py::test_blocked: failed in the suite, passed alone"


def test_a_pass_without_tests_succeeds_but_a_run_without_tests_fails(runner: ModuleType, tmp_path: Path) -> None:
    (tmp_path / "test_a.py").write_text("def test_always():\n    pass\n")
    assert runner.run_python([("-k", "always"), ("-k", "never")], []) == 0
    assert runner.run_python([("-k", "never")], []) == 5
    assert runner.run_python([("--no-such-option",), ("-k", "always")], []) == 4


def test_tests_run_in_reversed_order_within_each_file(tmp_path: Path) -> None:
    for name in ("a", "b"):
        (tmp_path / f"test_{name}.py").write_text("def test_1():\n    pass\n\ndef test_2():\n    pass\n")
    command = [sys.executable, "-m", "pytest", "-p", "tests.suite", "--reverse", "--collect-only", "-q"]
    known = {**os.environ, "PYTHONPATH": str(ROOT), "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
    listed = subprocess.run(command, cwd=tmp_path, env=known, capture_output=True, text=True, check=True).stdout
    names = [line for line in listed.splitlines() if "::" in line]
    assert names == ["test_a.py::test_2", "test_a.py::test_1", "test_b.py::test_2", "test_b.py::test_1"]


def test_the_event_of_a_block_is_set_at_its_end_and_until_waits_for_a_condition() -> None:
    with held() as released:
        assert not released.is_set()
    assert released.is_set()
    left = iter([False, False, True])
    until(lambda: next(left))
    assert next(left, None) is None
