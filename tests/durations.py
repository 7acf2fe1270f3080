"""Pytest plugin: where the time of a test run goes, in a file; `python -m tests.durations FILE` prints it as a table.

The file (JSON) holds, over all invocations of pytest that were given it,

- `tests`: a test, its phase (setup, call or teardown), seconds, worker;
- `fixtures`: a fixture, where it is defined, its scope, the first test that used it, the seconds of its set-up without the
  fixtures that it asks for, worker;
- `parts`: wall time in seconds by part of the run, written by `scripts/run_tests.py`.

Rows below SMALL_S are summed by file (`test` and `first` are then the file's name); `count` is the number of rows in a sum.
"""

import json
import sys
import time
from collections import defaultdict
from collections.abc import Generator, Iterable
from pathlib import Path
from typing import Any

import pytest

SMALL_S = 0.005
LISTED = 10  # files, and fixtures
PHASES = ("setup", "call", "teardown")
Rows = list[dict[str, Any]]
clock = time.perf_counter


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--seconds-spent", type=Path, help="add the seconds of tests and fixtures to this file, as JSON")


def pytest_configure(config: pytest.Config) -> None:
    path = config.getoption("seconds_spent")
    if path is None:
        return
    config.pluginmanager.register(Fixtures())
    if not hasattr(config, "workerinput"):  # a worker of xdist reports to the process that writes the file
        config.pluginmanager.register(Durations(path))


class Fixtures:
    """Stop-watch of fixtures, whose times travel with the reports of the tests, also out of a worker that crashes later."""

    def __init__(self) -> None:
        self._inner_s = [0.0]  # of the fixtures that each fixture under way has asked for
        self._built: Rows = []

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(self, fixturedef: pytest.FixtureDef[Any]) -> Generator[None, Any, Any]:
        began = clock()
        self._inner_s.append(0.0)
        try:
            return (yield)
        finally:
            seconds = clock() - began
            own_s = seconds - self._inner_s.pop()
            self._inner_s[-1] += seconds
            row = {"fixture": fixturedef.argname, "defined": fixturedef.baseid, "scope": fixturedef.scope, "seconds": own_s}
            self._built.append(row)

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(self) -> Generator[None, pytest.TestReport, pytest.TestReport]:
        report = yield
        vars(report)["fixtures"], self._built = self._built, []
        return report


class Durations:
    """Writer of the file, at the end of the session."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.tests: Rows = []
        self.fixtures: Rows = []

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        worker = getattr(report, "worker_id", "main")
        row = {"test": report.nodeid, "phase": report.when, "seconds": report.duration, "worker": worker}
        self.tests.append(row)
        self.fixtures += [{**built, "first": report.nodeid, "worker": worker} for built in getattr(report, "fixtures", ())]

    def pytest_sessionfinish(self) -> None:
        add(self.path, tests=summed(self.tests, "test"), fixtures=summed(self.fixtures, "first"))


def summed(rows: Rows, named: str) -> Rows:
    """The rows, with those below SMALL_S summed where they differ only by tests of one file."""
    large: Rows = []
    small: dict[tuple[Any, ...], float] = defaultdict(float)
    counts: dict[tuple[Any, ...], int] = defaultdict(int)
    for row in rows:
        seconds = row["seconds"]
        if seconds >= SMALL_S:
            large.append({**row, "seconds": round(seconds, 4)})
            continue
        alike = tuple({**row, named: _file(row[named]), "seconds": None}.items())
        small[alike] += seconds
        counts[alike] += 1
    return large + [{**dict(alike), "seconds": round(small[alike], 4), "count": counts[alike]} for alike in small]


def add(path: Path, **rows: Rows) -> None:
    """Append rows to the lists of the file."""
    known = json.loads(path.read_text()) if path.exists() else {}
    path.write_text(json.dumps(known | {name: known.get(name, []) + more for name, more in rows.items()}))


def table(found: dict[str, Rows]) -> str:
    """Wall time of the parts, the slowest files and the most expensive fixtures."""
    files: dict[str, dict[str, float]] = defaultdict(lambda: defaultdict(float))
    for row in found.get("tests", []):
        of = files[_file(row["test"])]
        of["tests"] += row.get("count", 1) * (row["phase"] == "setup")
        of[row["phase"]] += row["seconds"]
        of["all"] += row["seconds"]
    fixtures: dict[tuple[str, str, str], list[float]] = defaultdict(lambda: [0.0, 0])
    for row in found.get("fixtures", []):
        total = fixtures[row["fixture"], row["defined"], row["scope"]]
        total[0] += row["seconds"]
        total[1] += row.get("count", 1)
    slowest = sorted(files.items(), key=lambda item: -item[1]["all"])[:LISTED]
    dearest = sorted(fixtures.items(), key=lambda item: -item[1][0])[:LISTED]
    blocks = (
        (("wall s", "part"), [(_s(row["seconds"]), row["part"]) for row in found.get("parts", [])]),
        (
            ("sum s", *PHASES, "tests", "slowest files"),
            [(_s(of["all"]), *(_s(of[phase]) for phase in PHASES), f"{of['tests']:.0f}", name) for name, of in slowest],
        ),
        (
            ("sum s", "built", "scope", "most expensive fixtures, without those they ask for"),
            [(_s(total), f"{built:.0f}", scope, f"{name}  {at}".rstrip()) for (name, at, scope), (total, built) in dearest],
        ),
    )
    return "\n".join(_aligned(titles, lines) for titles, lines in blocks if lines)


def _aligned(titles: tuple[str, ...], lines: Iterable[tuple[str, ...]]) -> str:
    rows = [titles, *lines]
    widths = [max(map(len, column)) for column in list(zip(*rows, strict=True))[:-1]]
    return "".join(
        "  ".join([*(cell.rjust(width) for cell, width in zip(row[:-1], widths, strict=True)), row[-1]]) + "\n" for row in rows
    )


def _file(test: str) -> str:
    return test.split("::")[0]


def _s(seconds: float) -> str:
    return f"{seconds:.1f}"


if __name__ == "__main__":
    sys.stdout.write("\n" + table(json.loads(Path(sys.argv[1]).read_text())))
