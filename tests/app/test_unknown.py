"""Recovery of projects after a lost or restored database: folders describe themselves, are set aside, and are adopted."""

import json
import os
import shutil
import zipfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from sqlmodel import col, select
from starlette.testclient import TestClient

from app.db.description import describe, read_description
from app.db.engine import opened, reading, writing
from app.db.tables import Comment, Job, Override, Project, TrueLength, Verdict
from app.errors import DatabaseUnusable
from app.files import project_files
from app.services import accounts, leftovers
from app.services.adopting import adopt, adopt_all
from r2c2r_core.errors import InputError
from tests.app.conftest import ORIGIN, Running, statements

Start = Callable[..., Any]
VIEW = {
    "mode": "scene",
    "draw": "wireframe",
    "opacity": 0.5,
    "hidden": ["mug_1"],
    "clip": {"low": [0.0, 0.0, 0.0], "high": [1.0, 1.0, 1.0]},
}


def worked_on(web: Running) -> str:
    """A project with a click, a correction, a verdict, comments, true lengths, a deleted object and a bundle."""
    project = web.sample()
    base = f"/api/projects/{project}"
    drawer, mug = web.get(f"{base}/objects")
    web.post(f"{base}/objects/{drawer['id']}/points?infer=false", {"frame": 3, "x": 11.5, "y": 12.5, "label": 0})
    web.patch(f"{base}/objects/{drawer['id']}/override", {"hinge": "left", "joint_upper": 1.0, "joint_lower": 0.0})
    web.job(web.post(f"{base}/run", {}, 202)["id"], "done")
    with writing(web.context.engine) as session:
        verdict = {"candidate": "c0", "verdict": "accepted", "reason": "fits", "who": "tester", "at": 5.0}
        session.add(Verdict(object_id=drawer["id"], **verdict))
    web.post(f"{base}/comments", {"text": "the left one", "object": mug["id"]})
    web.post(f"{base}/comments", {"text": "behind it", "point_world": [0.1, 0.2, 0.3], "view": VIEW})
    for item in (drawer, mug):
        web.post(f"{base}/lengths", {"object": item["id"], "side": "width", "metres": 0.505}, 201)
    web.post(f"{base}/lengths", {"points_world": [[0, 0, 0], [0, 1.0, 0]], "metres": 1.01, "text": "worktop"}, 201)
    web.patch(base, {"name": "Aunt Ida's kitchen"})
    web.delete(f"{base}/objects/{mug['id']}")
    return project


def known(web: Running, project: str) -> Any:
    """People's work on the project, as the app shows it."""
    base = f"/api/projects/{project}"
    shown = web.get(base)
    objects = [{key: row[key] for key in ("id", "name", "category", "colour", "points")} for row in web.get(f"{base}/objects")]
    for point in (point for item in objects for point in item["points"]):
        point.pop("id")
    with reading(web.context.engine) as session:
        verdicts = [row.model_dump(exclude={"id"}) for row in session.exec(select(Verdict))]
        overrides = [row.model_dump(exclude={"id"}) for row in session.exec(select(Override).order_by(col(Override.object_id)))]
    comments, lengths = web.get(f"{base}/comments"), web.get(f"{base}/lengths")
    for row in (*comments, *lengths["lengths"]):
        row.pop("id")
    return {
        **{key: shown[key] for key in ("name", "status", "created", "counts", "review_state", "segmenter", "result")},
        "objects": objects,
        "verdicts": verdicts,
        "overrides": [row for row in overrides if row["data"]],
        "comments": comments,
        "lengths": lengths,
        "bundles": web.get(f"{base}/bundles"),
        "certificate": web.get(f"{base}/certificate")["passed"],
        "frames": web.get(f"{base}/frames"),
    }


def lose(data: Path) -> None:
    for path in data.glob("r2c2r.db*"):
        path.unlink()


def test_a_lost_database_is_rebuilt_from_the_project_folders(start: Start, tmp_path: Path) -> None:
    data = tmp_path / "data"
    with start() as web:
        project = worked_on(web)
        before = known(web, project)
    lose(data)
    with pytest.raises(DatabaseUnusable, match="1 project folder"), opened(data / "r2c2r.db"):
        pass
    with opened(data / "r2c2r.db", anew=True) as engine:
        assert adopt_all(engine, data, "tester") == [f"{project}: adopted as Aunt Ida's kitchen"]
        assert adopt_all(engine, data, "tester") == []
    with start() as web:
        assert known(web, project) == before
        base = f"/api/projects/{project}"
        web.post(f"{base}/undo", {"scope": "prompts"})  # restores the deleted mug
        assert [item["name"] for item in web.get(f"{base}/objects")] == ["drawer_1", "mug_1"]


