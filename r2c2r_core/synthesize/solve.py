"""Layout as a constrained least-squares problem: the minimum change of all faces that satisfies the furniture constraints.

Unknowns are the six faces of every object along its own axes; each counts in units of its measurement uncertainty. Hard
constraints: faces on one line, plane or seam (ties), what a person fixed, limits on size changes, the floor; overlapping pairs
keep their gap along the axis on which that is cheapest, to a tenth of a millimetre.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from r2c2r_core.arrays import Vector3
from r2c2r_core.failing import spared
from r2c2r_core.geometry.graphs import components
from r2c2r_core.geometry.least_change import least_change
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.synthesize.dimensions import MeasuredObject
from r2c2r_core.synthesize.filmed import side_filmed
from r2c2r_core.tuning import param, tuned

_FIXED_M = 1e-6
_SOFT_M = 1e-5  # slack of an infeasible bound
_SPARE_M = 1e-4
_UPRIGHT = 0.9999  # cosine of a tilt of 0.8 degrees


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned uncertainties of faces for the layout."""

    measured_edge_m: float = param(
        0.005,
        "m",
        "Standard deviation of a front's edges, measured over all frames",
    )
    wrong_edge_m: float = param(
        0.05,
        "m",
        "Standard deviation of a front's edge that was found in a wrong place",
        source="rails, strips: 3-10 cm",
    )
    hinged_edge: float = param(0.98, "share", "Probability of an edge at which the front was filmed to turn", ge=0, le=1)
    mesh_edge_m: float = param(0.012, "m", "Standard deviation of a front's edges, measured on the mesh alone")
    plane_m: float = param(0.003, "m", "Standard deviation of a front's plane")
    unseen_m: float = param(0.15, "m", "Standard deviation of an unobserved back")
    appliance_m: float = param(0.05, "m", "Standard deviation of an appliance's position: it yields to built-in furniture")
    thing_m: float = param(0.15, "m", "Standard deviation of a free object's position")
    appliance_trim_m: float = param(0.004, "m", "Maximum change of an appliance's size: it moves rather than shrinks")
    trim_m: float = param(0.012, "m", "Maximum change of a size", source="backends.md 2.9: an edge is measured to about 8 mm")
    trim_share: float = param(0.025, "share", "Maximum change of a size relative to it")
    least_depth_share: float = param(0.6, "share", "Minimum fraction of an unobserved depth that must remain")


class Face(NamedTuple):
    """A face of an object: its index, the axis of its own frame, and the side on it (-1, +1)."""

    item: int
    axis: int
    sign: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Tie:
    """Equality of two faces of objects with equal orientation: the second lies `gap_m` beyond the first, along the axis."""

    first: Face
    second: Face
    gap_m: float = 0.0


def solved(
    measured: Sequence[MeasuredObject], ties: Sequence[Tie], apart: Sequence[tuple[int, int]], gap_m: float
) -> list[MeasuredObject]:
    """The objects after the minimum change that satisfies `ties`, with a gap between the pairs in `apart`."""
    items = list(measured)
    for group in groups(len(items), [*((t.first.item, t.second.item) for t in ties), *apart]):
        place = {item: k for k, item in enumerate(group)}
        own_ties = [_renumbered(tie, place) for tie in ties if tie.first.item in place]
        own_pairs = [(place[a], place[b]) for a, b in apart if a in place]
        said, found = list[str](), [items[k] for k in group]
        with spared("it was not fitted to its neighbours", said):
            found = _solved(found, own_ties, own_pairs, gap_m)
        for k, item in zip(group, found, strict=True):
            items[k] = replace(item, warnings=(*item.warnings, *said))
    return items


def strain(items: Sequence[MeasuredObject], pair: tuple[int, int], gap_m: float) -> float:
    """Overlap of two objects in standard deviations of measurement, along the axis on which that is least."""
    faces = np.concatenate([_faces(item) for item in items])
    sigma = np.concatenate([_measured_sigmas(item) for item in items])
    row, overlap = _separation(items, pair, faces, sigma, gap_m)
    return _cost(items, -row, overlap, sigma)


