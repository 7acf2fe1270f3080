"""Correction of hinge sides by clearance: real doors open, so a blocked hinge is on the other side."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from r2c2r_core.failing import spared
from r2c2r_core.model.capture import Wall
from r2c2r_core.model.inputs import HingeSide
from r2c2r_core.model.scene import SceneObject
from r2c2r_core.synthesize.clearance import open_freely
from r2c2r_core.synthesize.joints import Hinge
from r2c2r_core.tuning import param, tuned

_OTHER: dict[HingeSide, HingeSide] = {"left": "right", "right": "left"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of hinge-side correction."""

    blocked_rad: float = param(
        float(np.deg2rad(30.0)),
        "rad",
        "Travel up to which a door counts as blocked",
        source="no real door opens less",
    )
    opens: float = param(
        0.8,
        "score",
        "Confidence, 0 to 1, in a side chosen because the door then opens",
        source="above a guess, below a handle at the edge",
    )
    gain_rad: float = param(float(np.deg2rad(30.0)), "rad", "Minimum additional travel that the other side must give")


def open_all(
    built: Sequence[SceneObject],
    hinges: Mapping[str, Hinge],
    rebuild: Callable[[str, Hinge], SceneObject],
    walls: Sequence[Wall],
    kept: frozenset[str],
) -> list[SceneObject]:
    """The objects with collision-free upper limits; a blocked door is hinged on its other side where that one opens.

    `rebuild` builds an object with another hinge. A person's hinge is kept, and one inferred from a handle: there another
    measurement is wrong. Every changed object carries a warning.
    """
    params = tuned(Params)
    fixtures = list(built)
    opened = open_freely(fixtures, walls, kept)
    for index, item in enumerate(built):
        hinge = hinges.get(item.name)
        told = hinge is None or hinge.source == "person" or hinge.by_handle or hinge.side not in _OTHER
        if hinge is None or told or _travel(opened[index]) > params.blocked_rad:
            continue
        reason, said = f"hung on the {hinge.side} it could not open", list[str]()
        other = Hinge(side=_OTHER[hinge.side], source="inferred", reason=reason, confidence=params.opens)
        with spared("a hinge on its other side was not tried", said):
            turned = rebuild(item.name, other)
        if said:
            opened[index] = replace(opened[index], warnings=(*opened[index].warnings, *said))
            fixtures[index] = replace(item, warnings=(*item.warnings, *said))
            continue
        trial = [*fixtures[:index], turned, *fixtures[index + 1 :]]
        tried = open_freely(trial, walls, kept)
        others_lose = any(
            _travel(b) < _travel(a) - 1e-6 for k, (a, b) in enumerate(zip(opened, tried, strict=True)) if k != index
        )
        if _travel(tried[index]) > _travel(opened[index]) + params.gain_rad and not others_lose:
            warning = f"hinge on the {_OTHER[hinge.side]}: {reason}"
            fixtures = [*trial[:index], replace(turned, warnings=(*turned.warnings, warning)), *trial[index + 1 :]]
            opened = open_freely(fixtures, walls, kept)
    return opened


def _travel(item: SceneObject) -> float:
    """Smallest upper limit of its revolute joints; infinite without any."""
    return min((joint.upper for joint in item.joints if joint.type == "revolute"), default=np.inf)
