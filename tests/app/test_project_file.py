"""Export of a project as one file, and its import and validation on another server."""

import io
import json
import stat
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from sqlite3 import connect
from typing import Any

import pytest
from starlette.testclient import TestClient

from app.errors import Unavailable
from app.jobs.ingest import refuse_another
from app.services import accounts, project_export, uploads
from app.store.protocol import Folder
from r2c2r_core.errors import CaptureError
from tests.app.conftest import ORIGIN, Running, running
from tests.app.test_imports import R3D, archive, left_behind, upload
from tests.app.test_states import step

MASK = {"width": 160, "height": 120, "runs": [500, 40, 18660]}
CLICK = {"frame": 3, "x": 80.5, "y": 60.5, "label": 1}
OBJECTS = [
    {
        "name": "drawer_1",
        "category": "drawer",
        "points": [CLICK],
        "frames": [{"frame": 0, "mask": MASK}, {"frame": 7, "mask": None}],
    },
    {"name": "mug_1", "category": "mug", "points": [CLICK, {**CLICK, "x": 12.25, "label": 0}]},
]
SAID = "a scratch, @bob"
LISTED = [{"name": "oven_1", "category": "oven"}]


@pytest.fixture(scope="module")
def first(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Running, str]]:
    """A server and the id of a project that people worked on."""
    with running(tmp_path_factory.mktemp("first") / "data", user="ann") as web:
        project = upload(web, R3D, "Old kitchen.r3d")["id"]
        web.until(lambda: web.get(f"/api/projects/{project}")["status"] == "ready")
        at = f"/api/projects/{project}"
        drawer, mug = (item["id"] for item in web.post(f"{at}/prompts.json", {"version": 2, "objects": OBJECTS}))
        web.patch(f"{at}/objects/{mug}", {"colour": 9})
        web.patch(f"{at}/objects/{drawer}", {"locked": True})
        web.patch(f"{at}/objects/{drawer}/override", {"joint_upper": 0.3, "dimensions_m": [0.6, 0.5, 0.2], "rerun": False})
        web.post(f"{at}/objects/{mug}/candidates?filename=mine.glb&rerun=false", content=b"glTF" * 99, status=201)
        web.post(f"{at}/comments", {"object": mug, "frame": 3, "x": 4.0, "y": 5.0, "text": SAID}, 201)
        web.post(f"{at}/comments", {"text": "done"}, 201)
        settled = web.get(f"{at}/comments")[1]["id"]
        web.patch(f"{at}/comments/{settled}", {"resolved": True})
        web.post(f"{at}/lengths", {"object": drawer, "side": "width", "metres": 0.6}, 201)
        web.patch(at, {"name": "Old kitchen", "tags": ["oak"]})
        template = web.post("/api/templates", {"name": "Flat", "objects": LISTED}, 201)
        web.client.put(f"{at}/checklist", json={"template": template["id"]})
        for to in ("ready", "in review", "approved"):
            step(web, project, to, "it is time")
        yield web, project


@pytest.fixture
def second(tmp_path: Path) -> Iterator[Running]:
    with running(tmp_path / "second", user="bea") as web:
        yield web


def exported(first: tuple[Running, str], *, recording: bool = True) -> bytes:
    web, project = first
    answer = web.client.get(f"/media/{project}/project.zip", params={"recording": recording})
    assert answer.status_code == 200, answer.text
    assert answer.headers["content-disposition"] == 'attachment; filename="Old kitchen.r2c2r.zip"'
    return answer.content


def members(content: bytes) -> dict[str, bytes]:
    with zipfile.ZipFile(io.BytesIO(content)) as opened:
        assert opened.testzip() is None
        return {name: opened.read(name) for name in opened.namelist()}


def changed(content: bytes, name: str, change: Callable[[Any], Any]) -> bytes:
    """The file with one document changed."""
    found = members(content)
    found[name] = json.dumps(change(json.loads(found[name]))).encode()
    return archive(*found.items())


def take_in(web: Running, content: bytes, status: int = 202) -> Any:
    return upload(web, content, "Old kitchen.r2c2r.zip", status)


def given(web: Running, project: str) -> tuple[Any, Any]:
    """prompts.json and overrides.json as exported."""
    found = members(web.client.get(f"/media/{project}/project.zip").content)
    return json.loads(found["prompts.json"]), json.loads(found["overrides.json"])


