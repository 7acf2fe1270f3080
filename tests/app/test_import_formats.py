"""Every recording format imported by the app, zipped as an upload and as a folder on this machine."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from app.jobs.ingest import ingest
from app.jobs.plans import Commands
from r2c2r_core.progress import SILENT
from tests.core.ingest.test_readers import WRITERS
from tests.core.ingest.tiny import TinyRoom, zip_folder

ROOM = replace(TinyRoom(), count=4)


QUICK = ("r3d", "tum")  # `r2c2r info` reads the others: tests/core/test_info_formats.py and test_readers.py


@pytest.mark.parametrize("kind", [kind if kind in QUICK else pytest.param(kind, marks=pytest.mark.slow) for kind in WRITERS])
def test_the_import_job_reads_a_zip_of_any_format(kind: str, tmp_path: Path) -> None:
    zipped = zip_folder(WRITERS[kind](tmp_path / "made", ROOM), tmp_path / "scan.zip", top="from my phone/scan/")
    work, folder = tmp_path / "work", tmp_path / "project"
    work.mkdir()
    (tmp_path / "prompts.json").write_text(json.dumps({"version": 1, "objects": []}))
    request = tmp_path / "request.json"
    request.write_text(json.dumps({"source": str(zipped)}))
    ingest(work, folder, request, SILENT)
    facts = json.loads((folder / "facts.json").read_text())["facts"]
    assert (facts["frame_count"], facts["width"], facts["height"]) == (4, *ROOM.rgb_size)
    assert len(json.loads((folder / "frames.json").read_text())) == 4


@pytest.mark.slow
@pytest.mark.parametrize("zipped", [True, False])
def test_a_stray_scanner_recording_becomes_a_project(zipped: bool, start: Callable[..., Any], tmp_path: Path) -> None:
    scan = WRITERS["stray"](tmp_path / "data" / "recordings" / "scan", TinyRoom())
    with start(commands=Commands()) as web:
        if zipped:
            content = zip_folder(scan, tmp_path / "scan.zip", top="scan/").read_bytes()
            project = web.post("/api/projects/upload?filename=scan.zip", status=202, content=content)
        else:
            project = web.post("/api/projects/import", {"path": str(scan)}, 202)
        web.until(lambda: web.get(f"/api/projects/{project['id']}")["status"] != "importing")
        found = web.get(f"/api/projects/{project['id']}")
        assert found["status"] == "ready", found["error"]
        assert found["capture"]["format"] == "Stray Scanner"
        frame = web.get(f"/api/projects/{project['id']}/frames")[5]["index"]
        picture = web.client.get(f"/media/{project['id']}/frames/{frame}.jpg")
        assert picture.headers["content-type"] == "image/jpeg"
