"""Free objects whose colliders overlap, moved apart on the floor; their boxes may overlap: a chair stands under a table."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from r2c2r_core.arrays import Points, Vector3
from r2c2r_core.failing import spared
from r2c2r_core.geometry.gaps import last_contact
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.scene import SceneObject
from r2c2r_core.synthesize.layout import Params as LayoutParams
from r2c2r_core.tuning import param, tuned

_UP: Vector3 = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of moving objects apart."""

    directions: int = param(24, "count", "Number of horizontal directions that are tried", ge=4)
    sunk_m: float = param(0.02, "m", "Maximum depth to which an object that stands on another has sunk into it")
    deepest_m: float = param(0.15, "m", "Maximum distance by which an object is moved: beyond, the overlap is reported")


def moved_apart(items: Sequence[SceneObject], kept: frozenset[str]) -> list[SceneObject]:
    """The objects, the lighter of two free ones that overlap moved out of the other; those in `kept`, a person's, stay."""
    done = {item.name: item for item in items}
    for names in combinations([item.name for item in items if item.movable], 2):
        pair = (done[name] for name in names)
        first, second = sorted(pair, key=lambda item: (item.name in kept, item.links[0].inertial.mass_kg))
        if first.name in kept:
            continue
        said: list[str] = []
        with spared(f"it was not moved apart from {second.name}", said):
            first = _out_of(first, second)
        done[first.name] = replace(first, warnings=(*first.warnings, *said))
    return list(done.values())


def _out_of(item: SceneObject, other: SceneObject) -> SceneObject:
    """The object, moved until no collider overlaps the other's; where it is if that is too far."""
    params, gap_m = tuned(Params), tuned(LayoutParams).gap_m
    angles = np.arange(params.directions) * 2 * np.pi / params.directions
    ways = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(len(angles))])
    still, shift = _pieces(other), np.zeros(3)
    for _ in ways:  # few moves suffice
        met = [(own, each) for own in (part + shift for part in _pieces(item)) for each in still if _overlap(own, each)]
        if not met or any(max(last_contact(*pair, up) or 0.0 for pair in met) < params.sunk_m for up in (_UP, -_UP)):
            break  # one stands on the other: the export sets it down
        needed = [max(last_contact(own, each, way) or 0.0 for own, each in met) for way in ways]
        best = int(np.argmin(needed))
        shift = shift + (needed[best] + gap_m) * ways[best]
    if not shift.any() or np.linalg.norm(shift) > params.deepest_m:
        return item
    far_m, move = float(np.linalg.norm(shift)), Rigid3(np.eye(3), shift)
    said = [f"was moved by {1000 * far_m:.0f} mm out of {other.name}: check the size and pose of both"]
    return replace(
        item,
        world_from_object=move @ item.world_from_object,
        final_from_placed=move @ item.final_from_placed,
        warnings=(*item.warnings, *(said if far_m > tuned(LayoutParams).far_m else [])),
    )


def _pieces(item: SceneObject) -> list[Points]:
    """Corners of each convex collider of a free object, in the world."""
    return [
        (item.world_from_object @ link.object_from_link).apply(piece.vertices_link)
        for link in item.links
        for piece in link.pieces
    ]


def _overlap(a: Points, b: np.ndarray) -> bool:
    """Whether two convex hulls share a point: along any direction, one has left the other later than it met it."""
    return all((last_contact(a, b, way) or 0.0) > 0.0 for way in (_UP, -_UP))
