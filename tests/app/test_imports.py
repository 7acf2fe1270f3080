import io
import stat
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from app.db.engine import writing
from app.db.tables import Project
from tests.app.conftest import COOKIE, Running


def archive(*members: tuple[str, bytes]) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as made:
        for name, content in members:
            made.writestr(name, content)
    return buffer.getvalue()


R3D = archive(("metadata", b"{}"), ("rgbd/0.jpg", b"x" * 1000))


def upload(web: Running, content: bytes, name: str = "scan.r3d", status: int = 202) -> Any:
    return web.post(f"/api/projects/upload?filename={name}", status=status, content=content)


def left_behind(web: Running) -> list[Path]:
    """Files and folders of projects and uploads."""
    return [path for folder in (web.settings.data_dir / "projects", web.settings.uploads) for path in folder.rglob("*")]


def test_an_upload_becomes_a_ready_project_with_its_frames(web: Running) -> None:
    project = upload(web, R3D, "My kitchen.r3d")
    assert (project["name"], project["status"], project["job"]["kind"]) == ("My kitchen", "importing", "import")
    web.until(lambda: web.get(f"/api/projects/{project['id']}")["status"] == "ready")
    ready = web.get(f"/api/projects/{project['id']}")
    assert (ready["capture"]["frame_count"], ready["notices"], ready["result"]) == (3, ["a notice"], "none")
    assert [f["index"] for f in web.get(f"/api/projects/{project['id']}/frames")] == [0, 3, 7]


def test_the_recording_of_a_sample_has_the_name_of_its_project_as_bundles_are_titled_by_it(web: Running) -> None:
    project = web.sample()
    (recording,) = (web.settings.data_dir / "projects" / project / "source").glob("*.r3d")
    assert (recording.stem, web.get(f"/api/projects/{project}")["name"]) == ("Sample kitchen", "Sample kitchen")


def test_capture_facts_of_an_older_version_do_not_hide_a_project(web: Running) -> None:
    project = upload(web, R3D, "My kitchen.r3d")["id"]
    web.until(lambda: web.get(f"/api/projects/{project}")["status"] == "ready")
    with writing(web.context.engine) as session:
        row = session.get(Project, project)
        row.capture = {**row.capture, "reasons": ["said by an older version"]}
        session.add(row)
    assert web.get(f"/api/projects/{project}")["capture"]["frame_count"] == 3


def test_a_file_name_with_path_traversal_stays_inside_the_project(web: Running) -> None:
    project = upload(web, R3D, "..%2F..%2Fetc%2Fpasswd")
    (stored,) = (web.settings.data_dir / "projects" / project["id"] / "source").iterdir()
    assert stored.name == "passwd"


def test_the_upload_limit_is_reported_and_enforced_with_and_without_length(start: Callable[..., Any]) -> None:
    with start(max_upload_bytes=5000) as web:
        assert web.get("/api/system")["max_upload_bytes"] == 5000
        assert upload(web, b"PK\3\4" + bytes(6000), status=413)["kind"] == "too-large"
        pieces = (b"PK\3\4" + bytes(1000) for _ in range(9))
        assert upload(web, pieces, status=413)["kind"] == "too-large"  # type: ignore[arg-type]  # no length announced
        assert left_behind(web) == []
        assert web.get("/api/projects") == []


def test_a_full_disk_is_reported_before_an_upload_is_stored(start: Callable[..., Any]) -> None:
    with start(min_free_bytes=1 << 60) as web:
        error = upload(web, R3D, status=507)
        assert (error["kind"], "GB free" in error["message"]) == ("no-space", True)
        assert web.post("/api/projects/sample", {}, 507)["kind"] == "no-space"


