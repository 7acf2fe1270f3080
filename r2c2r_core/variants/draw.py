"""Random sampling of variants from the bundle's uncertainties and from fixed ranges."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from r2c2r_core.variants.textures import TEXTURES

NOT_VARIED = ("arm", "gripper", "pictures")  # result folders of a bundle that its variants do not have
GUESSED = 0.02
"""Standard deviation, share of a side, where it was inferred or a category's default: own choice, 12 mm of 0.6 m."""
LEAST_MEASURED = 0.001  # where the bundle gives no spread
MOST_SIGMAS = 2.0
MASS = (0.8, 1.25)  # factor; own choice: boards of one size weigh 600 to 800 kg/m3
DAMPING = (0.5, 2.0)  # factor; own choice: within it every joint still comes to rest
FRICTION = (0.5, 2.0)  # factor on the joint's dry friction, own choice
SURFACE = (0.3, 0.7)  # sliding friction of surfaces: wood and laminate in friction tables
AJAR, AJAR_MOST = 0.2, 0.3  # fraction of joints initially ajar, and maximum opening as a fraction of their travel
SHIFT_M = 0.25  # maximum shift of a free object on its support
TINT = 0.12  # relative change of each colour channel
RETEXTURED = 0.5  # fraction of variants whose fronts get a procedural surface

KIND_OF = {
    "counter": "stone",
    "refrigerator": "metal",
    "dishwasher": "metal",
    "oven": "metal",
    "hood": "metal",
    "microwave": "metal",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Change:
    """Variation of one object."""

    name: str
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)  # of width, depth, height; the front and the underside are fixed
    mass: float = 1.0
    tint: tuple[float, float, float] = (1.0, 1.0, 1.0)
    texture: str | None = None  # of TEXTURES; None: the scan's own
    shift_m: tuple[float, float] = (0.0, 0.0)  # of a free object, horizontal
    turn_rad: float = 0.0
    shape: str | None = None  # the object of its category whose shape it takes; None: its own


@dataclass(frozen=True, slots=True, kw_only=True)
class Variation:
    """Variation of a scene."""

    changes: tuple[Change, ...]
    damping: Mapping[str, float]  # factor, by joint
    friction: Mapping[str, float]
    ajar: Mapping[str, float]  # initial opening of a joint as a fraction of its travel
    surface: float


def draw(rng: np.random.Generator, objects: Sequence[Mapping[str, Any]]) -> Variation:
    """A random variation of the objects of a manifest."""
    fronts = _finish(rng, "wood") if rng.random() < RETEXTURED else (None, _tint(rng))
    stone = _finish(rng, "stone") if rng.random() < RETEXTURED else (None, _tint(rng))
    changes = [_change(rng, entry, fronts, stone) for entry in objects]
    shapes = _shapes(rng, objects)
    joints = [joint["name"] for entry in objects for joint in entry["joints"]]
    return Variation(
        changes=tuple(replace(change, shape=shapes.get(change.name)) for change in changes),
        damping={name: _times(rng, DAMPING) for name in joints},
        friction={name: _times(rng, FRICTION) for name in joints},
        ajar={name: float(rng.uniform(0.0, AJAR_MOST)) for name in joints if rng.random() < AJAR},
        surface=float(rng.uniform(*SURFACE)),
    )


Finish = tuple[str | None, tuple[float, float, float]]


def _shapes(rng: np.random.Generator, objects: Sequence[Mapping[str, Any]]) -> dict[str, str]:
    """Shapes of free objects, exchanged at random within each category; without those that keep their own."""
    alike: dict[str, list[str]] = {}
    for entry in objects:
        if _loose(entry):
            alike.setdefault(entry["category"], []).append(entry["name"])
    pairs = [pair for names in alike.values() for pair in zip(names, rng.permutation(names).tolist(), strict=True)]
    return {name: shape for name, shape in pairs if shape != name}


def _loose(entry: Mapping[str, Any]) -> bool:
    """Whether an object may be moved about: what lies in a drawer has no room."""
    return bool(entry["movable"] and entry.get("carried_by") is None)


def _change(rng: np.random.Generator, entry: Mapping[str, Any], fronts: Finish, stone: Finish) -> Change:
    kind = KIND_OF.get(entry["category"], "thing" if entry["movable"] else "wood")
    texture, tint = {"wood": fronts, "stone": stone}.get(kind, (None, _tint(rng)))
    loose = _loose(entry)
    level = rng.uniform(-SHIFT_M, SHIFT_M, 2) if loose else np.zeros(2)
    return Change(
        name=entry["name"],
        scale=_scale(rng, entry),
        mass=_times(rng, MASS),
        tint=tint,
        texture=texture,
        shift_m=(float(level[0]), float(level[1])),
        turn_rad=float(rng.uniform(-np.pi, np.pi)) if loose else 0.0,
    )


def _scale(rng: np.random.Generator, entry: Mapping[str, Any]) -> tuple[float, float, float]:
    """Normally distributed scale of each side about 1, within two standard deviations; a free object keeps its shape."""
    spread = (entry["placement"] or {}).get("spread") or {}
    measured = max(spread.get("scale") or 0.0, LEAST_MEASURED)
    sources = entry["dimension_source"]
    sigmas = [measured if source in ("measured", "person") else GUESSED for source in sources]
    steps = np.clip(rng.normal(size=3), -MOST_SIGMAS, MOST_SIGMAS)
    if entry["movable"]:
        steps, sigmas = np.full(3, steps[0]), [measured] * 3
    width, depth, height = (float(1.0 + sigma * step) for sigma, step in zip(sigmas, steps, strict=True))
    return width, depth, height


def _finish(rng: np.random.Generator, kind: str) -> Finish:
    names = [name for name, texture in TEXTURES.items() if texture.kind == kind]
    return str(rng.choice(names)), _tint(rng)


def _tint(rng: np.random.Generator) -> tuple[float, float, float]:
    red, green, blue = (float(value) for value in 1.0 - rng.uniform(0.0, 2 * TINT, 3))
    return red, green, blue


def _times(rng: np.random.Generator, ends: tuple[float, float]) -> float:
    """A log-uniform factor between the ends."""
    return float(np.exp(rng.uniform(*np.log(ends))))
