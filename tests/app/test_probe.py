"""The real look at a mesh, in its own process: what a run would refuse is refused at once, in the sender's words."""

import json
import subprocess
from pathlib import Path

import numpy as np
import pytest
import trimesh

from app.process import python_module


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("box", ""),
        ("flat", "kettle.glb: the mesh is flat"),
        ("noise", "kettle.glb: not a readable GLB mesh"),
    ],
)
def test_a_mesh_is_refused_when_no_candidate_can_be_made_of_it(tmp_path: Path, content: str, words: str) -> None:
    file = tmp_path / "a1b2.glb"
    size = [1.0, 0.6, 0.4 if content == "box" else 0.0]
    made = trimesh.creation.box(size).export(file_type="glb")
    file.write_bytes(np.random.default_rng(0).bytes(900) if content == "noise" else bytes(made))
    asked = [*python_module("app.jobs.probe"), "mesh", str(file), "kettle.glb"]
    said = subprocess.run(asked, cwd=Path(__file__).parents[2], capture_output=True, text=True, check=False)
    last = json.loads(said.stdout.splitlines()[-1])
    assert last.get("error", {"message": ""})["message"].startswith(words)
    assert ("done" in last) == (words == "")
    assert str(tmp_path) not in said.stdout
