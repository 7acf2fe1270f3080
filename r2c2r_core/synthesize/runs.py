"""Runs: fronts side by side in one plane. Their shared line is longer, so better measured, than any single front."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from r2c2r_core.arrays import Vector3
from r2c2r_core.failing import spared
from r2c2r_core.geometry.transforms import Rigid3, front_rotation, rotation_about_z
from r2c2r_core.synthesize.dimensions import MeasuredObject
from r2c2r_core.synthesize.edits import moved
from r2c2r_core.synthesize.laps import lap_of
from r2c2r_core.synthesize.solve import Params as SolveParams
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned tolerances of runs."""

    same_direction_rad: float = param(float(np.deg2rad(7.0)), "rad", "Maximum angle between fronts of one direction")
    coplanar_m: float = param(0.015, "m", "Maximum distance between fronts of one plane")
    same_plane_m: float = param(0.002, "m", "Maximum distance between aligned fronts of one plane")
    manhattan_rad: float = param(
        float(np.deg2rad(1.0)),
        "rad",
        "Maximum deviation from the room's dominant direction for that direction to be used instead",
        source="it is measured on all walls",
    )
    parallel_rad: float = param(
        float(np.deg2rad(0.6)),
        "rad",
        "Maximum angle between a free-standing front and a known direction for it to take that direction",
        source="yaw accuracy of a 0.5 m wide front whose ends are known to about 5 mm",
    )
    apart_m: float = param(0.2, "m", "Minimum distance of two fronts, along their run, whose edges tell its slope", gt=0)
    most_slope: float = param(0.045, "ratio", "Maximum slope of a run: steeper steps are fronts of different heights")
    sure: float = param(3.0, "σ", "Minimum slope of a run that is levelled, relative to its standard deviation")
    long_run_m: float = param(0.8, "m", "Minimum length of a run for a line fit to determine its direction")


@dataclass(frozen=True, slots=True)
class _Line:
    """A common direction of fronts."""

    members: list[int]
    yaw_rad: float  # of the outward normal


def align_runs(objects: Sequence[MeasuredObject], manhattan_yaw_rad: float) -> tuple[MeasuredObject, ...]:
    """Built-in fronts of one direction made parallel; those within 1.5 cm of one plane moved onto it.

    A free-standing appliance may have any yaw: it is rotated only where it is parallel within the accuracy of its own narrow
    front.
    """
    params = tuned(Params)
    items = list(objects)
    turned = [i for i, o in enumerate(items) if o.spec.opens != "rigid" and not o.fixed_by_person]
    known: list[float] = []
    for line in _directions(items, [i for i in turned if not items[i].spec.stands]):
        said: list[str] = []
        with spared("its run was not straightened", said):
            yaw = _run_yaw(items, line, manhattan_yaw_rad)
            items = _straightened(items, line, yaw)
            known.append(yaw)
        for i in line.members:
            items[i] = replace(items[i], warnings=(*items[i].warnings, *said))
    known += [manhattan_yaw_rad + quarter * np.pi / 2 for quarter in range(4)]
    for i in (i for i in turned if items[i].spec.stands):
        nearest = next((yaw for yaw in known if abs(_wrapped(yaw - _yaw(items[i]))) < params.parallel_rad), None)
        items[i] = items[i] if nearest is None else _facing(items[i], nearest)
    return tuple(items)


