"""Results of a finished job."""

import json
import zipfile
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from sqlite3 import connect

import pytest

from app.db.engine import open_engine, writing
from app.db.tables import Job, Project
from app.files import project_files
from app.jobs import outcomes
from r2c2r_core.export.report import report_of
from r2c2r_core.model.report import Likeness
from r2c2r_core.workspace import Workspace
from tests.app.conftest import Running
from tests.app.test_jobs import run
from tests.core.export.test_report import certificate


def test_the_clicks_of_the_last_run_are_replaced_atomically(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The file is replaced, not rewritten: a reader that has it open, or a server killed meanwhile, keeps the previous one."""
    monkeypatch.setattr(outcomes, "keep_bundle", lambda *_: None)
    files = project_files(tmp_path, "p")
    (tmp_path / "rows").mkdir()
    asked = files.request(1).with_name("prompts.json")
    asked.parent.mkdir(parents=True)
    asked.write_text('{"version": 1, "objects": []}')
    files.finished_prompts.parent.mkdir(parents=True, exist_ok=True)
    files.finished_prompts.write_text('{"version": 1, "objects": ["former"]}')
    engine = open_engine(tmp_path / "rows" / "r.db")
    with files.finished_prompts.open() as former, writing(engine) as session:
        project = Project(id="p", name="p", status="ready", created=0.0, updated=0.0, source_name="s")
        outcomes.run_files(session, Job(id=1, project_id="p", kind="run", state="done", created=0.0), project, files)
        assert json.load(former)["objects"] == ["former"]
    assert json.loads(files.finished_prompts.read_text())["objects"] == []
    engine.dispose()


def test_the_database_is_not_locked_while_a_bundle_is_copied(web: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    project, digest = web.sample(), outcomes._sha256
    looked: list[Path] = []

    def look(path: Path) -> str:
        looked.append(path)
        with connect(web.settings.database, timeout=0) as other:
            other.execute("BEGIN IMMEDIATE")  # raises if another connection is writing
            other.rollback()
        return digest(path)

    monkeypatch.setattr(outcomes, "_sha256", look)
    web.job(run(web, project), "done")
    assert len(looked) >= 2  # the bundle as made, and the stored copies
    assert [bundle["current"] for bundle in web.get(f"/api/projects/{project}/bundles")] == [True]
    web.job(run(web, project), "done")
    assert [bundle["version"] for bundle in web.get(f"/api/projects/{project}/bundles")][-1] == 1
    count = len(looked)
    web.post(f"/api/projects/{project}/duplicate", status=201)
    assert len(looked) > count


@pytest.mark.parametrize("commits", [False, True])
def test_an_unreadable_upload_is_deleted_only_with_its_committed_failure(web: Running, commits: bool) -> None:
    project, files = web.sample(), web.context.files
    with suppress(ZeroDivisionError), writing(web.context.engine) as session:
        row = session.get_one(Project, project)
        row.capture, source = {}, files(row).source
        error = {"kind": "capture", "message": "no depth in it", "hint": "record again"}
        failed = Job(project_id=project, kind="import", state="failed", created=0.0, error=error)
        outcomes.job_ended(session, failed, row, files(row))
        assert any(source.iterdir())
        if not commits:
            raise ZeroDivisionError
    assert source.exists() is not commits


@pytest.mark.parametrize("stored_as_pairs", [False, True])
def test_certificate_doubts_are_returned_with_object_and_reason(
    web: Running, monkeypatch: pytest.MonkeyPatch, stored_as_pairs: bool
) -> None:
    """Also for rows of an older version, which stored each doubt as a pair."""
    made = replace(certificate(), likeness=Likeness(state="doubtful", doubts=(("drawer_1", "is 40 % sure"),)))
    project = web.sample()
    work = web.settings.data_dir / "projects" / project / "work"
    Workspace(work).save("export", "scene", made, {"key": "k", "seconds": 1.0})
    said = report_of({"tool_version": "1", "objects": []}, made, {})["certificate"]
    if stored_as_pairs:
        said["likeness"]["doubts"] = [["drawer_1", "is 40 % sure"]]
    inside = zipfile.ZipFile.read

    def read(self: zipfile.ZipFile, name: str) -> bytes:
        return json.dumps({"certificate": said}).encode() if name == "report.json" else inside(self, name)

    monkeypatch.setattr(zipfile.ZipFile, "read", read)
    web.job(run(web, project), "done")
    shown = web.get(f"/api/projects/{project}/certificate")
    assert shown["likeness"] == {"state": "doubtful", "doubts": [{"object": "drawer_1", "why": "is 40 % sure"}]}
    assert shown["realtime_factor"] == made.realtime_factor