def _solved(
    items: Sequence[MeasuredObject], ties: Sequence[Tie], apart: Sequence[tuple[int, int]], gap_m: float
) -> list[MeasuredObject]:
    """The solution for one connected group of objects."""
    sigma = np.concatenate([_sigmas(item) for item in items])
    faces = np.concatenate([_faces(item) for item in items])
    equal, equal_to = np.zeros((len(ties), len(sigma))), np.zeros(len(ties))
    for row, tie in enumerate(ties):
        first, second = _column(tie.first), _column(tie.second)
        equal[row, second], equal[row, first] = 1.0, -1.0
        equal_to[row] = tie.gap_m - (faces[second] - faces[first])
    bounds = [bound for index, item in enumerate(items) for bound in _size_bounds(index, item, len(sigma))]
    bounds += [_floor_bound(index, faces) for index, item in enumerate(items) if _is_upright(item)]
    bounds += [_separation(items, pair, faces, sigma, gap_m) for pair in apart]
    rows, needed = np.array([row for row, _ in bounds]), np.array([least for _, least in bounds])
    slack = np.eye(len(rows)) * _SOFT_M
    no_slack = np.zeros((len(ties), len(rows)))
    y = least_change(np.hstack([equal * sigma, no_slack]), equal_to, np.hstack([rows * sigma, slack]), needed)
    changed = faces + sigma * y[: len(sigma)]
    return [item if item.fixed_by_person else _with_faces(item, changed[6 * k : 6 * k + 6]) for k, item in enumerate(items)]


def groups(count: int, links: Sequence[tuple[int, int]]) -> list[list[int]]:
    """Connected components of ties and overlaps; isolated objects are left out."""
    if not links:
        return []
    label = components(count, np.array(links))
    groups = [np.flatnonzero(label == number).tolist() for number in np.unique(label)]
    return [group for group in groups if len(group) > 1]


def _renumbered(tie: Tie, place: Mapping[int, int]) -> Tie:
    first, second = (face._replace(item=place[face.item]) for face in (tie.first, tie.second))
    return Tie(first=first, second=second, gap_m=tie.gap_m)


def _faces(item: MeasuredObject) -> np.ndarray:
    """Low and high face along each own axis: (x-, x+, y-, y+, z-, z+), metres from the world's origin."""
    centre = item.world_from_object.rotation.T @ item.world_from_object.translation
    return np.column_stack([centre - item.dimensions_m / 2, centre + item.dimensions_m / 2]).ravel()


def _with_faces(item: MeasuredObject, faces: np.ndarray) -> MeasuredObject:
    low, high = faces[0::2], faces[1::2]
    rotation = item.world_from_object.rotation
    return replace(item, dimensions_m=high - low, world_from_object=Rigid3(rotation, rotation @ ((low + high) / 2)))


def _sigmas(item: MeasuredObject) -> np.ndarray:
    """Standard deviation of each face for the solver."""
    params = tuned(Params)
    if item.fixed_by_person:
        return np.full(6, _FIXED_M)
    if item.spec.opens == "rigid":
        return np.full(6, params.thing_m)
    if item.spec.stands:
        return np.full(6, params.appliance_m)
    return _measured_sigmas(item)


def _measured_sigmas(item: MeasuredObject) -> np.ndarray:
    """Measurement standard deviation of each face, regardless of what yields more easily."""
    params = tuned(Params)
    if item.spec.opens == "rigid":
        return np.full(6, params.thing_m)
    edge = params.measured_edge_m if item.front_measured else params.mesh_edge_m
    back = params.unseen_m if _unseen_back(item) else edge
    left, right, top, bottom = _edge_sigmas(item) if item.edges else np.full(4, edge)
    return np.array([left, right, params.plane_m, back, bottom, top])


def _edge_sigmas(item: MeasuredObject) -> np.ndarray:
    """Standard deviations (4,) of a front's left, right, top and bottom edge: each is right or in a wrong place."""
    params, hinged = tuned(Params), side_filmed(item)
    turns = any(motion.kind == "revolute" for motion in item.motions)
    right = np.array(
        [
            max(p, params.hinged_edge) if turns and side == hinged else p
            for side, p in zip(("left", "right", "top", "bottom"), item.edges, strict=True)
        ]
    )
    return np.asarray(np.sqrt(right * params.measured_edge_m**2 + (1 - right) * params.wrong_edge_m**2))


