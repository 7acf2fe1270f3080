"""Fillers at inside corners, which segmentation tends to assign to the door beside them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from r2c2r_core.failing import spared
from r2c2r_core.kitchen.fillers import FrontBox, missing_filler
from r2c2r_core.synthesize.dimensions import MeasuredObject
from r2c2r_core.synthesize.edits import edge_moved
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned limits of fillers assigned to a door."""

    most_m: float = param(0.10, "m", "Maximum width of a filler")
    most_share: float = param(0.2, "share", "Maximum fraction of the width that may be a filler: more would be another error")


def leave_fillers(objects: Sequence[MeasuredObject]) -> list[MeasuredObject]:
    """The objects with side edges of fronts moved back from the front plane of a perpendicular run that they reach."""
    result = []
    for item in objects:
        said: list[str] = []
        with spared("the search for a filler beside it failed", said):
            item = _without_fillers(item, objects)
        result.append(replace(item, warnings=(*item.warnings, *said)))
    return result


def _without_fillers(item: MeasuredObject, objects: Sequence[MeasuredObject]) -> MeasuredObject:
    params = tuned(Params)
    for sign in (-1.0, 1.0):
        for other in objects:
            excess = _excess(item, sign, other)
            if 0 < excess <= min(params.most_m, params.most_share * item.dimensions_m[0]):
                item = _drawn_in(item, sign, excess, other.name)
    return item


def _excess(item: MeasuredObject, sign: float, other: MeasuredObject) -> float:
    """Width by which an edge violates the filler at the other's front plane; 0 where they do not meet."""
    if item is other or not (_is_front(item) and _is_front(other)) or item.fixed_by_person:
        return 0.0
    unit, beside = (FrontBox(each.world_from_object, each.dimensions_m) for each in (item, other))
    return missing_filler(unit, sign, beside)


def _is_front(item: MeasuredObject) -> bool:
    return item.spec.opens not in ("rigid", "fixed") and item.front_measured


def _drawn_in(item: MeasuredObject, sign: float, amount_m: float, other: str) -> MeasuredObject:
    warning = f"{1000 * amount_m:.0f} mm of its width left as the filler at the corner with {other}"
    narrower = _without_handle_beside(edge_moved(item, 0, sign, amount_m))
    _, depth_source, height_source = item.sources
    return replace(narrower, sources=("inferred", depth_source, height_source), warnings=(*narrower.warnings, warning))


def _without_handle_beside(item: MeasuredObject) -> MeasuredObject:
    """The door without a handle that lies on its filler: the shadow in a corner resembles a vertical bar."""
    if item.handle is None or abs(item.handle.centre[0]) < item.dimensions_m[0] / 2:
        return item
    return replace(item, handle=None, warnings=(*item.warnings, "its supposed handle is on the filler: left out"))
