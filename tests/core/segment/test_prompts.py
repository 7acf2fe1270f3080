import json
from pathlib import Path
from typing import Any

import pytest

from r2c2r_core.errors import PromptError
from r2c2r_core.model.capture import Capture
from r2c2r_core.model.inputs import DrawnHandle, PromptPoint, Prompts
from r2c2r_core.segment.prompts import check_prompts, read_prompts
from tests.core.segment.conftest import Truth
from tests.core.segment.scenes import prompt

POINT = {"frame": 60, "x": 100.0, "y": 50.5, "label": 1}
OBJECT: dict[str, Any] = {"name": "drawer_1", "category": "drawer", "points": [POINT]}


CORNERS = [[0.0, 0.0, 0.8], [0.6, 0.0, 0.8], [0.6, 0.0, 0.1], [0.0, 0.0, 0.1]]
SLANTED = [[0.0, 0.0, 0.8], [0.6, 0.0, 0.9], [0.6, 0.0, 0.1], [0.0, 0.0, 0.1]]
HANDLE = {"left_m": -0.1, "bottom_m": 0.2, "right_m": 0.1, "top_m": 0.22}
FRONT: dict[str, Any] = {"corners_m": CORNERS, "handle": HANDLE, "hinge": "left"}


def written(tmp_path: Path, document: Any) -> Path:
    path = tmp_path / "prompts.json"
    path.write_text(document if isinstance(document, str) else json.dumps(document))
    return path


def test_a_valid_prompt_file_is_read(tmp_path: Path) -> None:
    prompts = read_prompts(written(tmp_path, {"version": 1, "objects": [OBJECT]}))
    assert prompts.objects[0].name == "drawer_1"
    assert prompts.objects[0].points == (PromptPoint(frame=60, x=100.0, y=50.5, label=1),)


def test_a_drawn_front_needs_no_click(tmp_path: Path) -> None:
    document = {"version": 2, "objects": [{"name": "a", "category": "cabinet", "points": [], "front": FRONT}]}
    drawn = read_prompts(written(tmp_path, document)).objects[0].front
    assert drawn is not None
    assert drawn.corners_capture[2] == (0.6, 0.0, 0.1)
    assert drawn.handle == DrawnHandle(**HANDLE)
    assert drawn.hinge == "left"


@pytest.mark.parametrize(
    ("document", "message"),
    [
        ("{", "not usable JSON: line 1, column 2"),
        ([], "the document is []"),
        ({"objects": []}, "the document lacks 'version'; expected 1"),
        ({"version": 4, "objects": []}, "version is 4; expected 1, 2 where"),
        (
            {"version": 1, "objects": [{**OBJECT, "front": FRONT}]},
            "a drawn front of 'drawer_1' found in version 1, version 2 expected",
        ),
        (
            {"version": 2, "objects": [{**OBJECT, "front": {**FRONT, "corners_m": SLANTED}}]},
            "objects.drawer_1.front: corners of no rectangle found",
        ),
        (
            {"version": 2, "objects": [{**OBJECT, "front": {"corners_m": [[0.0, 0.0, 0.0]] * 4}}]},
            "a front of 0.000 by 0.000 m found, sides of 0.02 to 10 m expected",
        ),
        ({"version": 2, "objects": [{**OBJECT, "front": {**FRONT, "hinge": "middle"}}]}, "front.hinge is 'middle'"),
        ({"version": 2, "objects": [{**OBJECT, "front": {**FRONT, "handle": "bar"}}]}, "front.handle is 'bar'"),
        ({"version": True, "objects": []}, "version: found True; expected 1"),
        ({"version": 1, "objects": [], "notes": ""}, "unknown key 'notes' in the document; expected version, objects"),
        ({"version": 1, "objects": {}}, "objects is {}; expected a list of objects"),
        ({"version": 1, "objects": [{**OBJECT, "colour": "red"}]}, "unknown key 'colour' in objects.drawer_1"),
        ({"version": 1, "objects": [{**OBJECT, "name": 3}]}, "objects[0].name is 3; expected 1 to 60 letters"),
        ({"version": 1, "objects": [{**OBJECT, "name": "oven door"}]}, "objects[0].name is 'oven door'"),
        ({"version": 1, "objects": [{**OBJECT, "name": "n" * 61}]}, "expected 1 to 60 letters"),
        ({"version": 1, "objects": [{**OBJECT, "category": "a\x1bb"}]}, "a control character"),
        ({"version": 1, "objects": [OBJECT, OBJECT]}, "two objects named 'drawer_1'"),
        (
            {"version": 1, "objects": [{**OBJECT, "points": [{**POINT, "frame": 1.5}]}]},
            "points[0].frame is 1.5; expected a whole",
        ),
        (
            {"version": 1, "objects": [{**OBJECT, "points": [{**POINT, "frame": -1}]}]},
            "points[0].frame is -1; expected a whole",
        ),
        (
            {"version": 1, "objects": [{**OBJECT, "points": [{**POINT, "x": "10"}]}]},
            "drawer_1.points[0].x is '10'; expected a number",
        ),
        (
            {"version": 1, "objects": [{**OBJECT, "points": [{**POINT, "y": 1e9}]}]},
            "drawer_1.points[0].y is 1000000000.0; expected",
        ),
        ({"version": 1, "objects": [{**OBJECT, "points": [{**POINT, "label": 2}]}]}, "label is 2; expected 0 or 1"),
        ({"version": 1, "objects": [{**OBJECT, "points": [{**POINT, "label": True}]}]}, "label: found True; expected 0 or 1"),
        (r'{"version": 1, "objects": [{"name": "a", "category": "\ud800", "points": []}]}', "surrogate"),
    ],
)
def test_invalid_prompt_files_are_rejected_with_a_one_line_message(tmp_path: Path, document: Any, message: str) -> None:
    with pytest.raises(PromptError) as caught:
        read_prompts(written(tmp_path, document))
    assert message in str(caught.value)
    assert "prompts.json" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_missing_prompt_file_is_rejected(tmp_path: Path) -> None:
    with pytest.raises(PromptError, match="no such file"):
        read_prompts(tmp_path / "none.json")