def test_a_project_file_restores_all_annotations_on_another_server(first: tuple[Running, str], second: Running) -> None:
    content = exported(first)
    made = take_in(second, content)
    assert (made["name"], made["tags"], made["checklist"], made["job"]["kind"]) == ("Old kitchen", ["oak"], LISTED, "import")
    second.until(lambda: second.get(f"/api/projects/{made['id']}")["status"] == "ready")
    at = f"/api/projects/{made['id']}"
    stored = second.settings.data_dir / "projects" / made["id"]
    assert (stored / "source" / "Old kitchen.r3d").read_bytes() == R3D
    prompts, overrides = given(second, made["id"])
    theirs = given(*first)
    assert prompts == theirs[0]
    assert prompts["objects"][0]["frames"][0]["mask"] == MASK
    assert overrides["objects"]["drawer_1"] == theirs[1]["objects"]["drawer_1"]
    mesh = overrides["objects"]["mug_1"]["candidate"]
    assert members(content)[theirs[1]["objects"]["mug_1"]["candidate"]] == b"glTF" * 99
    assert (stored / "uploads" / mesh.removeprefix("meshes/")).read_bytes() == b"glTF" * 99
    assert [item["colour"] for item in second.get(f"{at}/objects")] == [0, 9]
    one, settled = second.get(f"{at}/comments")
    assert [item["locked_by"] for item in second.get(f"{at}/objects")] == ["ann (imported)", None]
    assert (one["text"], one["who"], one["object"]) == (SAID, "ann (imported)", second.get(f"{at}/objects")[1]["id"])
    assert (settled["resolved_by"], one["resolved_at"]) == ("bea", None)
    (length,) = second.get(f"{at}/lengths")["lengths"]
    assert (length["text"], length["metres"], length["who"]) == ("width of drawer_1", 0.6, "bea")
    assert list(second.settings.uploads.iterdir()) == []
    assert not (stored / "half-made").exists()


def test_an_imported_project_is_a_draft_without_foreign_names(first: tuple[Running, str], second: Running) -> None:
    accounts.add(second.context.engine, "ann", "admin", "three plain words")  # a different person of the same name
    made = take_in(second, exported(first))
    second.until(lambda: second.get(f"/api/projects/{made['id']}")["status"] == "ready")
    assert (made["review_state"], made["assignee"], made["archived"]) == ("draft", None, False)
    assert {entry["who"] for entry in second.get(f"/api/projects/{made['id']}/history")} == {"bea"}
    said = [entry["text"] for entry in second.get(f"/api/projects/{made['id']}/history") if entry["scope"] == "project"]
    assert [line.split(";")[0] for line in said] == ["imported from Old kitchen.r2c2r.zip (objects: 2, comments: 2)"]
    assert "approved" not in json.dumps([members(exported(first))[n].decode() for n in ("project.json", "overrides.json")])


def test_a_project_file_without_recording_waits_for_its_upload(first: tuple[Running, str], second: Running) -> None:
    content = exported(first, recording=False)
    assert sorted(name.split("/")[0] for name in members(content)) == [
        "meshes",
        "overrides.json",
        "project.json",
        "prompts.json",
    ]
    made = take_in(second, content)
    assert (made["status"], made["awaits_recording"], made["job"], made["counts"]["objects"]) == ("failed", True, None, 2)
    assert made["error"]["message"] == "the project's file came without its recording"
    sent = second.post("/api/uploads", {"file_name": "scan.r3d", "size": len(R3D)}, 201)["id"]
    at = f"/api/projects/{made['id']}"
    answer = second.client.put(f"{at}/recording", json={"upload": sent})
    assert (answer.status_code, answer.json()["kind"]) == (409, "conflict")
    second.client.patch(f"/api/uploads/{sent}", content=R3D, headers={"Upload-Offset": "0"})
    answer = second.client.put(f"{at}/recording", json={"upload": sent})
    assert (answer.status_code, answer.json()["status"]) == (202, "importing")
    second.until(lambda: second.get(at)["status"] == "ready")
    assert not second.get(at)["awaits_recording"]
    assert given(second, made["id"])[0] == given(*first)[0]
    assert second.get("/api/uploads") == []
    assert second.client.put(f"{at}/recording", json={"upload": sent}).json()["kind"] == "conflict"


