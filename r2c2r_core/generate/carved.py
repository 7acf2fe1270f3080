"""Shape from silhouettes and free space: a prior solid carved on a grid, with the fused surface where it was observed.

Recipe of backends.md §2.6 and stack.md §8. Every field is a distance in metres, positive outside, on a grid in the object's own
gravity-aligned frame, so its zero level set is a closed surface even where nothing was observed.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from r2c2r_core.generate.evidence import Evidence
from r2c2r_core.generate.level_set import Grid, grid_round
from r2c2r_core.generate.seen import Seen, observe_thing
from r2c2r_core.generate.symmetry import Revolution, best_mirror
from r2c2r_core.generate.variation import Variation
from r2c2r_core.generate.votes import Votes, grid_votes
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of carving."""

    truncation_ratio: float = param(3.0, "ratio", "Truncation distance in voxels", gt=0)
    least_truncation_m: float = param(0.012, "m", "Minimum truncation distance", source="LiDAR noise and pose error together")
    sure_frames: int = param(
        3, "count", "Minimum number of frames that see a surface for parts thinner than four voxels to be kept"
    )
    down_rad: float = param(
        float(np.deg2rad(15.0)), "rad", "Minimum downward viewing angle from which views show where an object's top ends"
    )
    aside_m: float = param(
        0.03, "m", "Sideways margin beyond the depth points, for parts such as a spout or a grip that show few points"
    )
    sheet_m: float = param(0.04, "m", "Thickness behind the observed surface of an object that is modelled as a sheet")


class Carving(NamedTuple):
    """Votes of one draw's frames on a grid around an object; `votes` and `beyond_m` are flat arrays."""

    seen: Seen
    grid: Grid
    votes: Votes
    truncation_m: float
    beyond_m: np.ndarray  # distance outside the carved box
    down_rad: float  # the steepest downward viewing angle
    in_drawer: bool  # whether only its top may be seen, down to where the drawer's front hides it


def carve(evidence: Evidence, variation: Variation) -> Carving:
    """Votes of one draw's frames; raises GenerationFailed with too little depth."""
    params = tuned(Params)
    seen = observe_thing(evidence, variation)
    margin = max(0.006, 1.5 * variation.voxel_m)
    aside = np.array([0.0 if evidence.track.box is None else params.aside_m, 0.0, 0.0])
    grid = grid_round(seen.low - aside, seen.high + aside, variation.voxel_m, margin)
    low, high = seen.low - aside - margin, seen.high + aside + margin
    centres = grid.centres()
    truncation = max(params.truncation_ratio * grid.voxel_m, params.least_truncation_m)
    votes = grid_votes(centres, grid.shape, grid.voxel_m, variation, truncation, seen.world_from_local)
    beyond = np.maximum(low - centres, centres - high).max(axis=1)
    in_drawer = evidence.track.box is not None and evidence.track.box.carrier is not None
    return Carving(seen, grid, votes, truncation, beyond, _look_down(seen, variation), in_drawer)


def solid_field(carving: Carving, revolution: Revolution | None, *, mirror: bool) -> tuple[np.ndarray, bool]:
    """Solid left by masks and free space, with the observed surface, and whether mirroring completed it.

    Unobserved space is solid: around the axis of `revolution` if it is given, else within the whole box.
    """
    from scipy import ndimage

    votes, truncation, shape = carving.votes, carving.truncation_m, carving.grid.shape
    bounds = np.clip(carving.beyond_m, -truncation, truncation)
    prior = bounds
    if revolution is not None:
        prior = np.clip(np.maximum(bounds, revolution.signed_distance(carving.grid.centres())), -truncation, truncation)
    seen = np.isfinite(votes.distance_m)
    free = votes.free_m > 0
    # points in no mask, yet occluded in every frame, carry no evidence: leave them empty
    field = np.where(seen, votes.distance_m, np.maximum(prior, votes.outside_m))
    field = np.where(free, np.maximum(field, np.minimum(votes.free_m, truncation)), field)
    field = np.maximum(field, bounds).reshape(shape)
    sure = (votes.surfaces >= tuned(Params).sure_frames).reshape(shape)
    if carving.down_rad > tuned(Params).down_rad:
        roof = sure & seen.reshape(shape)
        empty = (free | (votes.distance_m > 0)).reshape(shape)
        field[_shadow(field < 0, roof, empty)] = carving.grid.voxel_m
    hidden = (~seen & ~free & (votes.outside_m > 0)).reshape(shape)
    if carving.in_drawer:  # what is hidden under its observed top reaches down to the drawer's floor
        under = np.maximum.accumulate((sure & seen.reshape(shape))[..., ::-1], axis=2)[..., ::-1]
        field[under & hidden & (bounds.reshape(shape) < 0)] = -carving.grid.voxel_m
    mirrored = mirror and _mirror_unseen(field, (seen | free).reshape(shape), free.reshape(shape), hidden)
    solid = field < 0
    slivers = solid & ~ndimage.binary_opening(solid, iterations=2) & ~sure
    field[slivers] = carving.grid.voxel_m  # slivers left between two silhouettes, hardly observed as a surface
    return ndimage.gaussian_filter(field, 0.7), mirrored


