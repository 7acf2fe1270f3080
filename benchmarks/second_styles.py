"""Kitchens of the second generator with other styles of fronts.

    python benchmarks/second_styles.py PATH/make_kitchen.py STYLE OUT --seed N [--frames F] [--size WxH] [--clicks C]

PATH/make_kitchen.py is that generator, deliberately independent of the project: its layouts, renderer, sensor and truth are
used unchanged; the fronts of furniture are drawn here. A door's handle is on the side that opens, as in its kitchens, but its
place on that side differs from kitchen to kitchen. The truth covers the moving parts: a face frame, and the channel over a
handleless front, belong to no object.
"""

import argparse
import importlib.util
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any, Literal

import numpy as np

Triple = tuple[float, float, float]
Pull = Literal["bar", "knob", "wide", "cup", "none"]

_FURNITURE = ("cabinet", "wall_cabinet", "drawer")
_THICK, _GAP = 0.02, 0.0015  # as the generator makes its fronts
_WINDOW = np.array([0.25, -0.85, 0.45])  # direction of the window that glossy fronts mirror
_GLOSSY = "gloss"  # a texture added here; the generator treats it as paint


@dataclass(frozen=True, slots=True, kw_only=True)
class Style:
    """Style of the fronts of a kitchen."""

    colour: Triple
    texture: str = "paint"
    rail_m: float = 0.0  # of a frame-and-panel front; 0: a slab
    frame_m: float = 0.0  # width of the face frame around an inset front, on each side
    channel_m: float = 0.0  # height of the channel over the fronts of base units, to reach in
    pull: Pull = "bar"
    pull_colour: Triple = (0.75, 0.75, 0.78)


