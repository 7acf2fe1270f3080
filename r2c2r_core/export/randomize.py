"""Domain randomisation: a distribution for each number of a scene, with its source.

`measured`: the spread that was measured with the number. `sourced`: a published range (cited in model/materials.py).
`default`: an own choice.
"""

from dataclasses import dataclass
from typing import Literal

from r2c2r_core.kitchen.names import category_of
from r2c2r_core.model.materials import ARMATURE
from r2c2r_core.model.motion import JointMotion, Source
from r2c2r_core.model.placement import Placement
from r2c2r_core.model.scene import Joint, SceneObject

_BOARD_KG_M3 = (640.0, 800.0)  # materials.py, _BOARD: ANSI A208.1 grade M
_FRICTION = (0.2, 0.62)  # materials.py, SURFACE_FRICTION; up to oak on oak, static, along the grain (Marks' Handbook)
_RESISTANCE = (0.5, 2.0)  # times a joint's damping, friction and armature
_WIDER: dict[Source, float] = {"measured": 0.01, "person": 0.0, "inferred": 0.05, "at_least": 0.05, "default": 0.1}
"""Half the width of what a size or a limit may be, as a share of it, by how it was found."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Range:
    """A distribution: uniform or loguniform between the ends, or normal about the written value, truncated at them."""

    distribution: Literal["uniform", "loguniform", "normal"]
    low: float
    high: float
    sigma: float | None = None  # of a normal one
    source: Literal["measured", "sourced", "default"]
    why: str


def of_object(item: SceneObject, mass_kg: float, placement: Placement | None) -> dict[str, Range | list[Range]]:
    """Ranges of mass in kg, surface friction, width, depth and height in m, and offsets of each colour channel (0..1)."""
    return {
        "mass_kg": _mass(item, mass_kg),
        "friction": Range(
            distribution="uniform",
            low=_FRICTION[0],
            high=_FRICTION[1],
            source="default" if item.movable else "sourced",
            why="as of furniture: " * item.movable
            + "dry wood on wood 0.25-0.5, laminate 0.2-0.4, oak on oak up to 0.62 in friction tables",
        ),
        "dimensions_m": [
            _size(float(size), source, placement)
            for size, source in zip(item.dimensions_m, item.dimension_sources, strict=True)
        ],
        "colour": Range(distribution="uniform", low=-0.1, high=0.1, source="default", why="light and white balance of a phone"),
    }


def of_joint(joint: Joint) -> dict[str, Range]:
    """Ranges of damping, friction and armature in the joint's units, and of its upper limit in rad or m."""
    resistances = {"damping": joint.damping, "friction": joint.friction, "armature": ARMATURE[joint.type]}
    ranges = {name: _around(value) for name, value in resistances.items()}
    return ranges | {"upper": _limit(joint, joint.motion)}


def _around(value: float) -> Range:
    low, high = _RESISTANCE
    why = "half to twice the written value, an own choice (materials.py); no furniture was measured"
    return Range(distribution="loguniform", low=low * value, high=high * value, source="default", why=why)


def _mass(item: SceneObject, mass_kg: float) -> Range:
    """Mass range by the category's published weights, or by board densities; it always includes the written value."""
    material = category_of(item.category).material
    if material.weight_kg is not None:
        low, high = material.weight_kg
        why = material.source
    elif item.movable:
        return Range(distribution="uniform", low=0.7 * mass_kg, high=1.3 * mass_kg, source="default", why=material.source)
    else:
        low, high = (mass_kg * density / material.density_kg_m3 for density in _BOARD_KG_M3)
        why = material.source
    return Range(distribution="uniform", low=min(low, mass_kg), high=max(high, mass_kg), source="sourced", why=why)


def _size(size_m: float, source: Source, placement: Placement | None) -> Range:
    spread = None if placement is None or placement.spread is None else placement.spread.scale
    if source == "measured" and spread is not None and spread > 0:
        sigma = spread * size_m
        ends = (size_m - 3 * sigma, size_m + 3 * sigma)
        why = "standard deviation of the placement's scale"
        return Range(distribution="normal", low=ends[0], high=ends[1], sigma=sigma, source="measured", why=why)
    half = _WIDER[source] * size_m
    return Range(distribution="uniform", low=size_m - half, high=size_m + half, source="default", why=f"the size is {source}")


def _limit(joint: Joint, motion: JointMotion | None) -> Range:
    """Range of the upper limit, neither beyond an obstacle nor below what was filmed."""
    source: Source = joint.sources.get("limits", "default")
    half, seen = _WIDER[source] * joint.upper, 0.0 if motion is None else motion.largest
    low, high = max(joint.upper - half, min(seen, joint.upper)), joint.upper if joint.uncut is not None else joint.upper + half
    return Range(distribution="uniform", low=low, high=high, source="default", why=f"the limit is {source}")