def _look_down(seen: Seen, variation: Variation) -> float:
    """Steepest angle at which a view looks down on the centre of an object's top."""
    top = np.append((seen.low + seen.high)[:2] / 2, seen.high[2])
    eyes = seen.world_from_local.inverse.apply(np.array([view.eye_world for view in variation.views])) - top
    return float(np.arctan2(eyes[:, 2], np.linalg.norm(eyes[:, :2], axis=1)).max())


def _shadow(solid: np.ndarray, roof: np.ndarray, empty: np.ndarray) -> np.ndarray:
    """Solid voxels below empty space with no observed surface between: space hidden behind an object seen from above.

    If the object reached there, its top would have been observed.
    """
    shadow, below = np.zeros_like(solid), np.zeros(solid.shape[:2], dtype=bool)
    for level in range(solid.shape[2] - 1, -1, -1):
        below = np.where(solid[..., level], below & ~roof[..., level], empty[..., level])
        shadow[..., level] = solid[..., level] & below
    return shadow


def sheet_field(carving: Carving, solid: np.ndarray) -> np.ndarray:
    """The solid limited to a sheet behind the observed surface: unobserved space is empty."""
    from scipy import ndimage

    surface = np.abs(carving.votes.distance_m).reshape(carving.grid.shape) < carving.grid.voxel_m
    if not surface.any():
        return solid
    behind = ndimage.distance_transform_edt(~surface) * carving.grid.voxel_m - tuned(Params).sheet_m
    return np.maximum(solid, np.minimum(behind, carving.truncation_m))


def above(carving: Carving, field: np.ndarray, height_m: float) -> np.ndarray:
    """The field with everything below a height (local) cut off."""
    return np.maximum(field, height_m - carving.grid.heights())


def volume_below(carving: Carving, field: np.ndarray, height_m: float) -> float:
    """Volume of the solid below a height (local), cubic metres."""
    return float(np.count_nonzero(field[:, :, carving.grid.heights() < height_m] < 0)) * carving.grid.voxel_m**3


def emptied_height(carving: Carving, solid: np.ndarray, left: np.ndarray) -> float:
    """Volume of `solid` missing in `left` as a mean height over the solid's ground area, metres."""
    inside = solid < 0
    columns = max(int(np.count_nonzero(inside.any(axis=2))), 1)
    return float(np.count_nonzero(inside & (left >= 0))) / columns * carving.grid.voxel_m


def _mirror_unseen(field: np.ndarray, seen: np.ndarray, free: np.ndarray, hidden: np.ndarray) -> bool:
    """Copy the state of observed mirror twins into unobserved voxels, in place; the plane is the grid's own centre.

    Free twins carve; solid twins fill only voxels that are `hidden` behind other objects.
    """
    from scipy import ndimage

    axis = best_mirror(field < 0, seen, free)
    if axis is None:
        return False
    twin, twin_seen, twin_free = (np.flip(values, axis).copy() for values in (field, seen, free))
    filled = ndimage.binary_opening(hidden & twin_seen & (twin < 0), iterations=2)  # slivers come from masks that disagree
    changed = (~seen & twin_free) | filled
    field[changed] = twin[changed]
    return bool(changed.any())