def _size_bounds(index: int, item: MeasuredObject, unknowns: int) -> list[tuple[np.ndarray, float]]:
    """Rows and bounds that keep each size near its measurement; an unobserved depth may shrink but not grow."""
    bounds = []
    for axis in range(3):
        row = np.zeros(unknowns)
        row[6 * index + 2 * axis + 1], row[6 * index + 2 * axis] = 1.0, -1.0
        bounds += [(row, -_shrink(item, axis)), (-row, -_trim(item, axis))]
    return bounds


def _is_upright(item: MeasuredObject) -> bool:
    return not item.fixed_by_person and float(item.world_from_object.rotation[2, 2]) > _UPRIGHT


def _floor_bound(index: int, faces: np.ndarray) -> tuple[np.ndarray, float]:
    """Row and bound that keep an upright object's underside above the floor, or above its measured height below it."""
    row, underside = np.zeros(len(faces)), 6 * index + 4
    row[underside] = 1.0
    return row, -max(float(faces[underside]), 0.0)


def _trim(item: MeasuredObject, axis: int) -> float:
    """Maximum error of a measured size."""
    params = tuned(Params)
    if item.spec.opens == "rigid" or item.fixed_by_person:
        return 0.0
    usual = min(
        params.appliance_trim_m if item.spec.stands else params.trim_m, params.trim_share * float(item.dimensions_m[axis])
    )
    if not item.edges or axis == 1:
        return usual
    variances = _measured_sigmas(item)[2 * axis : 2 * axis + 2] ** 2
    return usual + float(np.sqrt(max(variances.sum() - 2 * params.measured_edge_m**2, 0.0)))


def _shrink(item: MeasuredObject, axis: int) -> float:
    """Maximum reduction of a size."""
    size = float(item.dimensions_m[axis])
    if axis == 1 and _unseen_back(item):
        return max(size - max(tuned(Params).least_depth_share * size, min(item.spec.depth.low, size)), _trim(item, axis))
    return _trim(item, axis)


def _unseen_back(item: MeasuredObject) -> bool:
    return item.sources[1] in ("inferred", "default") and item.spec.opens != "rigid" and not item.fixed_by_person


def _separation(
    items: Sequence[MeasuredObject], pair: tuple[int, int], faces: np.ndarray, sigma: np.ndarray, gap_m: float
) -> tuple[np.ndarray, float]:
    """The row that separates two objects along the direction of least cost in standard deviations."""
    first, second = pair
    options = []
    for a, b in ((first, second), (second, first)):
        for axis in range(3):
            direction = items[a].world_from_object.rotation[:, axis]
            towards = items[b].world_from_object.translation - items[a].world_from_object.translation
            outwards = direction if float(direction @ towards) >= 0 else -direction
            row = _reach(a, items[a], outwards, len(faces)) + _reach(b, items[b], -outwards, len(faces))
            overlap = float(row @ faces) + gap_m + _SPARE_M
            options.append((_cost(items, row, overlap, sigma), -row, overlap))
    _, row, overlap = min(options, key=lambda option: option[0])
    return row, overlap


def _cost(items: Sequence[MeasuredObject], row: np.ndarray, overlap_m: float, sigma: np.ndarray) -> float:
    """Standard deviations needed to resolve an overlap: unobserved backs yield first, up to their limit; then fronts move."""
    backs = 6 * np.arange(len(items)) + 3
    spare = np.array([_shrink(item, 1) if _unseen_back(item) else 0.0 for item in items])
    beyond = max(overlap_m - float(np.abs(row[backs]) @ spare), 0.0)
    firm = sigma.copy()
    firm[backs] = np.minimum(firm[backs], sigma[backs - 1])
    return (overlap_m - beyond) / float(np.linalg.norm(row * sigma)) + beyond / float(np.linalg.norm(row * firm))


def _reach(index: int, item: MeasuredObject, direction: Vector3, unknowns: int) -> np.ndarray:
    """Row of the support function of an object's box along a world direction, linear in its faces."""
    row = np.zeros(unknowns)
    along = item.world_from_object.rotation.T @ direction
    for axis in range(3):
        row[6 * index + 2 * axis + int(along[axis] > 0)] = along[axis]
    return row


def _column(face: Face) -> int:
    return 6 * face.item + 2 * face.axis + int(face.sign > 0)
