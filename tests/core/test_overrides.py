import json
from pathlib import Path

import numpy as np
import pytest

from r2c2r_core.errors import OverrideError
from r2c2r_core.overrides import read_overrides


def write(tmp_path: Path, document: object) -> Path:
    path = tmp_path / "overrides.json"
    path.write_text(json.dumps(document))
    return path


def test_corrections_are_read(tmp_path: Path) -> None:
    entry = {"hinge": "left", "dimensions_m": [0.5, 0.6, 0.7], "joint_limits": [0, 1.5], "candidate": "c2"}
    overrides = read_overrides(write(tmp_path, {"version": 1, "objects": {"door": entry}, "scene": {"up": [0, 1, 0]}}))
    door = overrides.of("door")
    assert (door.hinge, door.candidate, door.joint_lower, door.joint_upper) == ("left", "c2", 0.0, 1.5)
    assert np.allclose(door.dimensions_m, [0.5, 0.6, 0.7])
    assert np.allclose(overrides.up_capture, [0, 1, 0])
    assert overrides.of("other").hinge is None


def test_a_mesh_file_is_found_beside_the_overrides(tmp_path: Path) -> None:
    (tmp_path / "mine.glb").write_bytes(b"x")
    overrides = read_overrides(write(tmp_path, {"objects": {"door": {"candidate": "mine.glb"}}}))
    assert overrides.of("door").candidate == str((tmp_path / "mine.glb").resolve())


@pytest.mark.parametrize(
    ("document", "says"),
    [
        ([], "not an overrides document"),
        ({"version": 7}, "version 1"),
        ({"objects": {"door": {"hinge": "middle"}}}, "door.hinge is 'middle'"),
        ({"objects": {"door": {"colour": 1}}}, "unknown key 'colour'"),
        ({"objects": {"door": {"dimensions_m": [1, 2]}}}, "three numbers"),
        ({"objects": {"door": {"dimensions_m": [1, 2, -1]}}}, "positive"),
        ({"objects": {"door": {"joint_limits": [2, 1]}}}, "lower, upper"),
        ({"objects": {"door": {"pose": [[1]]}}}, "4x4"),
        ({"objects": {"door": {"pose": [[0] * 4] * 4}}}, "rigidly"),
        ({"objects": {"door": {"pose": [[float("nan")] * 4] * 4}}}, "4x4"),
        ({"objects": {"door": {"pose": "upside down"}}}, "4x4"),
        ({"objects": {"door": {"pose": [[1], [1, 2], 3, 4]}}}, "4x4"),
        ({"objects": {"door": {"front": ["a", 0, 0]}}}, "three numbers"),
        ({"objects": {"door": {"joint_limits": [0, "far"]}}}, "lower, upper"),
        ({"scene": {"floor": "low"}}, "scene.floor is 'low'"),
        ({"scene": {"manhattan_yaw": [1]}}, "scene.manhattan_yaw"),
        ({"scene": {"gravity": 1}}, "unknown key 'gravity'"),
        ({"scene": {"walls": [[0, 1]]}}, "scene.walls"),
    ],
)
def test_what_cannot_be_used_is_one_clear_line(tmp_path: Path, document: object, says: str) -> None:
    with pytest.raises(OverrideError, match=says) as caught:
        read_overrides(write(tmp_path, document))
    assert "\n" not in str(caught.value)
    assert str(tmp_path) in str(caught.value)