def test_projects_unknown_to_a_restored_database_are_listed_and_adopted(start: Start, tmp_path: Path) -> None:
    data = tmp_path / "data"
    with start() as web:
        old = web.sample()
    shutil.copy(data / "r2c2r.db", tmp_path / "yesterday.db")
    with start() as web:
        project = worked_on(web)
        drawer = web.get(f"/api/projects/{old}/objects")[0]["id"]
        web.post(f"/api/projects/{old}/objects/{drawer}/points?infer=false", {"frame": 3, "x": 1.5, "y": 2.5, "label": 0})
        lengths = web.post(f"/api/projects/{old}/lengths", {"object": drawer, "side": "width", "metres": 0.5}, 201)["lengths"]
        before, clicks = known(web, project), web.get(f"/api/projects/{old}")["counts"]["points"]
    lose(data)
    shutil.copy(tmp_path / "yesterday.db", data / "r2c2r.db")
    os.utime(data / "projects" / project, (1, 1))
    with start() as web:
        web.until(lambda: (data / "unknown" / f"{old}-newer" / "project.json").exists())
        leftovers.tidy(web.context)
        assert [shown["id"] for shown in web.get("/api/projects")] == [old]
        whole, newer = sorted(web.get("/api/unknown"), key=lambda entry: entry["kind"], reverse=True)
        assert (whole["kind"], whole["name"], whole["objects"], whole["bundles"]) == ("project", "Aunt Ida's kitchen", 1, 1)
        assert (whole["recording"], whole["why_not"], whole["left"], newer["kind"]) == (True, "", False, "newer")
        assert web.post(f"/api/unknown/{whole['entry']}/leave")["left"]
        web.post("/api/unknown/..%2Fprojects/adopt", status=404)
        assert web.post(f"/api/unknown/{whole['entry']}/adopt")["id"] == project
        assert known(web, project) == before
        assert web.get(f"/api/projects/{old}")["counts"]["points"] == clicks - 1
        web.post(f"/api/unknown/{newer['entry']}/adopt")
        assert web.get(f"/api/projects/{old}")["counts"]["points"] == clicks
        (length,) = web.get(f"/api/projects/{old}/lengths")["lengths"]
        assert {**length, "id": 0} == {**lengths[0], "id": 0}
        web.post(f"/api/projects/{old}/undo", {"scope": "prompts", "object": drawer})  # and that can be undone
        assert web.get(f"/api/projects/{old}")["counts"]["points"] == clicks - 1
        assert web.get("/api/unknown") == []


def test_adopting_a_project_restores_its_members_by_account_name(start: Start, tmp_path: Path) -> None:
    data = tmp_path / "data"

    def signed_in(web: Running, name: str) -> TestClient:
        client = TestClient(web.app, base_url=ORIGIN, headers={"X-Requested-With": "tests"})
        assert client.post("/api/login", json={"name": name, "password": "three plain words"}).status_code == 204
        return client

    def add(web: Running, *names: str) -> None:
        for name in names:
            accounts.add(web.context.engine, name, "annotator", "three plain words")

    with start() as web:
        add(web, "alice", "bob", "carol")
        project = signed_in(web, "alice").post("/api/projects/sample", json={}).json()["id"]
        web.until(lambda: web.get(f"/api/projects/{project}")["status"] == "ready")
        members = f"/api/projects/{project}/members"
        kept_to = {"members_only": True, "members": ["bob", "carol"]}
        assert web.client.put(members, json=kept_to).status_code == 200
    lose(data)
    (data / "projects" / project).rename(tmp_path / project)
    with start() as web:
        add(web, "dave", "bob", "alice")  # with other ids than before, and without carol
        web.settings.unknown.mkdir(exist_ok=True)
        (tmp_path / project).rename(web.settings.unknown / project)
        web.post(f"/api/unknown/{project}/adopt")
        assert {name: signed_in(web, name).get(members).status_code for name in ("alice", "bob", "dave")} == {
            "alice": 200,
            "bob": 200,
            "dave": 404,
        }
        told = signed_in(web, "alice").get(members).json()
        assert (told["members_only"], told["owner"], told["members"], told["may_change"]) == (True, "alice", ["bob"], True)


