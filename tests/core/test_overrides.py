import json
from pathlib import Path

import numpy as np
import pytest

from r2c2r_core.errors import OverrideError
from r2c2r_core.model.inputs import DrawnFront, ObjectOverride, ObjectPrompt, Overrides, Prompts
from r2c2r_core.overrides import read_overrides, unused_corrections, with_drawn_hinges


def write(tmp_path: Path, document: object) -> Path:
    path = tmp_path / "overrides.json"
    path.write_text(json.dumps(document))
    return path


def test_overrides_of_objects_and_scene_are_read(tmp_path: Path) -> None:
    entry = {"hinge": "left", "dimensions_m": [0.5, 0.6, 0.7], "joint_limits": [0, 1.5], "candidate": "c2"}
    overrides = read_overrides(write(tmp_path, {"version": 1, "objects": {"door": entry}, "scene": {"up": [0, 1, 0]}}))
    door = overrides.of("door")
    assert (door.hinge, door.candidate, door.joint_lower, door.joint_upper) == ("left", "c2", 0.0, 1.5)
    assert np.allclose(door.dimensions_m, [0.5, 0.6, 0.7])
    assert np.allclose(overrides.up_capture, [0, 1, 0])
    assert overrides.of("other").hinge is None


def test_marked_joint_states_are_read_by_joint_and_frame(tmp_path: Path) -> None:
    marks = {"left_door": [{"frame": 12, "state": 0.0}, {"frame": 40, "state": 1.25}]}
    overrides = read_overrides(write(tmp_path, {"objects": {"pair": {"states": marks}}}))
    assert overrides.of("pair").states == {"left_door": {12: 0.0, 40: 1.25}}


def test_a_mesh_file_is_resolved_relative_to_the_overrides_file(tmp_path: Path) -> None:
    (tmp_path / "mine.glb").write_bytes(b"x")
    overrides = read_overrides(write(tmp_path, {"objects": {"door": {"candidate": "mine.glb"}}}))
    assert overrides.of("door").candidate == str((tmp_path / "mine.glb").resolve())


