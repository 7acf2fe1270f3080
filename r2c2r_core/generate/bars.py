"""Reconstruction of open frames (such as garden chairs): observed depth points thickened to bars, free space elsewhere.

Carving needs every mask to contain every bar: a bar missed by a few masks is carved away. Here depth points vote for occupied
cells instead.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from r2c2r_core.arrays import Points
from r2c2r_core.generate.carved import Carving
from r2c2r_core.generate.evidence import View, depth_mask
from r2c2r_core.geometry.camera import depth_points
from r2c2r_core.geometry.graphs import components
from r2c2r_core.geometry.visibility import look_up
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the reconstruction of open frames."""

    cell_m: float = param(0.01, "m", "Side of the cells in which depth points are counted", gt=0)
    half_m: float = param(
        0.011, "m", "Half the thickness of a bar, for surfaces seen from one side only", source="noise of a phone's LiDAR"
    )
    least_views: int = param(2, "count", "Minimum number of views that see a cell occupied", ge=1)
    agreed: float = param(0.25, "share", "Minimum fraction of the views that observe a cell which must see it occupied")
    through_m: float = param(
        0.03, "m", "Distance behind a cell, beyond the depth noise, at which a view's depth shows the cell to be free"
    )
    least_cells: int = param(12, "count", "Minimum number of cells of a connected piece for it to be kept", ge=1)
    gap_m: float = param(
        0.10, "m", "Maximum gap between two pieces of one object that is bridged: sensors miss dark and thin parts"
    )
    symmetric: float = param(
        0.7, "share", "Minimum fraction of cells with a mirror twin for missing legs to be completed by symmetry"
    )
    twin_m: float = param(0.04, "m", "Maximum distance between a cell's mirror image and its twin")
    apart_m: float = param(0.09, "m", "Minimum distance between two legs: a nearer mirror image is the same leg seen twice")
    lower: float = param(0.45, "share", "Fraction of the height below which legs are expected")
    foot_m: float = param(0.15, "m", "Height above the floor below which a bar is extended down to the floor")
    off_floor_m: float = param(0.03, "m", "Height above the floor above which depth outside the masks is not the floor")
    leg_cell_m: float = param(0.02, "m", "Side of the cells in which depth points of unmasked legs are counted", gt=0)
    level_m: float = param(0.03, "m", "Height interval over which the width of an unmasked leg is measured", gt=0)
    slender_m: float = param(0.10, "m", "Maximum width of an unmasked leg, at every height")
    tall: float = param(
        0.5,
        "share",
        "Minimum height of a leg that masks or depth missed, relative to the height below which legs are expected",
    )


class Bars(NamedTuple):
    """Distance to the thickened depth points on a carving's grid (positive outside), and the fraction that mirroring added."""

    field: np.ndarray
    mirrored: float  # fraction


def find_bars(carving: Carving, views: Sequence[View]) -> Bars | None:
    """Thickened depth points with missing legs completed; None with too few points."""
    params = tuned(Params)
    cells = _in_one_piece(_seen_cells(carving, views, _in_mask, params.cell_m), params.cell_m)
    if len(cells) < params.least_cells:
        return None
    seen, floor = carving.seen, carving.seen.floor
    if floor is not None:
        cells = _in_one_piece(np.concatenate([cells, _unmasked_legs(carving, views, floor)]), params.cell_m)
    count = len(cells)
    if floor is not None:
        cells = _in_one_piece(np.concatenate([cells, _lost_legs(cells, floor, float(seen.high[2]))]), params.cell_m)
    mirrored = max(len(cells) - count, 0) / len(cells)
    if floor is not None:
        cells = np.concatenate([cells, *_feet(cells, floor)])
    from scipy.spatial import cKDTree

    centres = carving.grid.centres()
    away, _ = cKDTree(cells).query(centres, distance_upper_bound=4 * params.half_m)
    beyond = np.maximum(seen.low - centres, centres - seen.high).max(axis=1)  # thickness goes inwards from its ends
    field = np.maximum(np.minimum(away, 4 * params.half_m) - params.half_m, np.minimum(beyond, 4 * params.half_m))
    return Bars(field.reshape(carving.grid.shape), mirrored)


def _lost_legs(cells: Points, floor: float, top: float) -> Points:
    """Mirror images of the lower cells in empty space, about the best upright plane of symmetry."""
    from scipy.spatial import cKDTree

    params = tuned(Params)
    tree = cKDTree(cells)
    middle = (np.quantile(cells, 0.01, axis=0) + np.quantile(cells, 0.99, axis=0)) / 2
    best, lost = params.symmetric, cells[:0]
    for axis in (0, 1):
        twins = cells.copy()
        twins[:, axis] = 2 * middle[axis] - twins[:, axis]
        away, _ = tree.query(twins)
        share = float((away < params.twin_m).mean())
        if share > best:
            best = share
            lost = twins[(away > params.apart_m) & (twins[:, 2] < floor + params.lower * (top - floor))]
    return np.concatenate([cells[:0], *_tall(lost, params.cell_m, params.lower * (top - floor))])