def test_only_admins_manage_folders_set_aside(web: Running) -> None:
    accounts.add(web.context.engine, "eve", "reviewer", "three plain words")
    eve = TestClient(web.app, base_url=ORIGIN, headers={"X-Requested-With": "tests"})
    eve.post("/api/login", json={"name": "eve", "password": "three plain words"})
    assert eve.get("/api/unknown").status_code == 403
    assert eve.post("/api/unknown/x/adopt").status_code == 403
    assert eve.post("/api/unknown/x/leave").status_code == 403
    assert eve.post("/api/unknown/x/discard").status_code == 403


def test_entries_that_are_no_project_are_listed_and_not_adoptable(web: Running) -> None:
    folder = web.settings.unknown
    for name, content in (("a/project.json", b'{"version": 2}'), ("b/notes.txt", b"x"), ("c.part", b"bytes")):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    shown = {entry["entry"]: entry for entry in web.get("/api/unknown")}
    assert {name: entry["kind"] for name, entry in shown.items()} == {"a": "other", "b": "other", "c.part": "upload"}
    assert "version" in shown["a"]["why_not"]
    assert "neither project.json nor a recording" in shown["b"]["why_not"]
    assert "not a zip" in shown["c.part"]["why_not"]
    for name in shown:
        assert web.post(f"/api/unknown/{name}/adopt", status=422)["kind"] in ("input", "capture")
    assert (folder / "a" / "project.json").exists()
    assert (folder / "c.part").exists()


