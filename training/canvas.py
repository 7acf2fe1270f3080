"""What an elevation is drawn on, and flat parts of it."""

from dataclasses import dataclass

import cv2
import numpy as np

CELL_M = 0.0025  # as the orthomosaic's cells
Area = tuple[int, int, int, int]  # left, top, right, bottom, in cells


@dataclass
class Elevation:
    """What is drawn so far. Colours are linear 0..1; `lift` is metres before the plane."""

    rng: np.random.Generator
    colour: np.ndarray
    lift: np.ndarray
    known: np.ndarray  # where the plane was seen at all
    upright: np.ndarray  # edges of fronts
    level: np.ndarray
    handle: np.ndarray
    front: np.ndarray

    def cells(self, metres: float) -> int:
        """At least one."""
        return max(1, round(metres / CELL_M))


def noise(rng: np.random.Generator, shape: tuple[int, int], scale: float, stretch: tuple[float, float] = (1, 1)) -> np.ndarray:
    """Smooth noise of mean 0.5, with grains of `scale` cells."""
    size = (max(2, int(shape[1] / (scale * stretch[0])) + 2), max(2, int(shape[0] / (scale * stretch[1])) + 2))
    return cv2.resize(rng.random(size[::-1], dtype=np.float32), (shape[1], shape[0]), interpolation=cv2.INTER_CUBIC)


def any_paint(rng: np.random.Generator) -> np.ndarray:
    kind = rng.random()
    if kind < 0.34:  # white and grey
        return rng.uniform(0.45, 0.9) * (1 + rng.uniform(-0.04, 0.04, 3))
    if kind < 0.46:  # dark
        return rng.uniform(0.008, 0.12) * (1 + rng.uniform(-0.2, 0.2, 3))
    if kind < 0.72:  # wood
        return rng.uniform(0.1, 0.75) * np.array([1.0, rng.uniform(0.5, 0.8), rng.uniform(0.2, 0.55)])
    hue = np.array(cv2.cvtColor(np.uint8([[[rng.integers(180), rng.integers(30, 220), 255]]]), cv2.COLOR_HSV2RGB)[0, 0]) / 255.0
    return (hue**2.2) * rng.uniform(0.08, 0.8)


def clip(e: Elevation, area: Area) -> tuple[slice, slice]:
    height, width = e.front.shape
    left, top, right, bottom = area
    return slice(min(max(top, 0), height), min(max(bottom, 0), height)), slice(
        min(max(left, 0), width), min(max(right, 0), width)
    )


def fill(e: Elevation, area: Area, paint: np.ndarray, *, texture: float = 0.0, lift: float = 0.0) -> None:
    """A flat part that is no front: what was told below it is forgotten."""
    at = clip(e, area)
    shape = e.front[at].shape
    if not all(shape):
        return
    e.colour[at] = paint
    if texture:
        e.colour[at] *= (1 + texture * (2 * noise(e.rng, shape, e.rng.uniform(1.5, 12)) - 1))[..., None]
    e.lift[at], e.known[at] = lift, True
    for told in (e.upright, e.level, e.handle, e.front):
        told[at] = 0
