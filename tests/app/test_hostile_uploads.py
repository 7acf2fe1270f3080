"""Uploads that mean harm; `benchmarks/hostile_uploads.py` sends a thousand."""

from pathlib import Path

import pytest

BENCHMARKS = str(Path(__file__).parents[2] / "benchmarks")


def test_each_is_refused_in_one_line_and_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(BENCHMARKS)
    from hostile_uploads import KINDS, send_all

    count = len(KINDS) + 1  # one of each, and the protocol abused
    figures = send_all(tmp_path, count, seed=1)
    assert figures["wrong"] == []
    assert sum(figures["statuses"].values()) >= count
