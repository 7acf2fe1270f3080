"""Pytest plugin of `scripts/run_tests.py`: a file of the failed tests, and the tests of each file in reversed order."""

import json
from pathlib import Path

import pytest


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--failures", type=Path, help="append the id and the report of every failed test to this file, as JSON")
    parser.addoption("--reverse", action="store_true", help="run the tests of each file in reversed order")


def pytest_configure(config: pytest.Config) -> None:
    path = config.getoption("failures")
    if path and not hasattr(config, "workerinput"):  # a worker of xdist reports to the process that writes the file
        config.pluginmanager.register(Failures(path))


class Failures:
    """Writer of failed tests as they fail, so that an interrupted run keeps them."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        self._write(report)

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        self._write(report)

    def _write(self, report: pytest.TestReport | pytest.CollectReport) -> None:
        if report.failed:
            with self.path.open("a") as lines:
                lines.write(json.dumps({"test": report.nodeid, "report": report.longreprtext}) + "\n")


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if config.getoption("reverse"):
        files = list(dict.fromkeys(item.path for item in items))
        items.sort(key=lambda item: files.index(item.path))
        by_file = [[item for item in items if item.path == path] for path in files]
        items[:] = [item for group in by_file for item in reversed(group)]
