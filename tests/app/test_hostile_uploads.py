"""Malicious uploads; `benchmarks/hostile_uploads.py` sends a thousand."""

from pathlib import Path

import pytest

BENCHMARKS = str(Path(__file__).parents[2] / "benchmarks")


@pytest.mark.parametrize("every", [16, pytest.param(1, marks=pytest.mark.slow)])
def test_hostile_uploads_are_refused_in_one_line_and_leave_no_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, every: int
) -> None:
    monkeypatch.syspath_prepend(BENCHMARKS)
    import hostile_uploads

    kinds = hostile_uploads.KINDS[::every]
    monkeypatch.setattr(hostile_uploads, "KINDS", kinds)
    count = len(kinds) + 1  # one of each kind, and one misuse of the protocol
    figures = hostile_uploads.send_all(tmp_path, count, seed=1)
    assert len(figures["kinds"]) == count
    assert figures["wrong"] == []
    assert sum(figures["statuses"].values()) >= count
