"""Hinge side of each fixture from the handle, the neighbours or the category; a person's choice takes precedence.

For a sliding leaf the side is the direction it slides to: away from its pull as for a hinge, or over the only leaf that it
passes.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import log

import numpy as np

from r2c2r_core.calibration import FITTED, calibrated
from r2c2r_core.failing import spared
from r2c2r_core.model.inputs import HingeSide, Overrides
from r2c2r_core.model.motion import Source
from r2c2r_core.synthesize.dimensions import MeasuredObject
from r2c2r_core.synthesize.filmed import side_filmed
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the choice of hinge sides."""

    off_centre: float = param(
        0.2,
        "share",
        "Minimum offset of a handle from the middle, relative to half the width, for it to indicate a side",
        source="backends.md 2.8: handles at 0.38-0.56 were ambiguous",
    )
    flap_wide: float = param(1.15, "ratio", "Minimum ratio of width to height of a flap")
    flap_low: float = param(0.4, "share", "Minimum offset of a flap's handle below the middle, relative to half the height")
    adjacent_m: float = param(0.06, "m", "Maximum gap between two doors that may open as a pair")
    certain_off_centre: float = param(
        0.6,
        "share",
        "Offset of a handle from the middle, relative to half the width, above which its side is certain",
        gt=0,
        le=1,
    )
    slope: float = param(0.92, "ratio", "Slope of the Platt calibration of log-odds", source=FITTED, gt=0)
    offset: float = param(1.53, "log", "Offset of the Platt calibration of log-odds", source=FITTED, ge=-10, le=10)
    seen_open: float = param(0.98, "score", "Confidence, 0 to 1, in the side of a leaf that several frames show open")
    in_pairs: float = param(
        0.75, "score", "Confidence, 0 to 1, that doors without an informative handle open as a pair", source="a stated guess"
    )

    past_leaf: float = param(
        0.95,
        "score",
        "Confidence, 0 to 1, that a leaf slides past the only one beside it",
        source="a stated guess: its unit leaves no other direction, if both are leaves",
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Hinge:
    """The hinge side of a single door, its source, and a reason in one phrase."""

    side: HingeSide
    source: Source
    reason: str
    confidence: float | None  # 0..1; None where the category leaves no choice
    by_handle: bool = False  # observed from its handle or from the open door: neighbours do not override it


def choose_hinges(objects: Sequence[MeasuredObject], overrides: Overrides) -> dict[str, Hinge]:
    """The hinge of every object with a single door."""
    params = tuned(Params)
    hinges: dict[str, Hinge] = {}
    undecided: list[MeasuredObject] = []
    for item in objects:
        if item.spec.opens not in ("side", "bottom", "sideways"):
            continue
        asked = overrides.of(item.name).hinge
        said, seen = list[str](), None
        with spared("its handle was not examined", said):
            seen = _side_seen(item)
        if said:
            seen = _by_category(item, said[0])
        if asked is not None:
            hinges[item.name] = Hinge(side=asked, source="person", reason="given by a person", confidence=1.0)
        elif (side := side_filmed(item)) is not None:
            reason = f"filmed open on its {side} edge"
            hinges[item.name] = Hinge(side=side, source="measured", reason=reason, confidence=params.seen_open, by_handle=True)
        elif seen is not None:
            hinges[item.name] = seen
        elif item.spec.opens == "bottom":
            hinges[item.name] = Hinge(side="bottom", source="inferred", reason="the category opens downwards", confidence=None)
        elif item.spec.opens == "sideways" or item.spec.hinge_share > params.in_pairs:
            hinges[item.name] = _by_category(item, "nothing in the scan tells the side")
        else:
            undecided.append(item)
    for item in sorted(undecided, key=lambda o: _along(o, o)):
        said = []
        with spared("its neighbours were not examined", said):
            hinges[item.name] = _from_neighbours(item, objects, hinges)
        if said:
            hinges[item.name] = _by_category(item, said[0])
    return hinges


def _side_seen(item: MeasuredObject) -> Hinge | None:
    """Hinge from observations of the object itself; None without any, or where there is no choice."""
    if item.spec.opens == "bottom":
        return None
    return _past_leaf(item) or handle_hinge(item)


def _past_leaf(item: MeasuredObject) -> Hinge | None:
    """Sliding direction over the only neighbouring leaf: on the other side its unit ends."""
    others = {lap.side: lap.other for lap in item.laps}
    if len(others) != 1:
        return None
    ((side, other),) = others.items()
    return Hinge(
        side=side, source="inferred", reason=f"slides past {other}", confidence=tuned(Params).past_leaf, by_handle=True
    )


def handle_hinge(item: MeasuredObject) -> Hinge | None:
    """The hinge opposite a handle that is clearly on one side; a low centred bar on a wall flap means top."""
    params = tuned(Params)
    handle = item.handle
    if handle is None:
        return None
    half = item.dimensions_m[[0, 2]] / 2
    x, z = handle.centre
    if abs(x) >= params.off_centre * half[0]:
        side: HingeSide = "left" if x > 0 else "right"
        trust = handle.confidence * min(abs(x) / (params.certain_off_centre * half[0]), 1.0)
        reason = f"the handle is on the {'right' if x > 0 else 'left'}"
        right = _of_its_kind(item, side, _worth(float(trust)))
        if right < 0.5:
            return _by_category(item, f"{reason}, weakly, but nearly all are hinged there", 1 - right)
        return Hinge(side=side, source="inferred", reason=reason, confidence=right, by_handle=True)
    wide = item.dimensions_m[0] > params.flap_wide * item.dimensions_m[2]
    if item.spec.flap and wide and not handle.is_vertical and z < -params.flap_low * half[1]:
        reason = "a wide flap with its handle at the lower edge"
        return Hinge(side="top", source="inferred", reason=reason, confidence=_worth(handle.confidence), by_handle=True)
    return None


def _worth(trust: float) -> float:
    """Calibrated probability that the side indicated by a handle is right; its confidence (0..1) is mapped to 0.5..1 first."""
    params = tuned(Params)
    return calibrated(0.5 + 0.5 * trust, params.slope, params.offset)


def _of_its_kind(item: MeasuredObject, side: HingeSide, seen: float) -> float:
    """Posterior probability of a side from the observation (0..1) and the category's prior (Bayes' rule)."""
    usual = item.spec.hinge_share if side == item.spec.hinge else 1 - item.spec.hinge_share
    return calibrated(seen, 1.0, log(usual / (1 - usual)))


def _from_neighbours(item: MeasuredObject, objects: Sequence[MeasuredObject], hinges: dict[str, Hinge]) -> Hinge:
    """The side that makes a pair with a neighbour (pairs open outwards), else the category's."""
    params = tuned(Params)
    left, right = _neighbour(item, objects, -1.0), _neighbour(item, objects, 1.0)
    if left is not None and _side(left, hinges) == "left" and not _paired(left, item, objects, hinges, -1.0):
        return Hinge(side="right", source="inferred", reason=f"opens as a pair with {left.name}", confidence=params.in_pairs)
    if right is not None and _side(right, hinges) == "right":
        return Hinge(side="left", source="inferred", reason=f"opens as a pair with {right.name}", confidence=params.in_pairs)
    if left is None and right is not None and _side(right, hinges) is None:
        return Hinge(side="left", source="inferred", reason=f"opens as a pair with {right.name}", confidence=params.in_pairs)
    return _by_category(item, "nothing in the scan tells the side")


def _by_category(item: MeasuredObject, reason: str, confidence: float | None = None) -> Hinge:
    assert item.spec.hinge is not None  # of every category with a single door
    return Hinge(side=item.spec.hinge, source="default", reason=reason, confidence=confidence or item.spec.hinge_share)


def _paired(
    left: MeasuredObject, item: MeasuredObject, objects: Sequence[MeasuredObject], hinges: dict[str, Hinge], sign: float
) -> bool:
    """Whether the left neighbour already has a partner on its other side."""
    beyond = _neighbour(left, objects, sign)
    return beyond is not None and beyond is not item and _side(beyond, hinges) == "left" and _side(left, hinges) == "right"


def _side(item: MeasuredObject, hinges: dict[str, Hinge]) -> HingeSide | None:
    return hinges[item.name].side if item.name in hinges else None


def _neighbour(item: MeasuredObject, objects: Sequence[MeasuredObject], sign: float) -> MeasuredObject | None:
    """The adjacent single-door front on one side (+1 right, -1 left): same plane, same height, within 6 cm."""
    params = tuned(Params)
    for other in objects:
        if other is item or other.spec is not item.spec or float(other.outward @ item.outward) < 0.97:
            continue
        offset = item.world_from_object.rotation.T @ (other.front_centre - item.front_centre)
        gap = sign * offset[0] - (item.dimensions_m[0] + other.dimensions_m[0]) / 2
        level = abs(offset[2]) < 0.06 and abs(item.dimensions_m[2] - other.dimensions_m[2]) < 0.08
        if abs(gap) < params.adjacent_m and abs(offset[1]) < 0.05 and level:
            return other
    return None


def _along(item: MeasuredObject, reference: MeasuredObject) -> float:
    """Position along the run, left to right as seen by a person facing it."""
    return float(np.cross(-item.outward, [0.0, 0.0, 1.0]) @ item.front_centre)