def level_runs(objects: Sequence[MeasuredObject]) -> tuple[list[MeasuredObject], list[str]]:
    """Aligned fronts moved vertically so that the lines of every run are level, and a notice for a person.

    Bent poses and a wrong up direction make stairs of a run, whose fronts stand upright, each about its own middle. The tilt of
    the room that best explains the slopes of all runs moves their fronts and worktops; what it leaves of a run's slope turns
    that run about its middle. The mean height of all fronts stays.
    """
    planes = [plane for plane in coplanar_fronts(objects) if len(plane) > 1]
    slopes = np.array([_slope(objects, plane) for plane in planes])
    if not slopes.any():
        return list(objects), []
    along = np.array([objects[plane[0]].world_from_object.rotation[:2, 0] for plane in planes])
    weights = np.array([weight(item) for item in objects])
    root = np.sqrt([weights[plane].sum() for plane in planes])
    tilt = np.linalg.lstsq(along * root[:, None], -slopes * root, rcond=1e-6)[0]  # the smallest if they do not determine it
    places, fronts = np.array([item.front_centre[:2] for item in objects]), np.concatenate(planes)
    rises = (places - np.average(places[fronts], axis=0, weights=weights[fronts])) @ tilt
    for plane, axis, slope in zip(planes, along, slopes, strict=True):
        middle = np.average(places[plane], axis=0, weights=weights[plane])
        rises[plane] -= (slope + axis @ tilt) * (places[plane] - middle) @ axis
    moving = {*fronts, *(i for i, item in enumerate(objects) if item.spec.opens == "fixed" and not item.fixed_by_person)}
    items = [moved(item, np.array([0.0, 0.0, rises[i]])) if i in moving else item for i, item in enumerate(objects)]
    most_deg, most_mm = np.degrees(np.abs(np.arctan(slopes)).max()), 1000 * np.abs(rises[fronts]).max()
    said = f"fronts slope by up to {most_deg:.1f}° along their runs in the scan: they were levelled, by up to {most_mm:.0f} mm"
    return items, [said]


def _slope(objects: Sequence[MeasuredObject], plane: Sequence[int]) -> float:
    """Slope of the tops and bottoms of a run's fronts along its x axis (Theil-Sen), 0 where it may be a measurement error."""
    params = tuned(Params)
    axis = objects[plane[0]].world_from_object.rotation[:, 0]
    x = np.array([objects[i].front_centre @ axis for i in plane])
    first, second = np.triu_indices(len(plane), 1)
    runs, slopes = np.abs(x[second] - x[first]), list[np.ndarray]()
    for sign in (-0.5, 0.5):
        z = np.array([objects[i].front_centre[2] + sign * objects[i].dimensions_m[2] for i in plane])
        slopes.append((z[second] - z[first]) / np.where(runs > params.apart_m, x[second] - x[first], np.inf))
    found, lengths = np.concatenate(slopes), np.tile(runs, 2)
    likely = (np.abs(found) < params.most_slope) & (lengths > params.apart_m)
    if not likely.any():
        return 0.0
    slope = weighted_median(found[likely], lengths[likely])
    error = tuned(SolveParams).measured_edge_m / (float(np.std(x)) * np.sqrt(2 * len(x)))
    return slope if abs(slope) > params.sure * error else 0.0


def _straightened(objects: Sequence[MeasuredObject], line: _Line, yaw_rad: float) -> list[MeasuredObject]:
    """All objects, those of the line rotated to face `yaw_rad`, and the built-in ones of a plane moved onto it."""
    items = list(objects)
    for i in line.members:
        items[i] = _facing(items[i], yaw_rad)
    outward = np.array([np.cos(yaw_rad), np.sin(yaw_rad), 0.0])
    for plane in _planes(items, [i for i in line.members if built_in(items[i])], outward):
        offset = weighted_median(
            np.array([items[i].front_centre @ outward for i in plane]), np.array([weight(items[i]) for i in plane])
        )
        for i in plane:
            items[i] = moved(items[i], outward * (offset - items[i].front_centre @ outward))
    return items


def _directions(items: Sequence[MeasuredObject], fronts: Sequence[int]) -> list[_Line]:
    """Fronts grouped by direction; the widest and most confident front leads each group."""
    params = tuned(Params)
    left = sorted(fronts, key=lambda i: -weight(items[i]))
    lines: list[_Line] = []
    for i in left:
        yaw = _yaw(items[i])
        near = next((line for line in lines if abs(_wrapped(yaw - line.yaw_rad)) < params.same_direction_rad), None)
        if near is None:
            lines.append(_Line([i], yaw))
        else:
            near.members.append(i)
    return lines


