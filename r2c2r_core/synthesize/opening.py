"""Which side a door opens, once its surroundings are known: real doors open, so a blocked hinge is on the other side."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from r2c2r_core.model.capture import Wall
from r2c2r_core.model.inputs import HingeSide
from r2c2r_core.model.scene import SceneObject
from r2c2r_core.synthesize.clearance import open_freely
from r2c2r_core.synthesize.joints import Hinge

_BLOCKED_RAD = np.deg2rad(30.0)  # no one hangs a door that opens less
_OPENS = 0.8  # that one hangs a door so that it opens: above a guess, below a handle at the edge
_GAIN_RAD = np.deg2rad(30.0)
_OTHER: dict[HingeSide, HingeSide] = {"left": "right", "right": "left"}


def open_all(
    built: Sequence[SceneObject],
    hinges: Mapping[str, Hinge],
    rebuild: Callable[[int, Hinge], SceneObject],
    walls: Sequence[Wall],
    kept: frozenset[str],
) -> list[SceneObject]:
    """The objects with free upper limits; a door that cannot open is hung on its other side where that one opens.

    `rebuild` makes object k anew with another hinge. A person's hinge stays, and one that a handle told: there something
    else was measured wrong. Every turned one carries a warning.
    """
    fixtures = list(built)
    opened = open_freely(fixtures, walls, kept)
    for index, item in enumerate(built):
        hinge = hinges.get(item.name)
        told = hinge is None or hinge.source == "person" or hinge.by_handle or hinge.side not in _OTHER
        if hinge is None or told or _travel(opened[index]) > _BLOCKED_RAD:
            continue
        reason = f"hung on the {hinge.side} it could not open"
        turned = rebuild(index, Hinge(side=_OTHER[hinge.side], source="inferred", reason=reason, confidence=_OPENS))
        trial = [*fixtures[:index], turned, *fixtures[index + 1 :]]
        tried = open_freely(trial, walls, kept)
        others_lose = any(
            _travel(b) < _travel(a) - 1e-6 for k, (a, b) in enumerate(zip(opened, tried, strict=True)) if k != index
        )
        if _travel(tried[index]) > _travel(opened[index]) + _GAIN_RAD and not others_lose:
            warning = f"hinge on the {_OTHER[hinge.side]}: {reason}"
            fixtures = [*trial[:index], replace(turned, warnings=(*turned.warnings, warning)), *trial[index + 1 :]]
            opened = open_freely(fixtures, walls, kept)
    return opened


def _travel(item: SceneObject) -> float:
    """The joint's free range; infinite for what has none, or slides."""
    return min((joint.upper for joint in item.joints if joint.type == "revolute"), default=np.inf)