def linked() -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as made:
        info = zipfile.ZipInfo("rgb/link")
        info.external_attr = (stat.S_IFLNK | 0o777) << 16
        made.writestr(info, "/etc/passwd")
    return buffer.getvalue()


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "empty"),
        (b"not an archive at all", "not a zip"),
        (R3D[:-60], "cut short"),
        (R3D.replace(b"PK\x01\x02", b"PK\x01\x03"), "damaged"),
        (b"PK\3\4" + bytes(500), "cut short"),
        (archive(("../../evil.sh", b"x")), "path"),
        (archive(("/etc/cron.d/evil", b"x")), "path"),
        (archive(("C:\\evil.exe", b"x")), "path"),
        (linked(), "link"),
        (archive(("bomb", bytes(80 << 20))), "times its size"),
    ],
)
def test_hostile_or_broken_archives_are_refused_in_one_line_without_residue(web: Running, content: bytes, words: str) -> None:
    error = upload(web, content, "scan.zip", 422)
    assert set(error) == {"kind", "message", "hint", "current"}
    assert words in error["message"]
    assert "\n" not in error["message"]
    assert left_behind(web) == []
    assert web.get("/api/projects") == []


def test_an_archive_with_an_implausibly_large_directory_is_refused(web: Running) -> None:
    end = b"PK\5\6" + bytes(8) + (0xFFFFFF0).to_bytes(4, "little") + bytes(6)
    assert "table of contents" in upload(web, b"PK\3\4" + bytes(100) + end, status=422)["message"]


def test_an_import_by_path_leaves_the_recording_in_place(web: Running, tmp_path: Path) -> None:
    folder = tmp_path / "recordings" / "kitchen"
    folder.mkdir(parents=True)
    (folder / "frame.txt").write_text("x")
    project = web.post("/api/projects/import", {"path": str(folder)}, 202)
    web.until(lambda: web.get(f"/api/projects/{project['id']}")["status"] == "ready")
    web.delete(f"/api/projects/{project['id']}")
    web.delete(f"/api/trash/{project['id']}")
    assert (folder / "frame.txt").exists()


def test_recordings_of_equal_names_are_told_apart(web: Running, tmp_path: Path) -> None:
    def named(*path: str, **given: str) -> str:
        folder = tmp_path.joinpath(*path)
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "frame.txt").write_text("x")
        name: str = web.post("/api/projects/import", {"path": str(folder), **given}, 202)["name"]
        return name

    assert [named("oak", "capture"), named("pine", "Capture"), named("oak", "scan")] == ["oak", "pine", "oak 2"]
    assert [named("loft"), named("attic", "loft"), named("loft", name="loft")] == ["loft", "loft 2", "loft"]
    assert [upload(web, R3D)["name"] for _ in range(2)] == ["scan", "scan 2"]


def test_paths_outside_the_import_roots_are_refused_also_through_symlinks(web: Running, tmp_path: Path) -> None:
    (tmp_path / "out").symlink_to("/etc")
    for path in ("/etc", "/etc/passwd", f"{tmp_path}/../..", str(tmp_path / "out"), "/proc/self/environ"):
        assert web.post("/api/projects/import", {"path": path}, 403)["kind"] == "forbidden"
        assert web.get("/api/browse", 403, params={"path": path})["kind"] == "forbidden"
    assert web.post("/api/projects/import", {"path": str(tmp_path / "absent")}, 404)["kind"] == "not-found"


def test_folders_below_an_import_root_can_be_browsed(web: Running, tmp_path: Path) -> None:
    (tmp_path / "b.r3d").write_bytes(b"xx")
    (root,) = web.get("/api/browse")["entries"]
    listing = web.get("/api/browse", params={"path": root["path"]})
    names = {entry["name"]: entry["folder"] for entry in listing["entries"]}
    assert names["b.r3d"] is False
    assert names["data"] is True


def test_an_unreadable_recording_leaves_a_failed_project_with_the_reason(web: Running) -> None:
    project = upload(web, R3D, "broken.r3d")["id"]
    web.until(lambda: web.get(f"/api/projects/{project}")["status"] == "failed")
    error = web.get(f"/api/projects/{project}")["error"]
    assert (error["kind"], error["message"], error["hint"]) == ("capture", "no depth in it", "record again")
    assert web.get(f"/api/projects/{project}/frames", 409)["kind"] == "not-ready"
    assert web.post(f"/api/projects/{project}/run", {}, 409)["kind"] == "not-ready"


