"""Lines that the fronts of a run share: their tops, their bottoms, and the seams between them.

A seam measured from both sides is known better than either edge: n + 1 seams instead of 2 n edges take the width error
from 1.7 to 1.4 % and overlaps to nothing (backends.md 2.9). Only what measuring can be wrong by is corrected.
"""

from collections.abc import Sequence

import numpy as np

from r2c2r_core.synthesize.dimensions import MeasuredObject
from r2c2r_core.synthesize.edits import trimmed
from r2c2r_core.synthesize.fixtures.spec import FRONT_GAP_M
from r2c2r_core.synthesize.runs import built_in, weight, weighted_median

_LINE_M = 0.02  # tops within this of each other are one line
_SEAM_M = (-0.010, 0.011)  # edges that overlap or stand apart by this much are one seam; real gaps are 2-4 mm
_COPLANAR_M = 0.002


def share_lines(objects: Sequence[MeasuredObject]) -> tuple[MeasuredObject, ...]:
    """Fronts of one plane with common tops and bottoms, and one gap at each seam."""
    items = list(objects)
    for plane in _coplanar(items):
        for sign in (1.0, -1.0):
            _level(items, plane, sign)
        for axis in (0, 2):
            _close_seams(items, plane, axis)
    return tuple(items)


def _coplanar(items: Sequence[MeasuredObject]) -> list[list[int]]:
    """Built-in fronts in one plane, as the runs left them."""
    planes: list[list[int]] = []
    for i, item in enumerate(items):
        if not built_in(item) or item.spec.opening == "rigid" or item.fixed_by_person:
            continue
        home = next((p for p in planes if _same_plane(items[p[0]], item)), None)
        if home is None:
            planes.append([i])
        else:
            home.append(i)
    return planes


def _same_plane(a: MeasuredObject, b: MeasuredObject) -> bool:
    apart = float((a.front_centre - b.front_centre) @ a.outward)
    return float(a.outward @ b.outward) > 1 - 1e-6 and abs(apart) < _COPLANAR_M


def _level(items: list[MeasuredObject], plane: Sequence[int], sign: float) -> None:
    """Tops (+1) or bottoms (-1) within 2 cm of each other put on one line."""
    left = sorted(plane, key=lambda i: _edge(items[i], 2, sign))
    while left:
        first = _edge(items[left[0]], 2, sign)
        line = [i for i in left if _edge(items[i], 2, sign) - first <= _LINE_M]
        left = left[len(line) :]
        heights, weights = (np.array([f(items[i]) for i in line]) for f in (lambda o: _edge(o, 2, sign), weight))
        target = weighted_median(heights, weights)
        for i in line:
            items[i] = _with_edge(items[i], 2, sign, target)


def _close_seams(items: list[MeasuredObject], plane: Sequence[int], axis: int) -> None:
    """One gap of 3 mm where the edges of two neighbours nearly meet; each edge takes part in one seam."""
    across = 2 if axis == 0 else 0
    for i in plane:
        for j in plane:
            a, b = items[i], items[j]
            gap = _edge(b, axis, -1.0) - _edge(a, axis, 1.0)
            if i == j or not _SEAM_M[0] < gap < _SEAM_M[1] or not _beside(a, b, across):
                continue
            middle = (_edge(b, axis, -1.0) + _edge(a, axis, 1.0)) / 2
            items[i] = _with_edge(a, axis, 1.0, middle - FRONT_GAP_M / 2)
            items[j] = _with_edge(b, axis, -1.0, middle + FRONT_GAP_M / 2)


def _beside(a: MeasuredObject, b: MeasuredObject, across: int) -> bool:
    """Whether two fronts share at least half of the shorter one's side."""
    shared = min(_edge(a, across, 1.0), _edge(b, across, 1.0)) - max(_edge(a, across, -1.0), _edge(b, across, -1.0))
    return shared > 0.5 * min(float(a.dimensions_m[across]), float(b.dimensions_m[across]))


def _edge(item: MeasuredObject, axis: int, sign: float) -> float:
    """Position of a face along the object's own axis, in the world."""
    return float(
        item.world_from_object.translation @ item.world_from_object.rotation[:, axis] + sign * item.dimensions_m[axis] / 2
    )


def _with_edge(item: MeasuredObject, axis: int, sign: float, position: float) -> MeasuredObject:
    """The object with one face moved to `position`, the opposite one left where it is."""
    return trimmed(item, axis, sign, sign * (_edge(item, axis, sign) - position))
