"""Inside corners: where two runs meet, kitchens keep a filler so that the doors clear each other.

A front cannot reach behind the plane of the run it meets, and a door that ended at that plane would not open past the other
run's handles. Segmentation tends to count the filler to the door; here the door gives it back.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from r2c2r_core.synthesize.dimensions import MeasuredObject
from r2c2r_core.synthesize.edits import trimmed

FILLER_M = 0.05  # corner fillers of kitchen catalogues are 40-80 mm; a bar handle stands out 25-40 mm
_MOST_M = 0.10
_MOST_SHARE = 0.2  # of the width: more would be another mistake than a filler
_PERPENDICULAR = np.cos(np.deg2rad(70.0))


def leave_fillers(objects: Sequence[MeasuredObject]) -> list[MeasuredObject]:
    """The objects, side edges of fronts drawn back from the front plane of a perpendicular run they run into."""
    result = []
    for item in objects:
        for sign in (-1.0, 1.0):
            for other in objects:
                excess = _excess(item, sign, other)
                if 0 < excess <= min(_MOST_M, _MOST_SHARE * item.dimensions_m[0]):
                    item = _drawn_in(item, sign, excess, other.name)
        result.append(item)
    return result


def _excess(item: MeasuredObject, sign: float, other: MeasuredObject) -> float:
    """By how much the edge on one side comes nearer to the other's front plane than a filler; 0 where they do not meet."""
    if item is other or not (_is_front(item) and _is_front(other)) or item.fixed_by_person:
        return 0.0
    along = sign * item.world_from_object.rotation[:, 0]
    if float(other.outward @ -along) < 1 - _PERPENDICULAR:  # the other run does not face this edge
        return 0.0
    edge = item.front_centre + along * item.dimensions_m[0] / 2
    from_other = other.world_from_object.inverse.apply(edge[None])[0]
    distance = -other.dimensions_m[1] / 2 - from_other[1]  # of the edge in front of the other's front plane
    beside = abs(from_other[0]) < other.dimensions_m[0] / 2 + FILLER_M
    level = abs(from_other[2]) < (item.dimensions_m[2] + other.dimensions_m[2]) / 2
    return max(FILLER_M - float(distance), 0.0) if beside and level else 0.0


def _is_front(item: MeasuredObject) -> bool:
    return item.spec.opening not in ("rigid", "fixed") and item.front_measured


def _drawn_in(item: MeasuredObject, sign: float, amount_m: float, other: str) -> MeasuredObject:
    handle = item.handle
    if handle is not None:  # it stays where it is while the front's centre moves
        shift = sign * amount_m / 2
        handle = replace(handle, left_m=handle.left_m + shift, right_m=handle.right_m + shift)
    warning = f"{1000 * amount_m:.0f} mm of its width left as the filler at the corner with {other}"
    narrower = trimmed(item, 0, sign, amount_m)
    _, depth_source, height_source = item.sources
    return replace(
        narrower, handle=handle, sources=("inferred", depth_source, height_source), warnings=(*item.warnings, warning)
    )
