"""Cost of a kitchen in rows, files and pages: counted by benchmarks/throughput.py, documented in docs/how-to/servers.md."""

import json
from pathlib import Path

import pytest

from tests.app.object_server import object_server
from tests.app.postgres import PostgresServer

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(autouse=True)
def benchmarks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(ROOT / "benchmarks"))


@pytest.mark.slow
def test_the_throughput_benchmark_measures_one_kitchen_end_to_end(
    postgres_server: PostgresServer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import throughput  # type: ignore[import-not-found]

    monkeypatch.setattr(throughput, "RECORDING_BYTES", 100_000)
    monkeypatch.setattr(throughput, "STORED", {stage: (2, 50_000) for stage in throughput.STORED})
    folder = tmp_path / "round"
    with object_server() as store:
        for name, value in store.environment.items():
            monkeypatch.setenv(name, value)
        with throughput.farm(folder, 1, 1e6, postgres_server, store) as farm:
            found = throughput.one_round(farm, folder, 1, 1.0, 1)
    assert found["cpu_s_a_kitchen"].keys() == {"database", "store", "web", "seats"}
    assert found["stored_mb_a_kitchen"] > 2 * 0.05 * len(throughput.STORED) / 2 + 0.1
    assert found["transactions_a_kitchen"] > 20
    assert (folder / "0.bundle").is_file()


def test_the_documentation_contains_the_measured_figures() -> None:
    import throughput

    parts = json.loads((ROOT / "benchmarks" / "throughput.json").read_text())
    figures = parts["throughput"]
    page = (ROOT / "docs" / "how-to" / "servers.md").read_text()
    assert throughput.table(figures) in page
    for rate in figures["limits"].values():
        assert f"{rate:,}" in page
    for count in figures["a_thousand_a_day"]["seats"].values():
        assert f"| {count} |" in page
    for part in ("one_kitchen", "one_kitchen_with_a_model"):
        for seats, seconds in parts[part]["seconds_by_seats"].items():
            (row,) = [line for line in page.splitlines() if line.startswith(f"| {seats} | ") and line.count("|") == 4]
            assert f" {seconds:.0f} s |" in row
