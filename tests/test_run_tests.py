"""The test runner: a failed test is rerun once, alone, and only the rerun counts; it tells where the time went."""

import importlib.util
import json
import os
import subprocess
import sys
from collections import Counter
from pathlib import Path
from types import ModuleType

import pytest

from tests.durations import PHASES, summed
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
CLOCKED = """
import pytest
import tests.durations

now = [0.0]
tests.durations.clock = lambda: now[0]

@pytest.fixture(scope="session")
def inner():
    now[0] += 4

@pytest.fixture(scope="session")
def outer(request):
    request.getfixturevalue("inner")
    now[0] += 1

@pytest.fixture
def asked(inner):
    now[0] += 2
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
    assert runner.run_python({"all": ("-n", "2")}, []) == 0
    said = capsys.readouterr().out
    assert "AssertionError: too early" in said
    assert said.splitlines()[-1] == "FLAKY test_a.py::test_once: failed in the suite, passed alone"
    assert (tmp_path / "build" / "flaky.txt").read_text() == "test_a.py::test_once\n"


def test_a_repeated_failure_or_a_collection_error_fails_the_run(
    runner: ModuleType, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "test_a.py").write_text(ONCE)
    (tmp_path / "test_b.py").write_text("def test_never():\n    assert False\n")
    assert runner.run_python({"all": ("-n", "0")}, []) == 1
    assert capsys.readouterr().out.splitlines()[-2:] == [
        "FLAKY test_a.py::test_once: failed in the suite, passed alone",
        "FAILED test_b.py::test_never: in the suite and alone",
    ]
    (tmp_path / "test_b.py").write_text("import nothing_of_this_name\n")
    assert runner.run_python({"all": ("-n", "0")}, []) != 0


def test_a_worker_that_blocks_outside_python_is_ended_and_its_test_is_rerun(
    runner: ModuleType, tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(runner, "LONGEST_S", 1)
    monkeypatch.setattr(runner, "BLOCKED_S", 0)
    (tmp_path / "test_a.py").write_text(BLOCKED)
    (tmp_path / "test_b.py").write_text("def test_always():\n    pass\n")
    assert runner.run_python({"all": ("-n", "2", "--dist", "worksteal")}, []) == 0
    said = capfd.readouterr().out
    assert "1 failed, 1 passed" in said
    assert said.splitlines()[-1] == "FLAKY test_a.py::test_blocked: failed in the suite, passed alone"


def test_a_pass_without_tests_succeeds_but_a_run_without_tests_fails(runner: ModuleType, tmp_path: Path) -> None:
    (tmp_path / "test_a.py").write_text("def test_always():\n    pass\n")
    assert runner.run_python({"a": ("-k", "always"), "b": ("-k", "never")}, []) == 0
    assert runner.run_python({"all": ("-k", "never")}, []) == 5
    assert runner.run_python({"a": ("--no-such-option",), "b": ("-k", "always")}, []) == 4


def test_durations_of_all_parts_are_merged_with_fixtures_timed_without_those_they_ask_for(
    runner: ModuleType, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "conftest.py").write_text(CLOCKED)
    (tmp_path / "test_a.py").write_text("def test_1(outer):\n    pass\n\ndef test_2(outer, asked):\n    pass\n")
    (tmp_path / "test_b.py").write_text("def test_3(asked):\n    pass\n")
    assert runner.run_python({"first": ("-n", "0", "test_a.py"), "second": ("-n", "1", "test_b.py")}, []) == 0
    found = json.loads((tmp_path / "build" / "durations.json").read_text())
    assert [row["part"] for row in found["parts"]] == ["first", "second"]
    assert {tuple(row[key] for key in ("fixture", "scope", "first", "worker", "seconds")) for row in found["fixtures"]} == {
        ("inner", "session", "test_a.py::test_1", "main", 4.0),
        ("outer", "session", "test_a.py::test_1", "main", 1.0),
        ("asked", "function", "test_a.py::test_2", "main", 2.0),
        ("inner", "session", "test_b.py::test_3", "gw0", 4.0),
        ("asked", "function", "test_b.py::test_3", "gw0", 2.0),
    }
    counts = Counter[tuple[str, str]]()
    for row in found["tests"]:
        counts[row["test"].split("::")[0], row["phase"]] += row.get("count", 1)
    assert counts == {(file, phase): n for file, n in (("test_a.py", 2), ("test_b.py", 1)) for phase in PHASES}
    capfd.readouterr()
    runner.print_durations()
    said = capfd.readouterr().out
    assert [name in said for name in ("first", "second", "test_a.py", "test_b.py")] == [True] * 4
    fixtures = [line.split()[:4] for line in said.split("most expensive fixtures")[1].splitlines()[1:]]
    assert fixtures == [["8.0", "2", "session", "inner"], ["4.0", "2", "function", "asked"], ["1.0", "1", "session", "outer"]]


def test_short_durations_are_summed_by_file_and_long_ones_are_kept() -> None:
    alike = {"phase": "call", "worker": "gw0"}
    rows = [{"test": f"test_{n % 2}.py::test_{n}", "seconds": n / 1000, **alike} for n in (1, 2, 3, 7)]
    assert summed(rows, "test") == [
        {"test": "test_1.py::test_7", "seconds": 0.007, **alike},
        {"test": "test_1.py", "seconds": 0.004, "count": 2, **alike},
        {"test": "test_0.py", "seconds": 0.002, "count": 1, **alike},
    ]


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
