"""Computing time from overlapping intervals."""

import time
from pathlib import Path

import pytest

from app.db.computing import JOINED_S, computing_s, worked
from app.db.engine import open_engine, writing
from app.db.tables import Computing, Job, Project


@pytest.mark.parametrize(
    ("jobs", "live", "seconds"),
    [
        ([], [], 0.0),
        ([(10.0, 20.0)], [], 10.0),
        ([(10.0, 20.0)], [(15.0, 25.0)], 15.0),  # concurrent intervals count once
        ([(10.0, 20.0), (30.0, 40.0)], [(5.0, 50.0)], 45.0),
        ([(10.0, None)], [(12.0, 14.0)], 90.0),  # still running, at 100
        ([], [(1.0, 2.0), (2.5, 4.0), (4.0 + JOINED_S + 0.1, 10.0)], 3.0 + 6.0 - JOINED_S - 0.1),  # short gaps are ignored
    ],
)
def test_overlapping_intervals_of_computing_count_once(
    tmp_path: Path, jobs: list[tuple[float, float | None]], live: list[tuple[float, float]], seconds: float
) -> None:
    engine = open_engine(tmp_path / "r.db")
    with writing(engine) as session:
        session.add(Project(id="p", name="p", status="ready", created=0.0, updated=0.0, source_name="s"))
        session.flush()
        for began, ended in jobs:
            session.add(Job(project_id="p", kind="run", state="done", created=0.0, started=began, finished=ended))
        for began, ended in live:
            worked(session, "p", began, ended)
            worked(session, "deleted", began, ended)
            session.flush()
        assert computing_s(session, "p", now=100.0) == pytest.approx(seconds)
        assert session.get(Computing, 1) is None or computing_s(session, "deleted", time.time()) == 0.0
    engine.dispose()