@pytest.mark.parametrize(
    ("point", "message"),
    [
        (PromptPoint(frame=60, x=480.0, y=10.0, label=1), r"drawer: click at \(480, 10\) on frame 60 found, 0 <= x < 480"),
        (PromptPoint(frame=60, x=10.0, y=-1.0, label=1), "0 <= y < 360 expected"),
        (
            PromptPoint(frame=61, x=10.0, y=10.0, label=1),
            r"click on frame 61 found, one of the \d+ frames kept expected; the nearest frame is 60; others were damaged",
        ),
        (
            PromptPoint(frame=140, x=10.0, y=10.0, label=1),
            r"click on frame 140 found, a frame of 0\.\.130 expected; the nearest frame is 130$",
        ),
        (PromptPoint(frame=60, x=10.0, y=10.0, label=0), "drawer: 1 clicks off it found"),
    ],
)
def test_clicks_outside_the_capture_are_rejected(boxes: tuple[Capture, Truth], point: PromptPoint, message: str) -> None:
    with pytest.raises(PromptError, match=message):
        check_prompts(boxes[0], Prompts(objects=(prompt("drawer", "drawer", point),)))


def test_missing_objects_and_duplicate_names_are_rejected(boxes: tuple[Capture, Truth]) -> None:
    with pytest.raises(PromptError, match="no objects found"):
        check_prompts(boxes[0], Prompts(objects=()))
    twice = prompt("drawer", "drawer", PromptPoint(frame=60, x=10.0, y=10.0, label=1))
    with pytest.raises(PromptError, match="two objects named 'drawer'"):
        check_prompts(boxes[0], Prompts(objects=(twice, twice)))


def test_a_name_with_a_leading_digit_is_rejected_with_a_valid_suggestion(boxes: tuple[Capture, Truth]) -> None:
    numbered = prompt("2_door_cabinet_1", "cabinet", PromptPoint(frame=60, x=10.0, y=10.0, label=1))
    with pytest.raises(PromptError, match="begins with a digit") as caught:
        check_prompts(boxes[0], Prompts(objects=(numbered,)))
    assert "item_2_door_cabinet_1" in caught.value.hint


@pytest.mark.parametrize(
    ("names", "words"), [(("Con",), "device name on Windows"), (("door_1", "Door_1"), "two objects named")]
)
def test_reserved_names_and_names_that_differ_only_in_case_are_rejected(
    boxes: tuple[Capture, Truth], names: tuple[str, ...], words: str
) -> None:
    point = PromptPoint(frame=60, x=10.0, y=10.0, label=1)
    with pytest.raises(PromptError, match=words):
        check_prompts(boxes[0], Prompts(objects=tuple(prompt(name, "cabinet", point) for name in names)))
