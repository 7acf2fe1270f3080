"""Real file probe in its own process: files that a run would refuse are refused at once, by the sender's file name."""

import base64
import json
import shutil
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest
import trimesh

from app.jobs.plans import Commands
from app.process import Worker
from tests.core.ingest.tiny import TinyRoom
from tests.core.ingest.tiny_formats import write_stray
from tests.waiting import PATIENCE_S

PROBE = Commands().probe


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("box", ""),
        ("flat", "kettle.glb: the mesh is flat"),
        ("noise", "kettle.glb: not a readable GLB mesh"),
    ],
)
def test_the_probe_refuses_a_mesh_that_cannot_become_a_candidate(tmp_path: Path, content: str, words: str) -> None:
    file = tmp_path / "a1b2.glb"
    size = [1.0, 0.6, 0.4 if content == "box" else 0.0]
    made = trimesh.creation.box(size).export(file_type="glb")
    file.write_bytes(np.random.default_rng(0).bytes(900) if content == "noise" else bytes(made))
    asked = [*PROBE, "mesh", str(file), "kettle.glb"]
    said = subprocess.run(asked, cwd=Path(__file__).parents[2], capture_output=True, text=True, check=False)
    last = json.loads(said.stdout.splitlines()[-1])
    assert last.get("error", {"message": ""})["message"].startswith(words)
    assert ("done" in last) == (words == "")
    if words == "":
        seen = json.loads(said.stdout.splitlines()[0])["seen"]
        assert seen["size"] == pytest.approx([1.0, 0.6, 0.4])
        assert (seen["triangles"], seen["notes"]) == (12, ["it has no colours: shown grey"])
        drawn = cv2.imdecode(np.frombuffer(base64.b64decode(seen["picture"]), np.uint8), cv2.IMREAD_UNCHANGED)
        rows, columns = np.nonzero(drawn[..., 3])
        assert np.ptp(columns) > np.ptp(rows) > 50  # as wide as it is long, and upright by glTF's convention
    assert str(tmp_path) not in said.stdout


@pytest.mark.parametrize("forged", [True, False], ids=["forged", "whole"])
def test_a_video_that_refers_to_a_file_of_the_server_is_refused(tmp_path: Path, forged: bool) -> None:
    folder = write_stray(tmp_path / "scan", TinyRoom(count=3))
    shutil.copy(folder / "rgb.mp4", tmp_path / "secret.mp4")
    if forged:
        (folder / "rgb.mp4").write_bytes(b"ffconcat version 1.0\nfile secret.mp4\n")
    sent = Path(shutil.make_archive(str(tmp_path / "a1b2"), "zip", tmp_path, "scan"))
    said = subprocess.run(
        [*PROBE, "recording", str(sent), "scan.zip"], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    last = json.loads(said.stdout.splitlines()[-1])
    assert ("done" in last) == (not forged), last
    assert not forged or "an MP4 was expected" in last["error"]["message"]


def test_probe_and_ingest_start_in_an_isolated_process() -> None:
    commands = Commands()
    assert [command[1:3] for command in (commands.probe, commands.ingest)] == [("-m", "r2c2r_core.alone")] * 2


def test_the_temporary_folder_of_a_killed_worker_is_deleted(tmp_path: Path) -> None:
    leaves = "import json, tempfile, time; print(json.dumps({'at': tempfile.mkdtemp()}), flush=True); time.sleep(600)"
    worker = Worker((sys.executable, "-c", leaves), tmp_path / "log")
    try:
        line = worker.next_line(timeout=PATIENCE_S)
        assert line is not None
        assert Path(line["at"]).is_dir()
    finally:
        worker.close()
    assert not Path(line["at"]).parent.exists()
