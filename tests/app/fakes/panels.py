"""Stand-in live segmenter with a session of two panels, the left and the right half of every frame.

Two fronts clicked on one panel divide it half way between their clicks.
"""

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from app.jobs import live_segment
from app.jobs.live_segment import Desk
from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.masks import PackedMask, pack_mask
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.kitchen.names import category_of
from r2c2r_core.model.inputs import ObjectPrompt, PromptPoint
from r2c2r_core.model.track import FrontPanel, ThingBox

CAMERA = Intrinsics(fx=100.0, fy=100.0, cx=80.0, cy=60.0, width=160, height=120)
CAPTURE: Any = SimpleNamespace(
    frames=tuple(SimpleNamespace(index=index, rgb_camera=CAMERA) for index in (0, 3, 7)),
    world_from_capture=Rigid3(),
    room=SimpleNamespace(walls=(), floor_found=False),
)


class Panels:
    """Session in which a pixel is a centimetre."""

    def glimpse(self, prompt: ObjectPrompt) -> tuple[int, PackedMask, float]:
        return prompt.points[-1].frame, _mask(prompt), 0.9

    def stream(self, prompt: ObjectPrompt) -> Iterator[tuple[int, PackedMask, float]]:
        for index in (0, 3, 7):
            yield index, _mask(prompt), 0.9

    def panel(self, prompt: ObjectPrompt) -> FrontPanel | None:
        if category_of(prompt.category).kind == "thing":
            return None
        left, right = _span(prompt)
        at = Rigid3(np.eye(3), np.array([(left + right) / 200, 0.0, 0.6]))
        return FrontPanel(world_from_front=at, width_m=(right - left) / 100, height_m=1.2, handle=None, confidence=0.9)

    def thing_box(self, prompt: ObjectPrompt) -> ThingBox:
        return ThingBox(world_from_object=Rigid3(), dimensions_m=np.array([0.8, 0.4, 1.2]), support_z_m=0.9)

    def disputed(self, prompts: Sequence[ObjectPrompt]) -> dict[str, tuple[PromptPoint, ...]]:
        found = {}
        for prompt in prompts:
            others = [other for other in prompts if other is not prompt and category_of(other.category).kind != "thing"]
            clicks = [point for other in others for point in other.points]
            within = tuple(click for click in clicks if _half(click) == _half(prompt.points[0]))
            if within and category_of(prompt.category).kind == "front":
                found[prompt.name] = within
        return found

    def prefetch(self) -> Iterator[None]:
        return iter(())

    def elevations(self) -> Iterator[Any]:
        return iter(())

    def motions(self, prompt: ObjectPrompt) -> tuple[()]:
        return ()

    def propose(self) -> Iterator[Any]:
        return iter([(1.0, ())])


def _half(click: PromptPoint) -> int:
    return int(click.x >= 80)


def _span(prompt: ObjectPrompt) -> tuple[float, float]:
    own = prompt.points[0]
    left, right = 80.0 * _half(own), 80.0 * _half(own) + 80.0
    for other in prompt.others:
        seam = (own.x + other.x) / 2
        left, right = (max(left, seam), right) if other.x < own.x else (left, min(right, seam))
    return left, right


def _mask(prompt: ObjectPrompt) -> PackedMask:
    left, right = _span(prompt)
    pixels = np.zeros((120, 160), bool)
    pixels[20:100, round(left) : round(right)] = True
    return pack_mask(pixels)


def _open_desk(_workdir: Path, width: int, _segmenter: str) -> Desk:
    return Desk(Panels(), CAPTURE, width)  # type: ignore[arg-type]  # as much of a session as is asked for


if __name__ == "__main__":
    vars(live_segment)["_open_desk"] = _open_desk
    sys.exit(live_segment.main())