def test_a_failed_import_of_an_upload_keeps_only_the_reason_and_the_log(web: Running) -> None:
    project = upload(web, R3D, "broken.r3d")
    web.until(lambda: web.get(f"/api/projects/{project['id']}")["status"] == "failed")
    log = web.settings.data_dir / "projects" / project["id"] / "logs" / f"job-{project['job']['id']}.log"
    kept = {path for path in left_behind(web) if path.is_file()} - {log.parent.parent / "project.json"}  # describes the folder
    assert kept == {log}
    told = web.get(f"/api/jobs/{project['job']['id']}")["no_retry"]  # before it is requested
    assert ("refused" in told, web.post(f"/api/jobs/{project['job']['id']}/retry", status=409)["message"]) == (True, told)
    web.delete(f"/api/projects/{project['id']}")
    web.delete(f"/api/trash/{project['id']}")
    assert left_behind(web) == []


def test_a_failed_import_by_path_keeps_the_original_recording(web: Running, tmp_path: Path) -> None:
    (tmp_path / "broken.r3d").write_bytes(R3D)
    project = web.post("/api/projects/import", {"path": str(tmp_path / "broken.r3d")}, 202)["id"]
    web.until(lambda: web.get(f"/api/projects/{project}")["status"] == "failed")
    assert (tmp_path / "broken.r3d").read_bytes() == R3D
    assert web.get(f"/api/projects/{project}")["job"]["no_retry"] == ""


def test_deleting_a_project_deletes_its_files_and_reports_the_freed_bytes(web: Running) -> None:
    project = web.sample()
    folder = web.settings.data_dir / "projects" / project
    size = sum(p.stat().st_size for p in folder.rglob("*") if p.is_file())
    web.delete(f"/api/projects/{project}")
    assert folder.exists()
    assert web.delete(f"/api/trash/{project}")["freed_bytes"] >= size > 0
    assert not folder.exists()
    web.get(f"/api/projects/{project}", 404)
    assert web.get("/api/jobs") == []


def test_renaming_a_project_is_recorded_in_its_history(web: Running) -> None:
    project = web.sample()
    assert web.patch(f"/api/projects/{project}", {"name": "Aunt's kitchen"})["name"] == "Aunt's kitchen"
    assert web.get(f"/api/projects/{project}/history")[0]["action"] == "rename"


def test_the_sample_project_has_objects_with_clicks(web: Running) -> None:
    project = web.sample()
    assert [o["name"] for o in web.get(f"/api/projects/{project}/objects")] == ["drawer_1", "mug_1"]
    assert web.get(f"/api/projects/{project}")["counts"] == {
        "objects": 2,
        "points": 2,
        "accepted": 0,
        "rejected": 0,
        "open_comments": 0,
    }


def break_off(web: Running, method: str, path: str, content: bytes, query: str = "", headers: Any = None) -> list[Any]:
    """Send a request whose client disconnects after `content`; return the app's responses."""
    told = [{"type": "http.request", "body": content, "more_body": True}, {"type": "http.disconnect"}]
    said: list[Any] = []
    sent = {
        "host": "127.0.0.1:8000",  # the session cookie's name contains its port
        "cookie": f"{COOKIE}={web.client.cookies[COOKIE]}",
        "x-requested-with": "tests",
        **(headers or {}),
    }
    scope = {"type": "http", "method": method, "path": path, "query_string": query.encode(), "app": web.app}
    scope |= {"headers": [(name.encode(), value.encode()) for name, value in sent.items()]}
    scope |= {"http_version": "1.1", "scheme": "http", "server": ("127.0.0.1", 8000)}

    async def receive() -> Any:
        return told.pop(0)

    async def send(message: Any) -> None:
        said.append(message)

    web.client.portal.call(web.app, scope, receive, send)  # type: ignore[union-attr]  # open while the client is
    return said


def test_an_aborted_single_request_upload_leaves_nothing(web: Running) -> None:
    said = break_off(web, "POST", "/api/projects/upload", R3D[:200], query="filename=scan.r3d")
    assert said[0]["status"] == 422
    assert left_behind(web) == []
    assert web.get("/api/projects") == []
    assert web.get("/api/uploads") == []
