"""SIGKILL at seeded moments; `benchmarks/kills.py` does it fifty times."""

from pathlib import Path

import pytest

from tests.app.served import serve_fakes
from tests.forked import Forked

BENCHMARKS = str(Path(__file__).parents[2] / "benchmarks")


class Begun(Forked):
    """The part of `subprocess.Popen` that the code which kills it uses."""

    def poll(self) -> int | None:
        return self.process.exitcode

    def wait(self) -> None:
        self.process.join()
        self.kill()  # closes what it printed

    def terminate(self) -> None:
        self.process.terminate()


@pytest.mark.parametrize(("kills", "least"), [(1, 4), pytest.param(3, 12, marks=pytest.mark.slow)])
def test_acknowledged_changes_survive_sigkill_and_work_resumes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kills: int, least: int
) -> None:
    monkeypatch.syspath_prepend(BENCHMARKS)
    from kill_server import Server  # type: ignore[import-not-found]
    from kills import kill_often  # type: ignore[import-not-found]

    server = Server(tmp_path / "data", real=False)
    monkeypatch.setattr(server, "begin", lambda: Begun(serve_fakes, server.data, server.port))
    figures = kill_often(server, kills=kills, seed=5)
    assert figures["lost"] == []
    assert figures["went_on_by_itself"]
    assert figures["acknowledged"]["recording"] == 1
    assert sum(figures["acknowledged"].values()) > least
    assert sum(figures["hits"].values()) == kills
