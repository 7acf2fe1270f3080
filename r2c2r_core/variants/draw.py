"""Random sampling of variants from the ranges in the bundle's manifest; what it does not state is an own choice here."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import NormalDist
from typing import Any

import numpy as np

from r2c2r_core.variants.textures import TEXTURES

NOT_VARIED = ("arm", "gripper", "pictures")  # result folders of a bundle that its variants do not have
AJAR, AJAR_MOST = 0.2, 0.3  # fraction of joints initially ajar, and maximum opening as a fraction of their travel
SHIFT_M = 0.25  # maximum shift of a free object on its support
RETEXTURED = 0.5  # fraction of variants whose fronts get a procedural surface

_METAL = ("refrigerator", "dishwasher", "oven", "hood", "microwave")
KIND_OF = {"counter": "stone", **dict.fromkeys(_METAL, "metal")}


@dataclass(frozen=True, slots=True, kw_only=True)
class Change:
    """Variation of one object."""

    name: str
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)  # of width, depth, height; the front and the underside are fixed
    mass: float = 1.0  # factor
    friction: float | None = None  # of its surfaces; None: the scene's
    tint: tuple[float, float, float] = (1.0, 1.0, 1.0)  # factor of each channel
    texture: str | None = None  # of TEXTURES; None: the scan's own
    shift_m: tuple[float, float] = (0.0, 0.0)  # of a free object, horizontal
    turn_rad: float = 0.0
    shape: str | None = None  # the object of its category whose shape it takes; None: its own


@dataclass(frozen=True, slots=True, kw_only=True)
class Variation:
    """Variation of a scene."""

    changes: tuple[Change, ...]
    joints: Mapping[str, Mapping[str, float]]  # damping, friction, armature and upper limit, by joint
    ajar: Mapping[str, float]  # initial opening of a joint as a fraction of its travel


def draw(rng: np.random.Generator, objects: Sequence[Mapping[str, Any]]) -> Variation:
    """A random variation of the objects of a manifest."""
    finishes = {kind: _finish(rng, kind) for kind in ("wood", "stone")}
    shapes, entries = _shapes(rng, objects), {entry["name"]: entry for entry in objects}
    changes = [_change(rng, entry, entries[shapes.get(entry["name"], entry["name"])], finishes) for entry in objects]
    joints = {
        joint["name"]: {name: _value(stated, rng.random()) for name, stated in joint["randomize"].items()}
        for entry in objects
        for joint in entry["joints"]
    }
    return Variation(
        changes=tuple(changes),
        joints=joints,
        ajar={name: float(rng.uniform(0.0, AJAR_MOST)) for name in joints if rng.random() < AJAR},
    )


Finish = tuple[str | None, np.ndarray]
"""Texture, and quantiles of the three channels' ranges."""


def _value(stated: Mapping[str, Any], quantile: float) -> float:
    """The quantile of a manifest's distribution; a normal one lies about the middle of its ends, where it is cut off."""
    low, high = stated["low"], stated["high"]
    if low == high:
        return float(low)
    if stated["distribution"] == "normal":
        normal = NormalDist((low + high) / 2, stated["sigma"])
        first, last = normal.cdf(low), normal.cdf(high)
        return normal.inv_cdf(first + quantile * (last - first))
    if stated["distribution"] == "loguniform":
        return float(low * (high / low) ** quantile)
    return float(low + quantile * (high - low))


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


def _change(
    rng: np.random.Generator, entry: Mapping[str, Any], like: Mapping[str, Any], finishes: Mapping[str, Finish]
) -> Change:
    """Change of an object that has the shape and the mass of another of its category, or its own."""
    kind = KIND_OF.get(entry["category"], "thing" if entry["movable"] else "wood")
    texture, channels = finishes.get(kind, (None, rng.random(3)))
    red, green, blue = (1.0 + _value(entry["randomize"]["colour"], quantile) for quantile in channels)
    loose = _loose(entry)
    level = rng.uniform(-SHIFT_M, SHIFT_M, 2) if loose else np.zeros(2)
    return Change(
        name=entry["name"],
        scale=_scale(rng, like),
        mass=_value(like["randomize"]["mass_kg"], rng.random()) / like["mass_kg"],
        friction=_value(entry["randomize"]["friction"], rng.random()),
        tint=(red, green, blue),  # a channel is at most 1, so this moves it by no more than the stated offset
        texture=texture,
        shift_m=(float(level[0]), float(level[1])),
        turn_rad=float(rng.uniform(-np.pi, np.pi)) if loose else 0.0,
        shape=None if like is entry else like["name"],
    )


def _scale(rng: np.random.Generator, entry: Mapping[str, Any]) -> tuple[float, float, float]:
    """Scale of each side; a free object keeps its shape, so its least uncertain side decides."""
    stated = list(zip(entry["randomize"]["dimensions_m"], entry["dimensions_m"], rng.random(3), strict=True))
    if entry["movable"]:
        stated = [min(stated, key=lambda side: (side[0]["high"] - side[0]["low"]) / side[1])] * 3
    width, depth, height = (_value(side, quantile) / size_m for side, size_m, quantile in stated)
    return width, depth, height


def _finish(rng: np.random.Generator, kind: str) -> Finish:
    """One finish for all objects of a kind: the scan's, or a procedural texture."""
    names = [name for name, texture in TEXTURES.items() if texture.kind == kind]
    return str(rng.choice(names)) if rng.random() < RETEXTURED else None, rng.random(3)