def test_a_recording_is_not_sent_again_after_the_store_failed(
    first: tuple[Running, str], second: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = take_in(second, exported(first, recording=False))
    sent = second.post("/api/uploads", {"file_name": "scan.r3d", "size": len(R3D)}, 201)["id"]
    second.client.patch(f"/api/uploads/{sent}", content=R3D, headers={"Upload-Offset": "0"})
    written: list[str] = []

    def fail_once(_: Any, project_id: str) -> None:
        with connect(second.settings.database, timeout=0) as other:
            other.execute("BEGIN IMMEDIATE")  # raises if another connection is writing
            other.rollback()
        written.append(project_id)
        if len(written) == 1:
            raise Unavailable("the store of files: it does not answer", hint="try again in a moment")

    monkeypatch.setattr(Folder, "keep", fail_once)
    at = f"/api/projects/{made['id']}"
    assert second.client.put(f"{at}/recording", json={"upload": sent}).status_code == 503
    assert second.get(at)["awaits_recording"]
    assert second.client.put(f"{at}/recording", json={"upload": sent}).status_code == 202
    second.until(lambda: second.get(at)["status"] == "ready")


def test_the_export_offer_reports_the_size_of_the_file(first: tuple[Running, str]) -> None:
    web, project = first
    offer = web.get(f"/api/projects/{project}/file")
    assert offer["recording_bytes"] == len(R3D)
    packed = members(exported(first, recording=False))
    assert offer["size_bytes"] == pytest.approx(sum(map(len, packed.values())), abs=200)


def _objects(change: Callable[[Any], Any]) -> Callable[[Any], Any]:
    return lambda document: {**document, "objects": change(document["objects"])}


REFUSED: list[tuple[str, Callable[[Any], Any], str]] = [
    ("project.json", lambda d: {**d, "version": 2}, "project.json: version is 2"),
    ("project.json", lambda d: {**d, "kind": "scene"}, "project.json: kind is 'scene'"),
    ("project.json", lambda d: {**d, "owner": "root"}, "unknown key 'owner'"),
    ("project.json", lambda d: {**d, "recording": {**d["recording"], "included": True}}, "names the recording"),
    ("project.json", lambda d: {**d, "colours": [1]}, "1 colours of 2 objects"),
    ("project.json", lambda d: {**d, "locks": [None] * 3}, "3 locks of 2 objects"),
    (
        "project.json",
        lambda d: {**d, "comments": [{**d["comments"][0], "said": {"object": 2, "text": "x"}}]},
        "refers to object 2",
    ),
    ("project.json", lambda d: {**d, "reading": {"scale": 1e9}}, "scale"),
    ("prompts.json", _objects(lambda o: [{**o[0], "points": [{**CLICK, "frame": 4}]}, o[1]]), "no frame 4"),
    ("prompts.json", _objects(lambda o: [{**o[0], "points": [{**CLICK, "x": 400.0}]}, o[1]]), "outside the image"),
    ("prompts.json", _objects(lambda o: [{**o[0], "name": "../x"}, o[1]]), "name"),
    ("prompts.json", _objects(lambda o: o[:1]), "corrects 'mug_1'"),
    ("overrides.json", _objects(lambda o: {"mug_1": {"candidate": "/etc/passwd"}}), "'/etc/passwd', no id"),
    (
        "overrides.json",
        _objects(lambda o: {"mug_1": {"candidate": "meshes/other.glb"}}),
        "'meshes/other.glb', which is not in it",
    ),
    ("overrides.json", _objects(lambda o: {"mug_1": {"hinge": "inside"}}), "hinge"),
]


@pytest.mark.parametrize(("document", "change", "words"), REFUSED)
def test_a_project_file_with_invalid_contents_is_refused_in_one_line(
    first: tuple[Running, str], web: Running, document: str, change: Callable[[Any], Any], words: str
) -> None:
    error = take_in(web, changed(exported(first, recording=False), document, change), 422)
    assert words in error["message"]
    assert "\n" not in error["message"]
    assert str(web.settings.data_dir) not in error["message"]
    assert web.get("/api/projects") == []
    assert web.get("/api/uploads") == []
    assert left_behind(web) == []


def test_a_damaged_or_hostile_project_file_leaves_nothing(first: tuple[Running, str], start: Callable[..., Any]) -> None:
    content = exported(first)
    found = members(content)
    link = zipfile.ZipInfo("recording/link")
    link.external_attr = (stat.S_IFLNK | 0o777) << 16
    linked = io.BytesIO(content)
    with zipfile.ZipFile(linked, "a") as opened:
        opened.writestr(link, "/etc/passwd")
    at = content.index(b"project.json") + 60  # within its compressed bytes
    flipped = bytearray(content)
    flipped[at] ^= 0xFF
    broken = archive(*{**found, "project.json": found["project.json"][:-40]}.items())
    unreadable = archive(*{**found, "recording/Old kitchen.r3d": archive(("unreadable", b"x"))}.items())
    nested = archive(*{**found, "recording/Old kitchen.r3d": archive(("../../x", b"x"))}.items())
    bomb = archive(*{**found, "recording/more": bytes(1 << 27)}.items())
    with start() as web:
        for hostile, words in (
            (archive(*found.items(), ("../../x", b"x")), "holds the path"),
            (linked.getvalue(), "link"),
            (bytes(flipped), "damaged"),
            (content[:-300], "cut short"),
            (broken, "not usable JSON"),
            (unreadable, "no frame can be read"),
            (nested, "holds the path"),
            (bomb, "times its size"),
        ):
            assert words in take_in(web, hostile, 422)["message"], words
            assert left_behind(web) == []
            assert web.get("/api/projects") == []
    with start(max_unpacked_bytes=1000) as web:
        assert "unpacks to" in take_in(web, content, 422)["message"]


def test_a_folder_recording_is_exported_as_a_zip(tmp_path: Path, first: tuple[Running, str], second: Running) -> None:
    folder = tmp_path / "My scan"
    for name in ("depth/0.png", "rgb/0.jpg"):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(name.encode() * 1000)
    project = second.post("/api/projects/import", {"path": str(folder)}, 202)["id"]
    second.until(lambda: second.get(f"/api/projects/{project}")["status"] == "ready")
    found = members(second.client.get(f"/media/{project}/project.zip?recording=true").content)
    assert members(found["recording/My scan.zip"]) == {
        "depth/0.png": b"depth/0.png" * 1000,
        "rgb/0.jpg": b"rgb/0.jpg" * 1000,
    }
    assert second.get(f"/api/projects/{project}/file")["recording_bytes"] == 20_000
    made = upload(second, archive(*found.items()), "x.zip")
    second.until(lambda: second.get(f"/api/projects/{made['id']}")["status"] == "ready")


def test_the_export_is_streamed_in_small_pieces(tmp_path: Path) -> None:
    large = tmp_path / "scan.r3d"
    with large.open("wb") as sparse:
        sparse.truncate(64 << 20)
    export = project_export.Export(file_name="x.zip", documents={"project.json": b"{}"}, meshes={}, recording=large)
    pieces = [len(piece) for piece in project_export.streamed(export)]
    assert sum(pieces) > 64 << 20
    assert max(pieces) < 2 << 20


def test_exporting_a_missing_recording_is_not_found_with_a_hint(tmp_path: Path, second: Running) -> None:
    project = upload(second, R3D)["id"]
    second.until(lambda: second.get(f"/api/projects/{project}")["status"] == "ready")
    (second.settings.data_dir / "projects" / project / "source" / "scan.r3d").unlink()
    assert second.get(f"/api/projects/{project}/file")["recording_bytes"] is None
    assert second.get(f"/media/{project}/project.zip?recording=true", 404)["hint"] == "export the project without it"
    assert second.client.get(f"/media/{project}/project.zip").status_code == 200


def test_people_without_access_cannot_export_a_project(first: tuple[Running, str], second: Running) -> None:
    made = take_in(second, exported(first))["id"]
    second.until(lambda: second.get(f"/api/projects/{made}")["status"] == "ready")
    assert second.client.put(f"/api/projects/{made}/members", json={"members_only": True, "members": []}).status_code == 200
    accounts.add(second.context.engine, "eve", "annotator", "three plain words")
    eve = TestClient(second.app, base_url=ORIGIN, headers={"X-Requested-With": "tests"})
    eve.post("/api/login", json={"name": "eve", "password": "three plain words"})
    for path in (f"/media/{made}/project.zip", f"/api/projects/{made}/file"):
        assert eve.get(path).status_code == 404
    own = eve.post("/api/projects/upload?filename=x.zip", content=exported(first))
    assert own.status_code == 202  # permission to upload suffices to import
    assert own.json()["review_state"] == "draft"


def test_an_interrupted_import_is_completed_by_a_retry(
    first: tuple[Running, str], second: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    content = exported(first)
    sent = second.post("/api/uploads", {"file_name": "Old kitchen.r3d", "size": len(content)}, 201)["id"]  # as its recording
    second.client.patch(f"/api/uploads/{sent}", content=content, headers={"Upload-Offset": "0"})
    with monkeypatch.context() as patch:
        patch.setattr(uploads.project_import, "_rows", lambda *_: 1 / 0)
        second.post(f"/api/uploads/{sent}/finish", status=500)
    assert second.post(f"/api/uploads/{sent}/finish", status=202)["id"] == sent
    second.until(lambda: second.get(f"/api/projects/{sent}")["status"] == "ready")


def test_a_different_recording_is_refused_by_its_frames() -> None:
    def table(*cameras: float, width: int = 160) -> list[dict[str, Any]]:
        return [{"index": k, "width": width, "height": 120, "camera": [x, 0.0, 1.5]} for k, x in enumerate(cameras)]

    ours = table(0.0, 0.5, 1.0)
    refuse_another("a.r3d", ours, table(3.0, 3.5, 4.0))  # the world frame may differ
    for theirs, words in (
        (table(0.0, 0.5), "3 frames, 2 or others expected"),
        (table(0.0, 0.5, 1.0, width=320), "160x120 pixels, 320x120 expected"),
        (table(0.0, 0.5, 1.2), "0.20 m away"),
    ):
        with pytest.raises(CaptureError, match=words):
            refuse_another("a.r3d", ours, theirs)
