"""Whatever is sent to whichever operation; `benchmarks/any_request.py` tries many more."""

from pathlib import Path

import pytest

BENCHMARKS = str(Path(__file__).parents[2] / "benchmarks")


def test_no_operation_ends_in_a_server_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(BENCHMARKS)
    from any_request import send_anything

    figures = send_anything(tmp_path, examples=2, seed=0, thorough=False)
    assert figures["failures"] == []
    assert figures["operations"] > 50
    assert figures["requests"] > 3 * figures["operations"]
