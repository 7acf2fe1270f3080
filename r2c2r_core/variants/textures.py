"""Procedural wood and stone textures, one file each, shared by all variants."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import cv2
import numpy as np

from r2c2r_core.arrays import Image

SIZE_PX = 256


@dataclass(frozen=True, slots=True, kw_only=True)
class Procedural:
    """A procedural texture: kind, dark and light colour (RGB 0..255)."""

    kind: Literal["wood", "stone"]
    dark: tuple[int, int, int]
    light: tuple[int, int, int]


TEXTURES = {
    "oak": Procedural(kind="wood", dark=(150, 110, 70), light=(196, 158, 112)),
    "beech": Procedural(kind="wood", dark=(190, 150, 110), light=(222, 188, 150)),
    "walnut": Procedural(kind="wood", dark=(74, 50, 34), light=(116, 84, 60)),
    "ash": Procedural(kind="wood", dark=(176, 160, 138), light=(214, 202, 182)),
    "white": Procedural(kind="wood", dark=(232, 231, 227), light=(244, 243, 240)),
    "sage": Procedural(kind="wood", dark=(122, 138, 116), light=(134, 150, 128)),
    "navy": Procedural(kind="wood", dark=(44, 56, 82), light=(54, 67, 95)),
    "granite": Procedural(kind="stone", dark=(48, 48, 52), light=(104, 104, 108)),
    "marble": Procedural(kind="stone", dark=(196, 196, 198), light=(240, 240, 240)),
    "slate": Procedural(kind="stone", dark=(64, 70, 76), light=(92, 99, 106)),
}


def write_textures(folder: Path) -> None:
    """Write one PNG per texture, with reproducible bytes."""
    folder.mkdir(parents=True, exist_ok=True)
    for number, (name, texture) in enumerate(TEXTURES.items()):
        picture = drawn(texture, np.random.default_rng(number))
        (folder / f"{name}.png").write_bytes(cv2.imencode(".png", picture[..., ::-1])[1].tobytes())


def drawn(texture: Procedural, rng: np.random.Generator) -> Image:
    """The texture image: grain along the rows' normal for wood, grains and veins for stone."""
    noise = rng.normal(size=(SIZE_PX, SIZE_PX)).astype(np.float32)
    if texture.kind == "wood":
        share = _even(cv2.GaussianBlur(noise, (0, 0), sigmaX=1.2, sigmaY=24, borderType=cv2.BORDER_REFLECT))
    else:
        share = 0.6 * _even(cv2.GaussianBlur(noise, (0, 0), 1.0)) + 0.4 * _even(cv2.GaussianBlur(noise, (0, 0), 12.0))
    dark, light = np.array(texture.dark), np.array(texture.light)
    return np.asarray((dark + share[..., None] * (light - dark)).clip(0, 255), dtype=np.uint8)


def _even(noise: np.ndarray) -> np.ndarray:
    """Noise stretched to 0..1 between its 1 % and 99 % quantiles."""
    low, high = np.quantile(noise, (0.01, 0.99))
    return np.asarray(((noise - low) / (high - low)).clip(0, 1))
