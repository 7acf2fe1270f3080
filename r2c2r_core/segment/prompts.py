"""prompts.json, and what must hold before anything is computed from clicks."""

import json
import math
import re
from pathlib import Path
from typing import Any, Literal

from r2c2r_core.errors import PromptError
from r2c2r_core.model.capture import Capture
from r2c2r_core.model.inputs import ObjectPrompt, PromptPoint, Prompts

_NAME = re.compile(r"[A-Za-z0-9_]+")
_VERSION = 1


def read_prompts(path: Path) -> Prompts:
    """prompts.json, strictly: unknown keys, wrong types and repeated names are refused in one line."""
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise PromptError(f"{path}: no such file", hint="give a prompts.json with one entry an object") from None
    except (OSError, UnicodeDecodeError) as error:
        raise PromptError(f"{path}: cannot be read ({error})", hint="give a UTF-8 JSON file") from error
    except json.JSONDecodeError as error:
        raise PromptError(f"{path}: not JSON (line {error.lineno}: {error.msg})", hint="see `r2c2r sample` for one") from error
    try:
        prompts = parse_prompts(document)
    except PromptError as error:
        raise PromptError(f"{path}: {error.message}", hint=error.hint) from error
    return prompts


def parse_prompts(document: Any) -> Prompts:
    """The same, from a decoded JSON document."""
    fields = _fields(document, {"version", "objects"}, "the document")
    if fields["version"] != _VERSION or isinstance(fields["version"], bool):
        raise PromptError(
            f"version {fields['version']!r} found, {_VERSION} expected", hint="write the file in the current format"
        )
    if not isinstance(fields["objects"], list):
        raise PromptError(f"objects is {_kind(fields['objects'])}, a list expected", hint='write "objects": [{…}]')
    objects = tuple(_object(entry, position) for position, entry in enumerate(fields["objects"]))
    _check_names(objects)
    return Prompts(objects=objects)


def check_prompts(capture: Capture, prompts: Prompts) -> None:
    """Raise PromptError for the first prompt that the capture cannot serve."""
    if not prompts.objects:
        raise PromptError("no objects found, at least one expected", hint="click an object first")
    _check_names(prompts.objects)
    for prompt in prompts.objects:
        check_prompt(capture, prompt)


def check_prompt(capture: Capture, prompt: ObjectPrompt) -> None:
    """Raise PromptError unless the clicks of one object lie on the capture's images and one of them is positive."""
    _check_name(prompt.name)
    if not prompt.category.strip():
        raise PromptError(f"{prompt.name}: empty category found, a word such as drawer expected", hint="name its category")
    if not any(point.label == 1 for point in prompt.points):
        found = f"{len(prompt.points)} clicks off it" if prompt.points else "no clicks"
        raise PromptError(f"{prompt.name}: {found} found, at least one click on it expected", hint="click on the object")
    frames = {frame.index: frame for frame in capture.frames}
    for point in prompt.points:
        if point.frame not in frames:
            numbers = sorted(frames)
            raise PromptError(
                f"{prompt.name}: click on frame {point.frame} found, a frame of {numbers[0]}..{numbers[-1]} expected",
                hint=f"the nearest frame is {min(numbers, key=lambda number: abs(number - point.frame))}",
            )
        camera = frames[point.frame].rgb_camera
        if not (0 <= point.x < camera.width and 0 <= point.y < camera.height):
            raise PromptError(
                f"{prompt.name}: click at ({point.x:g}, {point.y:g}) on frame {point.frame} found, "
                f"0 <= x < {camera.width} and 0 <= y < {camera.height} expected",
                hint="click inside the image",
            )


def _object(entry: Any, position: int) -> ObjectPrompt:
    where = f"object {position + 1}"
    fields = _fields(entry, {"name", "category", "points"}, where)
    name, category, points = fields["name"], fields["category"], fields["points"]
    if not isinstance(name, str):
        raise PromptError(f"{where}: name is {_kind(name)}, text expected", hint='write "name": "drawer_1"')
    if not isinstance(category, str):
        raise PromptError(f"{name}: category is {_kind(category)}, text expected", hint='write "category": "drawer"')
    if not isinstance(points, list):
        raise PromptError(f"{name}: points is {_kind(points)}, a list expected", hint='write "points": [{…}]')
    return ObjectPrompt(name=name, category=category, points=tuple(_point(point, name) for point in points))


def _point(entry: Any, name: str) -> PromptPoint:
    fields = _fields(entry, {"frame", "x", "y", "label"}, f"{name}: a point")
    frame, label = fields["frame"], fields["label"]
    if not isinstance(frame, int) or isinstance(frame, bool):
        raise PromptError(
            f"{name}: frame is {frame!r}, a whole number expected", hint="give the frame's number in the recording"
        )
    if label not in (0, 1) or isinstance(label, bool | float):
        raise PromptError(f"{name}: label is {label!r}, 0 or 1 expected", hint="1 is on the object, 0 off it")
    checked: Literal[0, 1] = 1 if label == 1 else 0
    return PromptPoint(frame=frame, x=_number(fields["x"], f"{name}: x"), y=_number(fields["y"], f"{name}: y"), label=checked)


def _number(value: Any, where: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise PromptError(f"{where} is {value!r}, a number expected", hint="give pixels of the stored RGB frame")
    return float(value)


def _fields(entry: Any, expected: set[str], where: str) -> dict[str, Any]:
    if not isinstance(entry, dict):
        raise PromptError(
            f"{where} is {_kind(entry)}, an object with {', '.join(sorted(expected))} expected", hint="see `r2c2r sample`"
        )
    unknown, missing = sorted(set(entry) - expected), sorted(expected - set(entry))
    if unknown:
        raise PromptError(f"{where} has the unknown key '{unknown[0]}'", hint=f"known keys: {', '.join(sorted(expected))}")
    if missing:
        raise PromptError(f"{where} lacks '{missing[0]}'", hint=f"expected keys: {', '.join(sorted(expected))}")
    return entry


def _check_names(objects: tuple[ObjectPrompt, ...]) -> None:
    seen: set[str] = set()
    for prompt in objects:
        _check_name(prompt.name)
        if prompt.name in seen:
            raise PromptError(f"two objects named '{prompt.name}' found, unique names expected", hint="rename one of them")
        seen.add(prompt.name)


def _check_name(name: str) -> None:
    if not _NAME.fullmatch(name):
        raise PromptError(f"name '{name}' found, letters, digits and underscores expected", hint="simulators accept no more")


def _kind(value: Any) -> str:
    return {dict: "an object", list: "a list", str: "text", bool: "a truth value", type(None): "null"}.get(
        type(value), "a number"
    )