def _run_yaw(items: Sequence[MeasuredObject], line: _Line, manhattan_yaw_rad: float) -> float:
    """Direction of a group: a line fit through its coplanar fronts where the run is long, else their weighted mean."""
    params = tuned(Params)
    weights = np.array([weight(items[i]) * items[i].dimensions_m[0] ** 2 for i in line.members])
    turns = np.array([_wrapped(_yaw(items[i]) - line.yaw_rad) for i in line.members])
    yaw = line.yaw_rad + float(weights @ turns / weights.sum())
    outward = np.array([np.cos(yaw), np.sin(yaw), 0.0])
    planes = _planes(items, [i for i in line.members if built_in(items[i])], outward)
    longest = max(planes, key=lambda plane: _length(items, plane, outward), default=[])
    if len(longest) >= 3 and _length(items, longest, outward) > params.long_run_m:
        fitted = _line_yaw(np.array([items[i].front_centre[:2] for i in longest]), outward)
        if abs(_wrapped(fitted - yaw)) < np.deg2rad(2.0):
            yaw = fitted
    off = (yaw - manhattan_yaw_rad + np.pi / 4) % (np.pi / 2) - np.pi / 4
    return yaw - off if abs(off) < params.manhattan_rad else yaw


def _planes(items: Sequence[MeasuredObject], members: Sequence[int], outward: Vector3) -> list[list[int]]:
    """Members whose front planes lie within 1.5 cm of their group's heaviest one; leaves that pass each other share none."""
    params = tuned(Params)
    left = sorted(members, key=lambda i: -weight(items[i]))
    planes: list[list[int]] = []
    for i in left:
        offset = items[i].front_centre @ outward
        near = (p for p in planes if abs(items[p[0]].front_centre @ outward - offset) < params.coplanar_m)
        home = next((p for p in near if not any(lap_of(items[k], items[i]) for k in p)), None)
        if home is None:
            planes.append([i])
        else:
            home.append(i)
    return planes


def _line_yaw(centres: np.ndarray, outward: Vector3) -> float:
    """Yaw of the normal of the least-squares line through points in plan, on the outward side."""
    _, _, axes = np.linalg.svd(centres - centres.mean(axis=0))
    normal = axes[1] if axes[1] @ outward[:2] > 0 else -axes[1]
    return float(np.arctan2(normal[1], normal[0]))


def _length(items: Sequence[MeasuredObject], plane: Sequence[int], outward: Vector3) -> float:
    along = np.array([-outward[1], outward[0], 0.0])
    positions = [float(items[i].front_centre @ along) for i in plane]
    return max(positions) - min(positions)


def coplanar_fronts(items: Sequence[MeasuredObject]) -> list[list[int]]:
    """Built-in fronts grouped by plane, after `align_runs`."""
    planes: list[list[int]] = []
    for i, item in enumerate(items):
        if not built_in(item) or item.spec.opens == "rigid" or item.fixed_by_person:
            continue
        home = next((p for p in planes if _same_plane(items[p[0]], item)), None)
        if home is None:
            planes.append([i])
        else:
            home.append(i)
    return planes


def _same_plane(a: MeasuredObject, b: MeasuredObject) -> bool:
    apart = float((a.front_centre - b.front_centre) @ a.outward)
    return float(a.outward @ b.outward) > 1 - 1e-6 and abs(apart) < tuned(Params).same_plane_m


def built_in(item: MeasuredObject) -> bool:
    """Whether the object's front belongs to a run: worktops overhang it, free-standing appliances stand independently."""
    return not item.spec.stands and item.spec.opens != "fixed"


def _facing(item: MeasuredObject, yaw_rad: float) -> MeasuredObject:
    """The object rotated about its front's centre to face `yaw_rad`."""
    pivot = item.front_centre
    rotation = rotation_about_z(_wrapped(yaw_rad - _yaw(item)))
    centre = pivot + rotation @ (item.world_from_object.translation - pivot)
    exact = front_rotation(np.array([np.cos(yaw_rad), np.sin(yaw_rad), 0.0]))
    return replace(item, world_from_object=Rigid3(exact, centre))


def weighted_median(values: np.ndarray, weights: np.ndarray) -> float:
    order = np.argsort(values)
    cumulative = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(cumulative, cumulative[-1] / 2)])


def weight(item: MeasuredObject) -> float:
    """Weight of a front: its area, its confidence, and whether the frames or only the mesh measured it."""
    area = float(item.dimensions_m[0] * item.dimensions_m[2])
    return area * max(item.confidence, 0.05) * (1.0 if item.front_measured else 0.2)


def _yaw(item: MeasuredObject) -> float:
    return float(np.arctan2(item.outward[1], item.outward[0]))


def _wrapped(angle_rad: float) -> float:
    return float((angle_rad + np.pi) % (2 * np.pi) - np.pi)
