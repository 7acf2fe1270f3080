"""Object proposals of a segmenter, before any click."""

from dataclasses import dataclass
from typing import Literal

from r2c2r_core.arrays import Vector3
from r2c2r_core.geometry.masks import PackedMask
from r2c2r_core.model.inputs import PromptPoint


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Proposal:
    """An object to confirm or dismiss. Confirming it adds `click` with `category`; nothing else is stored."""

    kind: Literal["front", "appliance", "thing"]
    category: str  # a guess, for a person to change
    confidence: float  # 0..1
    click: PromptPoint  # in the frame that shows it best
    outline: PackedMask  # its visible pixels in that frame, at RGB resolution
    size_m: tuple[float, float, float]  # width, depth, height; the depth of a front is a usual one
    centre_world: Vector3  # of its front, if it has one
    handle_px: tuple[tuple[float, float], ...]  # corners of its handle in that frame; empty where none was found
    doubts: tuple[str, ...] = ()  # reasons to check it before confirming; usually empty
