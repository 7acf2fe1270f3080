"""Mutated inputs to every command; `benchmarks/fuzz_inputs.py --minutes 60` tries many more."""

from pathlib import Path

import pytest

from tests.waiting import FACTOR

BENCHMARKS = str(Path(__file__).parents[2] / "benchmarks")


@pytest.mark.parametrize("count", [20, pytest.param(250, marks=pytest.mark.slow)])
def test_fuzzed_inputs_cause_no_crashes_hangs_or_tracebacks(count: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(BENCHMARKS)
    from fuzz_inputs import fuzz

    found = fuzz(seed=0, count=count, patience=4 * FACTOR)
    assert found["faults"] == [], "to see one: python benchmarks/fuzz_inputs.py --only CASE"
    assert (found["cases"], found["tracebacks"], found["hangs"], found["crashes"]) == (count, 0, 0, 0)
