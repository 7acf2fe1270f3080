"""Whatever is sent to whichever operation; `benchmarks/any_request.py` tries many more."""

from pathlib import Path

import pytest

from r2c2r_core.model.report import Certificate

BENCHMARKS = str(Path(__file__).parents[2] / "benchmarks")


def test_no_operation_ends_in_a_server_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kitchen_bundle: tuple[Path, Certificate]
) -> None:
    monkeypatch.syspath_prepend(BENCHMARKS)
    from any_request import make_template, send_anything, walk_anywhere

    roles = ("reviewer", "nobody")
    project = make_template(tmp_path, kitchen_bundle[0])
    figures = send_anything(tmp_path, project, examples=2, seed=0, roles=roles)
    walked = walk_anywhere(tmp_path, walks=1, seed=0)
    assert figures["failures"] == walked["failures"] == []
    assert walked["steps"] > 0
    assert figures["operations"] > 50
    assert set(figures["roles"]) == set(roles)
    assert all(figure["requests"] >= figures["operations"] for figure in figures["roles"].values())
    assert figures["roles"]["nobody"]["statuses"].keys() <= {"200", "401", "403", "404", "422", "429"}
