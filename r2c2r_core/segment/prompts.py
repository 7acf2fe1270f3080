"""Reading of prompts.json, and checks of prompts before any computation."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

from r2c2r_core.documents import read_json
from r2c2r_core.errors import PromptError
from r2c2r_core.geometry.masks import PackedMask
from r2c2r_core.kitchen.names import category_of
from r2c2r_core.model.capture import Capture
from r2c2r_core.model.inputs import ObjectPrompt, Prompts
from r2c2r_core.schema.document import checked
from r2c2r_core.schema.prompts import PromptsFile, PromptsFileMask
from r2c2r_core.texts import identifier, name_fault

_NAME = re.compile(r"[A-Za-z0-9_]+")
_HINT = "see `r2c2r sample` for one"


def read_prompts(path: Path) -> Prompts:
    """Prompts from prompts.json, strictly (`r2c2r schema prompts` describes it): errors are reported in one line."""
    return parse_prompts(read_json(path, PromptError, hint=_HINT), str(path))


def parse_prompts(document: Any, where: str = "prompts") -> Prompts:
    """Prompts from a decoded JSON document that `where` names."""
    return checked_prompts(document, where).prompts()


def checked_prompts(document: Any, where: str = "prompts") -> PromptsFile:
    """Validated document in its file form, with nothing unpacked."""
    return checked(PromptsFile, document, where, PromptError, hint=_HINT)


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
    if prompt.front is not None and category_of(prompt.category).kind == "thing":
        raise PromptError(
            f"{prompt.name}: a front drawn of a '{prompt.category}' found, a furniture front or an appliance expected",
            hint="correct its category",
        )
    if prompt.crop is not None and category_of(prompt.category).kind != "thing":
        raise PromptError(
            f"{prompt.name}: a crop box of a '{prompt.category}' found, of a thing expected",
            hint="correct its category, or delete the box",
        )
    if prompt.front is None and not any(point.label == 1 for point in prompt.points):
        found = f"{len(prompt.points)} clicks off it" if prompt.points else "no clicks"
        raise PromptError(
            f"{prompt.name}: {found} found, at least one click on it expected", hint="click on the object, or draw its front"
        )
    frames = {frame.index: frame for frame in capture.frames}
    for said in prompt.frames:
        if said.frame not in frames:
            raise PromptError(
                f"{prompt.name}: frame {said.frame} set right found, a frame of {min(frames)}..{max(frames)} expected",
                hint="remove it",
            )
        if said.mask is not None:
            camera = frames[said.frame].rgb_camera
            check_mask_size(f"{prompt.name}: frame {said.frame}", said.mask, (camera.width, camera.height))
    for point in prompt.points:
        if point.frame not in frames:
            raise _no_frame(prompt.name, point.frame, sorted(frames))
        camera = frames[point.frame].rgb_camera
        if not (0 <= point.x < camera.width and 0 <= point.y < camera.height):
            raise PromptError(
                f"{prompt.name}: click at ({point.x:g}, {point.y:g}) on frame {point.frame} found, "
                f"0 <= x < {camera.width} and 0 <= y < {camera.height} expected",
                hint="click inside the image",
            )


def _no_frame(name: str, frame: int, kept: list[int]) -> PromptError:
    """Error of a click on a frame outside the recording, or on one that ingest left out of a long one."""
    expected = f"a frame of {kept[0]}..{kept[-1]}"
    hint = f"the nearest frame is {min(kept, key=lambda number: abs(number - frame))}"
    if kept[0] < frame < kept[-1]:
        expected, hint = f"one of the {len(kept)} frames kept", f"{hint}; others were damaged or above ingest.most_frames"
    return PromptError(f"{name}: click on frame {frame} found, {expected} expected", hint=hint)


def check_mask_size(where: str, mask: PackedMask | PromptsFileMask, frame_px: tuple[int, int]) -> None:
    """Raise PromptError for a mask that is larger than its frame (width, height) or, but for rounding, of other proportions."""
    width, height = frame_px
    slanted = abs(mask.width * height - mask.height * width) > max(width, height) / 2  # half a pixel of the mask
    if mask.width > width or mask.height > height or slanted:
        raise PromptError(
            f"{where}: a mask of {mask.width} x {mask.height} found, {width} x {height} or smaller in that proportion expected",
            hint="paint it over the whole frame",
        )


def without_hinge(prompt: ObjectPrompt) -> ObjectPrompt:
    """Prompt without its hinge, which no mask depends on: turning it must not recompute any."""
    return prompt if prompt.front is None else replace(prompt, front=replace(prompt.front, hinge=None))


def _check_names(objects: tuple[ObjectPrompt, ...]) -> None:
    seen: set[str] = set()
    for prompt in objects:
        _check_name(prompt.name)
        if fault := name_fault(prompt.name):  # clicks on it are drawn all the same: it may have been named before this check
            raise PromptError(
                f"name '{prompt.name}' found, which {fault}", hint=f"rename it, such as {identifier(prompt.name)}"
            )
        if prompt.name.casefold() in seen:  # Windows and macOS put the files of 'Door' and 'door' into one folder
            raise PromptError(f"two objects named '{prompt.name}' found, unique names expected", hint="rename one of them")
        seen.add(prompt.name.casefold())


def _check_name(name: str) -> None:
    if not _NAME.fullmatch(name):
        raise PromptError(f"name '{name}' found, letters, digits and underscores expected", hint="simulators accept no more")
