"""Masses and inertias from panels and densities (sim-ready.md: about the centre of mass, never the identity)."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from r2c2r_core.arrays import Points, Vector3
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.scene import Box, ConvexPiece, Inertial
from r2c2r_core.tuning import param, tuned

_GRAVITY = 9.81  # m/s2


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned bounds of masses and friction."""

    lightest_kg: float = param(0.01, "kg", "Minimum mass of a body", source="lighter bodies make contact solvers stiff", gt=0)
    shut: float = param(
        2.0,
        "ratio",
        "Ratio of a hinge's friction to the torque by which its leaf's weight would open it",
        source="own choice: springs and stays of lift-up doors keep them shut",
        ge=1,
    )


def inertial_of_boxes(boxes: Sequence[Box], density_kg_m3: float) -> Inertial:
    """Mass, centre and inertia of solid boxes, in the link's frame."""
    masses = np.array([max(float(np.prod(box.size_m)) * density_kg_m3, 1e-6) for box in boxes])
    centres = np.array([box.link_from_box.translation for box in boxes])
    own = [_box_inertia(m, box.size_m, box.link_from_box.rotation) for m, box in zip(masses, boxes, strict=True)]
    return _combined(masses, centres, np.array(own))


def inertial_of_pieces(pieces: Sequence[ConvexPiece], density_kg_m3: float) -> Inertial:
    """Mass, centre and inertia of convex solids, in the link's frame."""
    from trimesh.convex import convex_hull

    masses, centres, own = [], [], []
    for piece in pieces:
        hull = convex_hull(piece.vertices_link)
        hull.density = density_kg_m3
        masses.append(max(float(hull.mass), 1e-6))
        centres.append(np.asarray(hull.center_mass))
        own.append(np.asarray(hull.moment_inertia))
    return _combined(np.array(masses), np.array(centres), np.array(own))


def weighing(inertial: Inertial, usual_kg: tuple[float, float] | None) -> Inertial:
    """The same body with its mass scaled into its kind's usual range: coarse colliders enclose air or lack a handle."""
    if usual_kg is None:
        return inertial
    scale = min(max(inertial.mass_kg, usual_kg[0]), usual_kg[1]) / inertial.mass_kg
    return Inertial(mass_kg=inertial.mass_kg * scale, com_link=inertial.com_link, inertia=inertial.inertia * scale)


def friction_shut(friction: float, axis: Vector3, leaf: Inertial) -> float:
    """Hinge friction (N m) that keeps a leaf closed: a leaf hung on its upper outer edge would swing open.

    `axis` is that of opening, the leaf's frame has its origin on it and +Z up.
    """
    weight = np.array([0.0, 0.0, -_GRAVITY * leaf.mass_kg])
    opening = float(axis @ np.cross(leaf.com_link, weight))
    return max(friction, tuned(Params).shut * opening)


def _box_inertia(mass_kg: float, size_m: Vector3, rotation: np.ndarray) -> np.ndarray:
    squares = np.asarray(size_m) ** 2
    return np.asarray(rotation @ np.diag(mass_kg / 12 * (squares.sum() - squares)) @ rotation.T)


def _combined(masses: np.ndarray, centres: Points, own: np.ndarray) -> Inertial:
    """Bodies joined into one by the parallel axis theorem; scaled up below the minimum mass."""
    total = float(masses.sum())
    centre = masses @ centres / total
    arms = centres - centre
    squares = (arms**2).sum(axis=1)
    steiner = np.einsum("n,nij->ij", masses, squares[:, None, None] * np.eye(3) - arms[:, :, None] * arms[:, None, :])
    scale = max(tuned(Params).lightest_kg / total, 1.0)
    inertia = (own.sum(axis=0) + steiner) * scale
    return Inertial(mass_kg=total * scale, com_link=centre, inertia=(inertia + inertia.T) / 2)


def moved_boxes(boxes: Sequence[Box], target_from_source: Rigid3) -> tuple[Box, ...]:
    """The boxes expressed in another frame."""
    return tuple(replace(box, link_from_box=target_from_source @ box.link_from_box) for box in boxes)
