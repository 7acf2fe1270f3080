"""SIGKILL at seeded moments; `benchmarks/kills.py` does it fifty times."""

from pathlib import Path

import pytest

BENCHMARKS = str(Path(__file__).parents[2] / "benchmarks")


def test_nothing_acknowledged_is_lost_and_work_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(BENCHMARKS)
    from kill_server import Server  # type: ignore[import-not-found]
    from kills import kill_often  # type: ignore[import-not-found]

    figures = kill_often(Server(tmp_path / "data", real=False), kills=3, seed=5)
    assert figures["lost"] == []
    assert figures["went_on_by_itself"]
    assert figures["acknowledged"]["recording"] == 1
    assert sum(figures["acknowledged"].values()) > 12
    assert sum(figures["hits"].values()) == 3
