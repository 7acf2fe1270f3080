"""Random requests to every operation; `benchmarks/any_request.py` tries many more."""

from pathlib import Path

import pytest

from r2c2r_core.model.report import Certificate

pytestmark = pytest.mark.slow
BENCHMARKS = str(Path(__file__).parents[2] / "benchmarks")
ROLES = ("reviewer", "nobody")


@pytest.fixture(autouse=True)
def benchmarks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(BENCHMARKS)


def test_no_operation_ends_in_a_server_error(tmp_path: Path, kitchen_bundle: tuple[Path, Certificate]) -> None:
    from any_request import make_template, send_anything

    project = make_template(tmp_path, kitchen_bundle[0])
    figures = send_anything(tmp_path, project, examples=2, seed=0, roles=ROLES)
    assert figures["failures"] == []
    assert figures["operations"] > 50
    assert set(figures["roles"]) == set(ROLES)
    assert all(figure["requests"] >= figures["operations"] for figure in figures["roles"].values())
    assert figures["roles"]["nobody"]["statuses"].keys() <= {"200", "401", "403", "404", "422", "429"}


def test_no_chain_of_requests_built_from_responses_ends_in_a_server_error(
    tmp_path: Path, kitchen_bundle: tuple[Path, Certificate]
) -> None:
    from any_request import make_template, walk_anywhere

    make_template(tmp_path, kitchen_bundle[0])
    walked = walk_anywhere(tmp_path, walks=1, seed=0)
    assert walked["failures"] == []
    assert walked["steps"] > 0
