"""One front of a unit: its opening range and its handle."""

from dataclasses import dataclass

import numpy as np

from r2c2r_core.synthetic.kitchen import Handle, HandleKind, Hinge, Leaf
from r2c2r_core.synthetic.looks import Look

_RUNNERS_M = (0.27, 0.30, 0.35, 0.40, 0.45, 0.50, 0.55)  # nominal lengths that makers of runners list
_HINGES_DEG = (95.0, 100.0, 107.0, 110.0)  # openings that makers of concealed hinges list


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """Position and outer bounds of a unit's carcass."""

    x: float
    width_m: float
    bottom: float
    top: float
    depth_m: float  # from the outer face of the fronts to the wall
    upper: bool = False


def drawer_leaf(
    left: float, right: float, row: tuple[float, float], place: Place, look: Look, rng: np.random.Generator
) -> Leaf:
    """A drawer front that opens as far as its runner: full extension, or three quarters of it."""
    low, high = row
    width, height = right - left, high - low
    runners = [length for length in _RUNNERS_M if length < place.depth_m - 0.06]
    travel = runners[-1 - int(rng.integers(2))] * (1.0 if rng.random() < 0.65 else 0.74)
    handle = None
    if look.drawer_handle is not None:
        length = min(handle_length(look.drawer_handle, look), 0.7 * width)
        share = 0.5 if height < 0.2 else float(rng.choice((0.5, 0.72)))
        handle = plain_handle(look.drawer_handle, length, vertical=False, x=width / 2, z=share * height)
    frame = look.frame(height, upper=False)
    return Leaf(
        x=left,
        z=low,
        width_m=width,
        height_m=height,
        hinge=None,
        handle=handle,
        open_limit=round(travel, 3),
        frame=frame,
    )


def door_leaf(
    left: float,
    right: float,
    row: tuple[float, float],
    hinge: Hinge,
    place: Place,
    look: Look,
    rng: np.random.Generator,
) -> Leaf:
    low, high = row
    width, height = right - left, high - low
    angle = float(rng.choice(_HINGES_DEG)) + float(rng.uniform(-2, 2))
    return Leaf(
        x=left,
        z=low,
        width_m=width,
        height_m=height,
        hinge=hinge,
        handle=_door_handle(width, height, hinge, place, look, rng),
        open_limit=round(float(np.radians(angle)), 3),
        frame=look.frame(height, upper=place.upper),
    )


def _door_handle(
    width: float, height: float, hinge: Hinge, place: Place, look: Look, rng: np.random.Generator
) -> Handle | None:
    """A vertical handle at the reachable end of the opening side, or a horizontal one in the middle of that edge."""
    if look.door_handle is None:
        return None
    if look.level_handles:
        length = min(handle_length(look.door_handle, look), 0.6 * width)
        away = float(rng.uniform(0.03, 0.06))
        return plain_handle(look.door_handle, length, vertical=False, x=width / 2, z=away if place.upper else height - away)
    length = min(handle_length(look.door_handle, look), 0.45 * height)
    rail = look.rail_m
    inset = rail / 2 if rail is not None else float(rng.uniform(0.028, 0.07))
    from_end = length / 2 + float(rng.uniform(0.03, 0.09))
    x = inset if hinge == "right" else width - inset
    return plain_handle(look.door_handle, length, vertical=True, x=x, z=from_end if place.upper else height - from_end)


def handle_length(kind: HandleKind, look: Look) -> float:
    return {"knob": 0.032, "cup": 0.095}.get(kind, look.handle_length_m)


def plain_handle(kind: HandleKind, length: float, *, vertical: bool, x: float, z: float) -> Handle:
    thickness = {"bar": 0.012, "flat": 0.014, "bow": 0.011, "knob": 0.032, "cup": 0.042, "finger": 0.03}[kind]
    reach = {"bar": 0.034, "flat": 0.028, "bow": 0.032, "knob": 0.030, "cup": 0.026, "finger": 0.001}[kind]
    return Handle(kind=kind, length_m=length, thickness_m=thickness, reach_m=reach, vertical=vertical, x=x, z=z)
