"""Backup and restore of the data folder, and consistency checks of its database and files."""

import json
import shutil
import sqlite3
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import create_engine, text

from app.backups import backup
from app.data_check import check_data
from app.db.migrations import migrate, revisions
from app.files import only_server
from r2c2r_core.cli import main
from tests.app.conftest import Running

Start = Callable[..., Any]


@pytest.fixture
def kept(start: Start, tmp_path: Path) -> tuple[Path, str]:
    """A data folder at rest, and the id of its project with a bundle."""
    with start() as web:
        project = web.sample()
        web.job(web.post(f"/api/projects/{project}/run", {}, 202)["id"], "done")
    data = tmp_path / "data"
    for path in (data, *data.glob("r2c2r.db*")):
        path.chmod(0o700 if path.is_dir() else 0o600)
    return data, project


def findings(data: Path) -> set[tuple[str, str]]:
    return {(found.what, Path(found.where).name) for found in check_data(data)}


def test_a_backup_taken_while_the_server_writes_is_consistent(start: Start, tmp_path: Path) -> None:
    with start() as web:
        project = web.sample()
        drawer = web.get(f"/api/projects/{project}/objects")[0]["id"]
        address = f"/api/projects/{project}/objects/{drawer}/points?infer=false"
        web.post(address, {"frame": 3, "x": 1.5, "y": 2.5, "label": 0})
        moved = backup(web.settings.data_dir, tmp_path / "copy")
        web.post(address, {"frame": 3, "x": 9.5, "y": 2.5, "label": 0})
    assert moved.projects == 1
    assert (tmp_path / "copy" / "projects" / project / "facts.json").is_file()
    connection = sqlite3.connect(tmp_path / "copy" / "r2c2r.db")
    assert connection.execute("SELECT x FROM prompt_points WHERE label = 0").fetchall() == [(1.5,)]
    connection.close()
    assert [path.name for path in (tmp_path / "copy").iterdir() if path.is_file()] == ["r2c2r.db"]  # no -wal left behind


def test_restore_recreates_missing_files_and_keeps_existing_ones(
    kept: tuple[Path, str], tmp_path: Path, start: Start, capsys: pytest.CaptureFixture[str]
) -> None:
    data, project = kept
    copy, bundle = tmp_path / "copy", data / "projects" / project / "bundles" / "v1.zip"
    assert main(["backup", "--data", str(data), "-o", str(copy)]) == 0
    assert "of 1 projects" in capsys.readouterr().out
    assert main(["backup", "--data", str(data), "-o", str(copy)]) == 2  # never overwritten
    bundle.unlink()
    (data / "projects" / project / "facts.json").write_text("newer")
    (data / "r2c2r.db").write_bytes(b"damaged" * 1000)
    assert main(["restore", str(copy), "--data", str(data)]) == 0
    assert bundle.is_file()
    assert (data / "projects" / project / "facts.json").read_text() == "newer"
    (replaced,) = (data / "backups").glob("replaced-*/r2c2r.db")
    assert replaced.read_bytes() == b"damaged" * 1000
    with start() as web:
        assert [shown["id"] for shown in web.get("/api/projects")] == [project]


def test_a_database_alone_is_backed_up_and_restored(kept: tuple[Path, str], tmp_path: Path) -> None:
    data, _ = kept
    assert main(["backup", "--data", str(data), "-o", str(tmp_path / "night.db")]) == 0
    (data / "r2c2r.db").unlink()
    assert main(["restore", str(tmp_path / "night.db"), "--data", str(data)]) == 0
    assert findings(data) == set()


