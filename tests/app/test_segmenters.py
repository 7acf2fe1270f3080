"""Choice of the segmenter that draws the masks."""

from pathlib import Path
from typing import Any

import pytest

from app.db.engine import writing
from app.db.tables import Upload
from tests.app.conftest import Running

CLICK = {"frame": 3, "x": 80.5, "y": 60.5, "label": 1}


@pytest.fixture
def sam2(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Weights that look installed as long as they are not loaded."""
    folder = tmp_path / "weights"
    folder.mkdir()
    (folder / "config.json").write_text("{}")
    (folder / "model.safetensors").write_bytes(b"")
    monkeypatch.setenv("R2C2R_SAM2_WEIGHTS", str(folder))
    return folder


@pytest.fixture(autouse=True)
def no_weights(torch_found: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HF_HUB_CACHE", str(tmp_path / "empty"))


def choose(web: Running, project: str, segmenter: str, status: int = 200) -> Any:
    return web.patch(f"/api/projects/{project}", {"segmenter": segmenter}, status)


def test_segmenters_are_listed_with_licence_and_reason_if_unavailable(web: Running) -> None:
    listed = {entry["name"]: entry for entry in web.get("/api/system")["segmenters"]}
    assert next(iter(listed)) == "geometric"
    assert listed["geometric"]["available"]
    assert (listed["sam3"]["licence_class"], listed["sam3"]["available"]) == ("restricted", False)
    assert "accept the licence" in listed["sam3"]["reason"]
    assert "hf download facebook/sam2.1-hiera-tiny" in listed["sam2"]["reason"]


def test_a_segmenter_without_weights_is_refused_with_a_hint(web: Running) -> None:
    project = web.sample()
    refused = choose(web, project, "sam2", 503)
    assert refused["kind"] == "backend-unavailable"
    assert "hf download" in refused["hint"]
    assert choose(web, project, "magic", 422)["kind"] == "input"
    assert web.get(f"/api/projects/{project}")["segmenter"] == "geometric"


def test_the_chosen_segmenter_recomputes_masks_that_name_their_backend(web: Running, sam2: Path) -> None:
    project = web.sample()
    made = web.post(f"/api/projects/{project}/objects", {"category": "drawer", "points": [CLICK]}, 201)["id"]

    def drawn_by() -> str:
        objects = {item["id"]: item for item in web.get(f"/api/projects/{project}/objects")}
        return str(objects[made]["mask_backend"]) if objects[made]["segment"] == "done" else ""

    web.until(lambda: drawn_by() == "geometric")
    assert choose(web, project, "sam2")["segmenter"] == "sam2"
    web.until(lambda: drawn_by() == "sam2")
    work = next(web.settings.data_dir.rglob("live_options.txt"))
    assert "--segmenter sam2" in work.read_text()
    work.unlink()
    choose(web, project, "geometric")
    assert drawn_by() == "geometric"  # stored: not computed again
    assert [entry["action"] for entry in web.get(f"/api/projects/{project}/history")][:2] == ["segmenter", "segmenter"]


def test_the_database_is_not_locked_while_a_live_process_is_closed(
    web: Running, sam2: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    project = web.sample()
    ended = []

    def close(of: str) -> None:
        with writing(web.context.engine) as session:  # would wait for a surrounding open transaction
            session.add(Upload(id=of, file_name="a", size=1, who="x", created=0.0))
        ended.append(of)

    monkeypatch.setattr(web.context.live, "close", close)
    assert choose(web, project, "sam2")["segmenter"] == "sam2"
    assert ended == [project]


def test_a_run_uses_the_segmenter_of_the_project(web: Running, sam2: Path) -> None:
    project = web.sample()
    choose(web, project, "sam2")
    request = web.post(f"/api/projects/{project}/run", {}, 202)
    web.job(request["id"], "done")
    written = next(web.settings.data_dir.rglob("request.json")).read_text()
    assert '"segmenter": "sam2"' in written


def test_choosing_another_segmenter_makes_the_result_stale(web: Running, sam2: Path) -> None:
    project = web.sample()
    web.job(web.post(f"/api/projects/{project}/run", {}, 202)["id"], "done")
    assert web.get(f"/api/projects/{project}")["result"] == "current"
    choose(web, project, "sam2")
    assert web.get(f"/api/projects/{project}")["result"] == "stale"