@pytest.mark.parametrize(
    ("document", "says"),
    [
        ([], r"the document is \[\]"),
        ({"version": 7}, "version is 7; expected 1"),
        ({"objects": {"door": {"hinge": "middle"}}}, "door.hinge is 'middle'"),
        ({"objects": {"door": {"paint": 1}}}, "unknown key 'paint'"),
        ({"objects": {"door": {"dimensions_m": [1, 2]}}}, "three numbers"),
        ({"objects": {"door": {"dimensions_m": [1, 2, -1]}}}, "positive"),
        (
            {"objects": {"door": {"joint_limits": [0.3, 1.2]}}},
            r"door.joint_limits: \[0.3, 1.2\] does not open from 0, the closed",
        ),
        ({"objects": {"door": {"joint_limits": [-1.57, 0]}}}, "does not open from 0"),
        ({"objects": {"door": {"joint_limits": [None, 0]}}}, "does not open from 0"),
        ({"objects": {"door": {"states": {"door": [{"frame": 1, "state": -0.1}]}}}}, "state is -0.1"),
        ({"objects": {"door": {"pose": [[1]]}}}, "4x4"),
        ({"objects": {"door": {"pose": [[0] * 4] * 4}}}, "rigidly"),
        ({"objects": {"door": {"pose": [[float("nan")] * 4] * 4}}}, "NaN"),
        ({"objects": {"door": {"pose": [[1, 0, 0, 1e12], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]}}}, "within 1000 m"),
        ({"objects": {"door": {"dimensions_m": [1e9, 1e9, 1e9]}}}, r"door.dimensions_m\[0\] is 1000000000.0; .* at most 10"),
        ({"objects": {"door": {"joint_limits": [0, 1e9]}}}, "0, upper"),
        ({"objects": {"door": {"joints": {"left_door": [2, 1]}}}}, r"joints.left_door: \[2.0, 1.0\] does not open from 0"),
        ({"objects": {"door": {"candidate": 5}}}, "door.candidate is 5; expected a candidate's id"),
        ({"objects": {"door": {"candidate": ["c1"]}}}, "door.candidate is"),
        ({"objects": {"door": {"rejected": 5}}}, "door.rejected is 5"),
        ({"objects": {"door": {"rejected": [None]}}}, r"door.rejected\[0\] is null"),
        ({"objects": {"door": {"regenerate": 10**15}}}, "door.regenerate is"),
        ({"scene": {"up": [0, 0, 0]}}, "scene.up: a direction of no length"),
        ({"objects": [5]}, "an entry of objects has no name"),
        ({"objects": [{"name": {}}]}, "an entry of objects has no name"),
        ({"objects": [{"name": "door"}, {"name": "door"}]}, "the same name"),
        ({"scene": 5}, "scene is 5"),
        ({"scene": {"walls": [[0, 0, 1]]}}, "a wall without a normal"),
        ({"objects": {"door": {"pose": "upside down"}}}, "4x4"),
        ({"objects": {"door": {"pose": [[1], [1, 2], 3, 4]}}}, "4x4"),
        ({"objects": {"door": {"front": [0, -1, 0]}}}, "unknown key 'front'"),
        ({"scene": {"up": ["a", 0, 0]}}, "three numbers"),
        ({"objects": {"door": {"joint_limits": [0, "far"]}}}, "0, upper"),
        ({"scene": {"floor": "low"}}, "scene.floor is 'low'"),
        ({"scene": {"manhattan_yaw": [1]}}, "scene.manhattan_yaw"),
        ({"scene": {"gravity": 1}}, "unknown key 'gravity'"),
        ({"scene": {"walls": [[0, 1]]}}, "scene.walls"),
    ],
)
def test_invalid_overrides_raise_a_one_line_error(tmp_path: Path, document: object, says: str) -> None:
    with pytest.raises(OverrideError, match=says) as caught:
        read_overrides(write(tmp_path, document))
    assert "\n" not in str(caught.value)
    assert str(tmp_path) in str(caught.value)


def test_joint_limits_can_be_per_joint_and_open_ended(tmp_path: Path) -> None:
    entry = {"joint_limits": [0, None], "joints": {"left_door": [None, 1.2]}}
    door = read_overrides(write(tmp_path, {"objects": {"door": entry}})).of("door")
    assert (door.joint_lower, door.joint_upper) == (0.0, None)
    assert door.joints == {"left_door": (None, 1.2)}


def test_objects_can_be_given_as_a_list(tmp_path: Path) -> None:
    overrides = read_overrides(write(tmp_path, {"objects": [{"name": "door", "hinge": "left"}]}))
    assert overrides.of("door").hinge == "left"


def test_a_drawn_hinge_is_used_unless_overridden() -> None:
    corners = ((0.0, 0.0, 0.8), (0.6, 0.0, 0.8), (0.6, 0.0, 0.1), (0.0, 0.0, 0.1))
    drawn = [
        ObjectPrompt(name=name, category="cabinet", points=(), front=DrawnFront(corners_capture=corners, hinge=side))
        for name, side in (("a", "left"), ("b", "left"), ("c", None))
    ]
    said = Overrides(objects={"b": ObjectOverride(hinge="right")})
    both = with_drawn_hinges(said, Prompts(objects=tuple(drawn)))
    assert {name: entry.hinge for name, entry in both.objects.items()} == {"a": "left", "b": "right"}


def test_a_correction_of_an_object_without_prompts_is_reported() -> None:
    overrides = Overrides(objects={"cabinet_1": ObjectOverride(), "cabinent_2": ObjectOverride()})
    clicked = Prompts(objects=(ObjectPrompt(name="cabinet_1", category="cabinet", points=()),))
    (line,) = unused_corrections(overrides, clicked)
    assert "cabinent_2" in line