def test_restore_is_refused_under_a_running_server_or_from_an_invalid_backup(
    kept: tuple[Path, str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data, _ = kept
    before = (data / "r2c2r.db").read_bytes()
    assert main(["backup", "--data", str(data), "-o", str(tmp_path / "night.db")]) == 0
    with only_server(data):
        assert main(["restore", str(tmp_path / "night.db"), "--data", str(data)]) == 1
    assert "serves this folder" in capsys.readouterr().err
    (tmp_path / "garbage.db").write_bytes(b"no database" * 1000)
    for source in ("garbage.db", "nothing.db", "data"):
        assert main(["restore", str(tmp_path / source), "--data", str(data)]) > 0
        assert capsys.readouterr().err.count("\n") == 1
    assert (data / "r2c2r.db").read_bytes() == before


def test_check_data_reports_missing_unknown_damaged_and_exposed_files(
    kept: tuple[Path, str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data, project = kept
    assert main(["check-data", "--data", str(data)]) == 0
    assert "no problems found" in capsys.readouterr().out
    folder = data / "projects" / project
    shutil.copy(folder / "bundles" / "v1.zip", folder / "bundles" / "v7.zip")
    (folder / "bundles" / "v1.zip").write_bytes(b"other")
    (folder / "frames.json").unlink()
    (folder / "source" / "Sample kitchen.r3d").unlink()
    (data / "projects" / "0123456789ab").mkdir()
    (data / "unknown").mkdir()
    for path in (data / "uploads" / "stray.part", data / "unknown" / "x"):
        path.parent.mkdir(exist_ok=True)
        path.touch()
    said = json.loads((folder / "project.json").read_text()) | {"changed": 1.0}
    (folder / "project.json").write_text(json.dumps(said))
    data.chmod(0o755)
    assert main(["check-data", "--data", str(data), "--json", str(tmp_path / "found.json")]) == 1
    found = json.loads((tmp_path / "found.json").read_text())
    assert found["version"] == 1
    assert {(one["what"], Path(one["where"]).name) for one in found["findings"]} == {
        ("unknown", "v7.zip"),
        ("damaged", "v1.zip"),
        ("missing", "frames.json"),
        ("missing", "Sample kitchen.r3d"),
        ("unknown", "0123456789ab"),
        ("unknown", "stray.part"),
        ("unknown", "x"),
        ("outdated", "project.json"),
        ("open", "data"),
    }
    data.chmod(0o700)
    shutil.rmtree(folder)  # the rows stay
    assert ("missing", project) in findings(data)
    (data / "r2c2r.db").write_bytes(b"damaged" * 1000)
    assert main(["check-data", "--data", str(data)]) == 2
    assert main(["check-data", "--data", str(tmp_path / "nowhere")]) == 2


def test_check_data_reads_an_outdated_database_without_changing_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    older, path = revisions()[-2], tmp_path / "r2c2r.db"
    engine = create_engine(f"sqlite:///{path}")
    migrate(engine, older)
    with engine.begin() as connection:
        columns = "id, name, status, created, updated, source_name, media_version, capture, notices"
        connection.execute(text(f"INSERT INTO projects ({columns}) VALUES ('lost', 'x', 'ready', 0, 0, 'x', '', '{{}}', '[]')"))
    engine.dispose()
    before = path.read_bytes()
    assert findings(tmp_path) >= {("outdated", "r2c2r.db"), ("missing", "lost"), ("missing", "frames.json")}
    assert main(["check-data", "--data", str(tmp_path)]) == 1
    assert f"revision {older}" in capsys.readouterr().out
    assert path.read_bytes() == before
    assert [found.name for found in tmp_path.iterdir()] == ["r2c2r.db"]


def test_check_data_creates_no_database_in_an_empty_folder(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check-data", "--data", str(tmp_path)]) == 2
    assert "no database yet" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_backup_restore_and_check_data_report_progress(
    kept: tuple[Path, str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data, _ = kept
    assert main(["backup", "--data", str(data), "-o", str(tmp_path / "copy")]) == 0
    assert main(["restore", str(tmp_path / "copy"), "--data", str(data)]) == 0
    assert main(["check-data", "--data", str(data)]) == 0
    said = capsys.readouterr().err.splitlines()
    for step in ("backup 0 % copying the database", "restore 0 % copying the database", "check-data 0 % reading the database"):
        assert step in said
    assert any(line.startswith("backup 10 % copying files") for line in said)
    assert any(line.startswith("check-data 10 % files of project") for line in said)


def test_rows_with_missing_parents_are_reported_as_damage(kept: tuple[Path, str]) -> None:
    data, _ = kept
    connection = sqlite3.connect(data / "r2c2r.db")
    connection.execute("INSERT INTO prompt_points (object_id, frame, x, y, label) VALUES (999, 0, 1, 1, 1)")
    connection.commit()
    connection.close()
    assert ("damaged", "r2c2r.db") in findings(data)


def test_the_doctor_reports_a_data_folder_accessible_to_other_users(tmp_path: Path) -> None:
    from r2c2r_core.doctor import examine_machine

    tmp_path.chmod(0o750)
    (found,) = (one for one in examine_machine(tmp_path) if one.what == "data folder")
    assert (found.state, "chmod go=" in found.detail) == ("problem", True)
    tmp_path.chmod(0o700)
    (found,) = (one for one in examine_machine(tmp_path) if one.what == "data folder")
    assert found.state == "ok"


def test_uploads_in_progress_are_not_reported_as_problems(web: Running) -> None:
    web.post("/api/uploads", {"file_name": "Kitchen.r3d", "size": 10})
    assert {what for what, _ in findings(web.settings.data_dir)} <= {"open"}