STYLES = {
    "shaker": Style(colour=(0.85, 0.85, 0.82), rail_m=0.07),
    "framed": Style(colour=(0.5, 0.55, 0.5), rail_m=0.055, frame_m=0.02, pull="knob", pull_colour=(0.15, 0.12, 0.1)),
    "handleless": Style(colour=(0.88, 0.88, 0.87), channel_m=0.028, pull="none"),
    "wide": Style(colour=(0.75, 0.7, 0.62), pull="wide", pull_colour=(0.1, 0.1, 0.1)),
    "glossy": Style(colour=(0.045, 0.045, 0.055), texture=_GLOSSY),
    "grain": Style(colour=(0.55, 0.36, 0.2), texture="wood", pull="cup", pull_colour=(0.45, 0.33, 0.12)),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Habit:
    """Handle positions of a kitchen."""

    side_m: float  # from the free edge to the handle's centre
    high_m: float  # from the handle's nearer end to the edge that is nearer to the hand
    low: float  # fraction of a drawer's height from its bottom to its handle

    @staticmethod
    def of(seed: int) -> "Habit":
        """Draw the habit of one kitchen."""
        rng = np.random.default_rng([seed, 13])
        return Habit(
            side_m=float(rng.uniform(0.03, 0.065)), high_m=float(rng.uniform(0.04, 0.2)), low=float(rng.uniform(0.5, 0.8))
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Front:
    """A front's rectangle in its run's frame: x along it, y into it, z up."""

    x: float
    z: float
    width: float
    height: float

    def inner(self, left: float, right: float, bottom: float, top: float) -> "Front":
        """The rectangle inset by margins."""
        return Front(x=self.x + left, z=self.z + bottom, width=self.width - left - right, height=self.height - bottom - top)


Box = Callable[..., None]  # (low, high, colour, texture): adds a box of the front in its run's frame


def main(arguments: Sequence[str] | None = None) -> None:
    """Draw one kitchen with the generator's own program."""
    parser = argparse.ArgumentParser(description="A kitchen of the second generator in another style.")
    parser.add_argument("generator", type=Path)
    parser.add_argument("style", choices=STYLES)
    parser.add_argument("out")
    parser.add_argument("--seed", type=int, default=1)
    options, rest = parser.parse_known_args(arguments)
    generator = _load(options.generator)
    generator.unit = _units(generator.unit, STYLES[options.style], Habit.of(options.seed))
    generator.shade = _shader(generator.shade)
    sys.argv = ["make_kitchen.py", options.out, "--seed", str(options.seed), *rest]
    generator.main()


def _load(path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location("make_kitchen", path)
    if spec is None or spec.loader is None or not path.exists():
        raise SystemExit(f"{path}: no such program; give the path of make_kitchen.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def _units(plain: Callable[..., None], style: Style, habit: Habit) -> Callable[..., None]:
    """The generator's `unit`, with furniture in this style; appliances are unchanged."""

    def unit(
        scene: Any,
        name: str,
        category: str,
        run: np.ndarray,
        x: float,
        width: float,
        z: float,
        height: float,
        depth: float,
        colour: Triple,
        texture: str,
        hinge: str | None = None,
    ) -> None:
        if category not in _FURNITURE:
            plain(scene, name, category, run, x, width, z, height, depth, colour, texture, hinge=hinge)
            return
        cell = Front(x=x, z=z, width=width, height=height)
        channel = 0.0 if category == "wall_cabinet" else style.channel_m
        edge = style.frame_m
        moves = cell.inner(edge, edge, edge, edge + channel)
        first, number = len(scene.parts), len(scene.objects)
        paint = (style.colour, style.texture)
        plain(scene, name, category, run, moves.x, moves.width, moves.z, moves.height, depth, *paint, hinge=hinge)
        del scene.parts[first + 1 :]  # all parts except the carcass

        def fixed(low: Triple, high: Triple, shade: float) -> None:
            scene.box(low, high, run, color=np.array(style.colour) * shade, tex="paint")

        def moving(low: Triple, high: Triple, colour: Triple = style.colour, texture: str = style.texture) -> None:
            scene.box(low, high, run, number, colour, texture, True)

        _surround(fixed, cell, moves, depth)
        _panel(moving, moves, style)
        _pull(moving, moves, style, habit, category, hinge)

    return unit


def _surround(fixed: Box, cell: Front, moves: Front, depth: float) -> None:
    """Add the face frame or the dark channel that fills the cell around the moving part, and the carcass behind it."""
    right, top = cell.x + cell.width, cell.z + cell.height
    if moves.width < cell.width:
        _ring(fixed, cell, (cell.width - moves.width) / 2, 1.0)
        fixed((cell.x, _THICK + 0.001, cell.z), (right, depth, top), 0.9)
    elif moves.height < cell.height:
        fixed((cell.x, 2 * _THICK, moves.z + moves.height), (right, depth, top), 0.25)


def _panel(moving: Box, moves: Front, style: Style) -> None:
    """Add a slab, or a frame with its panel 9 mm behind its face."""
    front = moves.inner(_GAP, _GAP, _GAP, _GAP)
    if not style.rail_m:
        moving((front.x, 0, front.z), (front.x + front.width, _THICK, front.z + front.height))
        return
    rail = style.rail_m if front.height > 0.3 else 0.65 * style.rail_m
    _ring(moving, front, rail)
    inner = front.inner(rail, rail, rail, rail)
    moving((inner.x, 0.009, inner.z), (inner.x + inner.width, _THICK, inner.z + inner.height))


def _ring(box: Box, front: Front, rail: float, *paint: float) -> None:
    """Add two stiles and two rails."""
    right, top = front.x + front.width, front.z + front.height
    for left, low, end, high in (
        (front.x, front.z, front.x + rail, top),
        (right - rail, front.z, right, top),
        (front.x + rail, front.z, right - rail, front.z + rail),
        (front.x + rail, top - rail, right - rail, top),
    ):
        box((left, 0, low), (end, _THICK, high), *paint)


def _pull(moving: Box, moves: Front, style: Style, habit: Habit, category: str, hinge: str | None) -> None:
    """Add the handle: across a drawer's middle, or at a door's free edge, towards the hand."""
    if style.pull == "none":
        return
    drawer = category == "drawer"
    x = moves.x + (moves.width / 2 if drawer else moves.width - habit.side_m if hinge == "left" else habit.side_m)
    wide, tall = _pull_size(style.pull, moves, drawer)
    if style.pull == "wide":
        x = moves.x + moves.width / 2
    if drawer:
        z = moves.z + min(habit.low * moves.height, moves.height - tall / 2 - 0.02)
    elif category == "wall_cabinet":
        z = moves.z + min(habit.high_m, 0.06) + tall / 2
    else:
        z = moves.z + moves.height - habit.high_m - tall / 2
    near = 0.0 if style.pull in ("knob", "cup") else -0.02  # a bar stands off the face, a knob sits on it
    low, high = (x - wide / 2, -0.032, z - tall / 2), (x + wide / 2, near, z + tall / 2)
    moving(low, high, style.pull_colour, "metal")


def _pull_size(pull: Pull, moves: Front, drawer: bool) -> tuple[float, float]:
    """Width and height as mounted: bars are horizontal on drawers and vertical on doors, wide pulls always horizontal."""
    if pull == "wide":
        return moves.width - 0.1, 0.01
    if pull == "knob" or (pull == "cup" and not drawer):
        return 0.028, 0.028
    if pull == "cup":
        return 0.095, 0.035
    length = min(0.2, 0.5 * moves.height)
    return (0.2, 0.012) if drawer else (0.012, length)


def _shader(plain: Callable[..., np.ndarray]) -> Callable[..., np.ndarray]:
    """The generator's `shade`, with glossy fronts that mirror a window."""

    def shade(
        scene: Any, part: np.ndarray, points: np.ndarray, normals: np.ndarray, towards: np.ndarray, *light: Any
    ) -> np.ndarray:
        colour = plain(scene, part, points, normals, towards, *light)
        glossy = np.array([each["tex"] == _GLOSSY for each in scene.parts] + [False])[part]
        facing = (normals * towards).sum(axis=1, keepdims=True)
        mirrored = 2 * facing * normals - towards
        run = scene.parts[0]["T"][:3, :3]
        seen = np.clip(mirrored @ (run @ _WINDOW / np.linalg.norm(_WINDOW)), 0, 1)
        fresnel = 0.05 + 0.95 * (1 - np.clip(facing[:, 0], 0, 1)) ** 5
        colour[glossy] += (fresnel * (0.5 + 2.5 * seen**30))[glossy, None]
        return np.clip(colour, 0, 1)

    return shade


if __name__ == "__main__":
    main()
