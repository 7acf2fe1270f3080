"""Estimated time left of a job."""

import time
from pathlib import Path
from types import SimpleNamespace

import pytest

from app.db.engine import open_engine, reading, writing
from app.db.tables import Job, JobEvent, Project
from app.jobs.durations import longest
from app.jobs.plans import Step
from app.jobs.steps import JobProgress

TOOK_S = {"segment": 30.0, "generate": 20.0, "export": 60.0}


def test_the_estimate_never_increases_after_stages_that_were_cached(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [1000.0]
    monkeypatch.setattr("app.jobs.steps.time", SimpleNamespace(monotonic=lambda: now[0]))
    progress = JobProgress([Step(stage, (), 30.0, took_s) for stage, took_s in TOOK_S.items()], began=now[0])
    said = [progress.estimate_s()]
    for at, took_s in enumerate((2.0, 2.0, 60.0)):  # the first two were computed before
        progress.at(at)
        for tenth in range(1, 11):
            now[0] += took_s / 10
            progress.fraction = tenth / 10
            said.append(progress.estimate_s())
    assert said[0] == 110.0
    told = [seconds for seconds in said if seconds is not None]
    assert len(told) == len(said)
    assert told == sorted(told, reverse=True)  # it never increases


def test_a_slower_run_increases_the_estimate(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [1000.0]
    monkeypatch.setattr("app.jobs.steps.time", SimpleNamespace(monotonic=lambda: now[0]))
    progress = JobProgress([Step(stage, (), 30.0, took_s) for stage, took_s in TOOK_S.items()], began=now[0])
    progress.at(1)
    now[0] += 60.0  # a stage that took half a minute
    assert progress.estimate_s() == pytest.approx(160.0)


def test_a_step_that_stalls_for_a_while_does_not_raise_the_estimate(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [1000.0]
    monkeypatch.setattr("app.jobs.steps.time", SimpleNamespace(monotonic=lambda: now[0]))
    progress = JobProgress([Step(stage, (), 10.0) for stage in ("segment", "align")], began=now[0])  # never done before
    progress.at(1)
    now[0] += 368.0
    assert progress.estimate_s() == pytest.approx(368.0)
    now[0] += 25.0  # without news
    assert progress.estimate_s() == pytest.approx(368.0)
    progress.fraction = 0.2
    assert progress.estimate_s() == pytest.approx(393.0 * 0.4 / 0.6, abs=0.1)
    now[0] += 100.0
    assert progress.estimate_s() == pytest.approx(493.0 * 0.4 / 0.6, abs=0.1)  # it is slower


def test_the_estimate_uses_the_longest_finished_run_of_the_project(tmp_path: Path) -> None:
    engine = open_engine(tmp_path / "r2c2r.db")
    with writing(engine) as session:
        for project in ("mine", "other"):
            session.add(Project(id=project, name=project, source_name="scan.r3d", status="ready", created=0.0, updated=0.0))
        session.flush()
        for project, state, seconds in (
            ("mine", "done", 10.0),
            ("mine", "done", 2.0),
            ("mine", "failed", 99.0),
            ("other", "done", 50.0),
        ):
            job = Job(project_id=project, kind="run", state=state, created=0.0)
            session.add(job)
            session.flush()
            for kind, stage, at in (
                ("stage", "segment", 5.0),
                ("progress", "segment", 6.0),
                ("stage", "export", 5.0 + seconds),
                ("state", "export", 5.0 + 3 * seconds),
            ):
                session.add(JobEvent(job_id=job.id or 0, at=time.time() + at, kind=kind, stage=stage))
                session.flush()
    with reading(engine) as session:
        took = longest(session, Job(project_id="mine", kind="run", state="queued", created=0.0))
        assert took == pytest.approx({"segment": 10.0, "export": 20.0}, abs=0.1)
        assert longest(session, Job(project_id="mine", kind="import", state="queued", created=0.0)) == {}
    engine.dispose()