def _unmasked_legs(carving: Carving, views: Sequence[View], floor: float) -> Points:
    """Centre lines of tall, slender pieces that depth shows between floor and seat outside the masks (dark legs)."""
    params = tuned(Params)
    lowest = floor + params.off_floor_m
    tall_m = params.lower * (float(carving.seen.high[2]) - floor)

    def beside(view: View, points: Points) -> np.ndarray:
        return ~_in_mask(view, points) & (points[:, 2] > lowest) & (points[:, 2] < floor + tall_m)

    legs = [
        _middle_line(piece)
        for piece in _tall(_seen_cells(carving, views, beside, params.leg_cell_m), params.leg_cell_m, tall_m)
    ]
    return np.concatenate([np.zeros((0, 3)), *(leg for leg in legs if leg is not None)])


def _tall(cells: Points, cell_m: float, tall_m: float) -> list[Points]:
    """Connected pieces of the cells that cover enough of a leg's height."""
    return [piece for piece in _pieces(cells, cell_m) if np.ptp(piece[:, 2]) > tuned(Params).tall * tall_m]


def _middle_line(piece: Points) -> Points | None:
    """Points along the centre line of a piece, which may be curved; None if it is too wide for a leg at some height."""
    params = tuned(Params)
    z = piece[:, 2]
    level = np.floor(z / params.level_m)
    if max(np.ptp(piece[level == k, :2], axis=0).max() for k in np.unique(level)) > params.slender_m:
        return None
    heights = np.arange(z.min(), z.max(), params.cell_m / 2)
    return np.column_stack([*(np.polynomial.Polynomial.fit(z, piece[:, k], 2)(heights) for k in (0, 1)), heights])


def _in_mask(view: View, _: Points) -> np.ndarray:
    """Mask of the view's valid depth points that lie in the object's mask."""
    return depth_mask(view)[view.depth_m > 0]


def _seen_cells(carving: Carving, views: Sequence[View], choose: Callable[[View, Points], np.ndarray], cell_m: float) -> Points:
    """Mean positions (local) of the depth points selected by `choose`, in cells that enough views see occupied."""
    params = tuned(Params)
    local_from_world = carving.seen.world_from_local.inverse
    low, high = carving.seen.low - cell_m, carving.seen.high + cell_m
    shape = tuple(np.ceil((high - low) / cell_m).astype(int) + 1)
    keys, means = [], []
    for view in views:
        known = depth_points(view.depth_m, view.depth_camera)[view.depth_m > 0]
        points = local_from_world.apply(view.world_from_camera.apply(known))
        points = points[choose(view, points) & ((points > low) & (points < high)).all(axis=1)]
        flat = np.ravel_multi_index(tuple(np.floor((points - low) / cell_m).astype(int).T), shape)
        unique, member = np.unique(flat, return_inverse=True)
        count = np.bincount(member, minlength=len(unique))
        keys.append(unique)
        means.append(np.column_stack([np.bincount(member, points[:, k], len(unique)) / count for k in range(3)]))
    unique, member = np.unique(np.concatenate(keys), return_inverse=True)
    hits = np.bincount(member, minlength=len(unique))
    rows = np.concatenate(means)
    middles = np.column_stack([np.bincount(member, rows[:, k], len(unique)) for k in range(3)]) / np.maximum(hits, 1)[:, None]
    world = carving.seen.world_from_local.apply(middles)
    through = np.zeros(len(middles))
    for view in views:
        z, seen, _ = look_up(world, view.world_from_camera, view.depth_camera, view.depth_m)
        through += view.noise.seen_through(seen, z, params.through_m)
    return middles[(hits >= params.least_views) & (hits >= params.agreed * (hits + through))]


def _in_one_piece(cells: Points, cell_m: float) -> Points:
    """Cells of the largest piece and of the pieces near it, each connected by the shortest bridge."""
    from scipy.spatial import cKDTree

    params = tuned(Params)
    left = _pieces(cells, cell_m)
    if not left:
        return cells[:0]
    whole = left.pop(0)
    while left:
        tree = cKDTree(whole)
        away = [tree.query(piece) for piece in left]
        nearest = int(np.argmin([distance.min() for distance, _ in away]))
        distance, index = away[nearest]
        at = int(np.argmin(distance))
        if distance[at] > params.gap_m:
            break
        piece = left.pop(nearest)
        steps = np.linspace(0, 1, max(2, int(np.ceil(distance[at] / (0.5 * cell_m)))))[:, None]
        bridge = piece[at] + steps * (whole[index[at]] - piece[at])
        whole = np.concatenate([whole, piece, bridge])
    return whole


def _pieces(cells: Points, cell_m: float) -> list[Points]:
    """Connected components of the cells, largest first, without those below the minimum size."""
    from scipy.spatial import cKDTree

    if len(cells) == 0:
        return []
    labels = components(len(cells), cKDTree(cells).query_pairs(1.8 * cell_m, output_type="ndarray"))
    sizes = np.bincount(labels)
    return [cells[labels == k] for k in np.argsort(-sizes) if sizes[k] >= tuned(Params).least_cells]


def _feet(cells: Points, floor: float) -> list[Points]:
    """Points from the lower end of each leg vertically down to the floor."""
    params = tuned(Params)
    low, feet = cells[cells[:, 2] < floor + params.foot_m], []
    while len(low):
        foot = low[np.argmin(low[:, 2])]
        near = np.linalg.norm(low[:, :2] - foot[:2], axis=1) < params.apart_m
        end = low[near & (low[:, 2] < foot[2] + 2 * params.cell_m), :2]
        heights = np.arange(floor, foot[2], params.cell_m)
        feet += [np.column_stack([end, np.full(len(end), z)]) for z in heights]
        low = low[~near]
    return feet
