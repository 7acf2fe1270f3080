"""Uploads that mean harm; `benchmarks/hostile_uploads.py` sends a thousand."""

from pathlib import Path

import pytest

BENCHMARKS = str(Path(__file__).parents[2] / "benchmarks")


def test_each_is_refused_in_one_line_and_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(BENCHMARKS)
    from hostile_uploads import KINDS, send_all

    figures = send_all(tmp_path, 2 * len(KINDS), seed=1)
    assert figures["wrong"] == []
    assert sum(figures["statuses"].values()) == 2 * len(KINDS)