def test_complete_orphaned_uploads_are_adoptable_and_partial_ones_discarded(web: Running) -> None:
    folder = web.settings.unknown
    folder.mkdir()
    with zipfile.ZipFile(folder / "whole.part", "w") as recording:
        recording.writestr("metadata", "{}")
    content = (folder / "whole.part").read_bytes()
    (folder / "half.part").write_bytes(content[: len(content) // 2])
    (folder / "project").mkdir()
    half, whole = sorted((entry for entry in web.get("/api/unknown") if entry["kind"] == "upload"), key=lambda e: e["entry"])
    assert ("cut short" in half["why_not"], half["recording"]) == (True, False)
    assert (whole["why_not"], whole["recording"]) == ("", True)
    project = web.post("/api/unknown/whole.part/adopt")["id"]
    web.until(lambda: web.get(f"/api/projects/{project}")["status"] == "ready")
    assert (project_files(web.settings.data_dir, project).source / "Recovered.zip").read_bytes() == content
    assert web.get("/api/uploads") == []
    assert web.client.post("/api/unknown/half.part/discard").status_code == 204
    assert web.post("/api/unknown/project/discard", status=422)["kind"] == "input"
    assert {path.name for path in folder.iterdir()} == {"project"}


def test_a_folder_without_description_is_adopted_with_its_last_inputs(start: Start, tmp_path: Path) -> None:
    data = tmp_path / "data"
    with start() as web:
        project = worked_on(web)
    folder = data / "projects" / project
    (folder / "project.json").unlink()
    prompts = json.loads((folder / "finished-prompts.json").read_text())
    corners = [[0.0, 1.0, 0.8], [0.5, 1.0, 0.8], [0.5, 1.0, 0.1], [0.0, 1.0, 0.1]]
    prompts["objects"][0] |= {"front": {"corners_m": corners}, "frames": [{"frame": 3, "mask": None}]}
    (folder / "work" / "prompts.json").write_text(json.dumps(prompts | {"version": 2}))
    corrections = {"version": 1, "objects": {"drawer_1": {"hinge": "left", "joint_limits": [0.0, 1.0]}}}
    (folder / "work" / "overrides.json").write_text(json.dumps(corrections))
    lose(data)
    with opened(data / "r2c2r.db", anew=True) as engine:
        (said,) = adopt_all(engine, data, "tester")
    assert "adopted" in said
    with start() as web:
        (drawer, _) = web.get(f"/api/projects/{project}/objects")
        assert (drawer["name"], len(drawer["points"])) == ("drawer_1", 2)
        kept = web.get(f"/api/projects/{project}/prompts.json")["objects"][0]
        assert (kept["front"]["corners_m"], kept["frames"]) == (corners, [{"frame": 3, "mask": None}])
        override = web.get(f"/api/projects/{project}/objects/{drawer['id']}/override")
        assert (override["hinge"], override["joint_upper"]) == ("left", 1.0)
        assert [bundle["version"] for bundle in web.get(f"/api/projects/{project}/bundles")] == [1]


def test_adopting_a_project_that_was_never_imported_queues_its_import(start: Start, tmp_path: Path) -> None:
    data = tmp_path / "data"
    with start() as web:
        project = web.sample()
    folder = data / "projects" / project
    (folder / "facts.json").unlink()
    (folder / "source").mkdir(exist_ok=True)
    (folder / "source" / "scan.r3d").touch()
    lose(data)
    with opened(data / "r2c2r.db", anew=True) as engine:
        adopt_all(engine, data, "tester")
        with reading(engine) as session:
            assert session.exec(select(Job.kind, Job.state)).all() == [("import", "queued")]


def test_changes_are_written_to_the_description_and_read_back_unchanged(web: Running) -> None:
    project = web.sample()
    files = project_files(web.settings.data_dir, project)
    drawer = web.get(f"/api/projects/{project}/objects")[0]["id"]
    web.post(f"/api/projects/{project}/objects/{drawer}/points?infer=false", {"frame": 3, "x": 4.5, "y": 5.5, "label": 0})

    def clicks() -> list[tuple[int, float]]:
        said = read_description(files.description) if files.description.exists() else None
        return [(point.frame, point.x) for item in said.objects for point in item.points] if said else []

    web.until(lambda: (3, 4.5) in clicks())
    with reading(web.context.engine) as session:
        row = session.get(Project, project)
        assert row is not None
        assert describe(session, row, files) == read_description(files.description)
    assert json.loads(files.description.read_text())["project"]["source_path"] == "source/Sample kitchen.r3d"


def test_descriptions_without_true_lengths_are_rewritten_at_start(start: Start) -> None:
    with start() as web:
        project = web.sample()
        web.post(f"/api/projects/{project}/lengths", {"points_world": [[0, 0, 0], [0, 1, 0]], "metres": 1.01}, 201)
    path = project_files(web.settings.data_dir, project).description
    said = json.loads(path.read_text())
    (length,) = said.pop("true_lengths")
    assert (length["metres"], length["points_world"], length["scale"]) == (1.01, [[0, 0, 0], [0, 1, 0]], 1.0)
    path.write_text(json.dumps(said))
    with start():
        pass
    assert json.loads(path.read_text()) == {**said, "true_lengths": [length]}


def test_adopting_does_not_duplicate_comments_and_lengths(web: Running) -> None:
    project = worked_on(web)
    before = known(web, project)
    context = web.context
    with writing(context.engine) as session:
        row = session.get(Project, project)
        assert row is not None
        description = describe(session, row, context.files(row))
        for told in (*session.exec(select(Comment)), *session.exec(select(TrueLength).where(TrueLength.metres > 1.0))):
            session.delete(told)
        session.flush()
        adopt(session, web.settings.data_dir, description, [], "tester")
    after = known(web, project)
    assert after["comments"] == before["comments"]
    assert sorted(after["lengths"]["lengths"], key=lambda row: row["at"]) == before["lengths"]["lengths"]


def test_an_uncommitted_change_is_not_announced(web: Running) -> None:
    project, told = web.sample(), []
    web.context.engine.update_execution_options(projects_changed=lambda ids: told.extend(ids))
    with suppress(ZeroDivisionError), writing(web.context.engine) as session:
        row = session.get(Project, project)
        row.name = "never"  # type: ignore[union-attr]
        session.flush()
        raise ZeroDivisionError
    assert told == []
    web.patch(f"/api/projects/{project}", {"name": "new"})
    assert told == [project]


def test_describing_a_project_needs_a_constant_number_of_queries(web: Running) -> None:
    project = web.sample()
    files, engine = project_files(web.settings.data_dir, project), web.context.engine

    def queries() -> int:
        with statements(engine) as asked, reading(engine) as session:
            row = session.get(Project, project)
            asked.clear()
            describe(session, row, files)  # type: ignore[arg-type]
        return len(asked)

    few = queries()
    for number in range(6):
        web.post(f"/api/projects/{project}/objects", {"name": f"door_{number}", "category": "cabinet"})
    assert queries() == few


def test_an_invalid_description_raises_with_the_file_name(tmp_path: Path) -> None:
    path = tmp_path / "project.json"
    for content in ("", "[]", '{"version": 1}', "\ud800".encode("utf-8", "surrogatepass").decode("latin-1")):
        path.write_text(content)
        with pytest.raises(InputError, match=r"project\.json"):
            read_description(path)
