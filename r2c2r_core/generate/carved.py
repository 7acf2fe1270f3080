"""Things of any shape: a prior solid, carved by free space and silhouettes, with the fused surface where it was seen.

Recipe of backends.md §2.6 and stack.md §8. Every field is a distance in metres, positive outside, on a grid in the thing's
own gravity-aligned frame, so the zero level is a closed surface whatever was not seen.
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
    """How a thing is carved."""

    truncation_ratio: float = param(3.0, "ratio", "of the truncation distance to a voxel", gt=0)
    least_truncation_m: float = param(0.012, "m", "truncation distance, at least", source="LiDAR noise and pose error together")
    sure_frames: int = param(3, "count", "that see a surface, before something thinner than four voxels is believed")
    down_rad: float = param(
        float(np.deg2rad(15.0)), "rad", "that a camera looks down on a thing, from where it shows where its top ends"
    )
    aside_m: float = param(
        0.03, "m", "beside nearly all depth points, that a thing may reach to where its masks end: a spout or a grip shows few"
    )
    sheet_m: float = param(0.04, "m", "how thick a thing is behind what was seen of it, where that is all there is")


class Carving(NamedTuple):
    """What the frames of one draw say of a grid round a thing; `votes` and `beyond_m` are flat."""

    seen: Seen
    grid: Grid
    votes: Votes
    truncation_m: float
    beyond_m: np.ndarray  # distance outside the box that is carved
    down_rad: float  # the steepest look down on it


def carve(evidence: Evidence, variation: Variation) -> Carving:
    """The votes of one draw's frames; raises GenerationFailed where there is too little depth."""
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
    return Carving(seen, grid, votes, truncation, beyond, _look_down(seen, variation))


def solid_field(carving: Carving, revolution: Revolution | None, *, mirror: bool) -> tuple[np.ndarray, bool]:
    """The solid that masks and free space leave, with the seen surface, and whether a mirror completed it.

    What nobody saw is solid: about `revolution`'s axis where there is one, else all of the box.
    """
    from scipy import ndimage

    votes, truncation, shape = carving.votes, carving.truncation_m, carving.grid.shape
    bounds = np.clip(carving.beyond_m, -truncation, truncation)
    prior = bounds
    if revolution is not None:
        prior = np.clip(np.maximum(bounds, revolution.signed_distance(carving.grid.centres())), -truncation, truncation)
    seen = np.isfinite(votes.distance_m)
    free = votes.free_m > 0
    # what lies in no mask, but behind another thing in every frame, is nobody's guess: leave it out
    field = np.where(seen, votes.distance_m, np.maximum(prior, votes.outside_m))
    field = np.where(free, np.maximum(field, np.minimum(votes.free_m, truncation)), field)
    field = np.maximum(field, bounds).reshape(shape)
    sure = (votes.surfaces >= tuned(Params).sure_frames).reshape(shape)
    if carving.down_rad > tuned(Params).down_rad:
        roof = sure & seen.reshape(shape)
        empty = (free | (votes.distance_m > 0)).reshape(shape)
        field[_shadow(field < 0, roof, empty)] = carving.grid.voxel_m
    hidden = (~seen & ~free & (votes.outside_m > 0)).reshape(shape)
    mirrored = mirror and _mirror_unseen(field, (seen | free).reshape(shape), free.reshape(shape), hidden)
    solid = field < 0
    slivers = solid & ~ndimage.binary_opening(solid, iterations=2) & ~sure
    field[slivers] = carving.grid.voxel_m  # what is left between two silhouettes and hardly seen as a surface
    return ndimage.gaussian_filter(field, 0.7), mirrored


def _look_down(seen: Seen, variation: Variation) -> float:
    """The steepest angle at which a view looks down on the top of a thing's middle."""
    top = np.append((seen.low + seen.high)[:2] / 2, seen.high[2])
    eyes = seen.world_from_local.inverse.apply(np.array([view.eye_world for view in variation.views])) - top
    return float(np.arctan2(eyes[:, 2], np.linalg.norm(eyes[:, :2], axis=1)).max())


def _shadow(solid: np.ndarray, roof: np.ndarray, empty: np.ndarray) -> np.ndarray:
    """Solid voxels with empty space above them and no seen surface between: what hides behind the thing, seen from above.

    A thing that reached there would show its top.
    """
    shadow, below = np.zeros_like(solid), np.zeros(solid.shape[:2], dtype=bool)
    for level in range(solid.shape[2] - 1, -1, -1):
        below = np.where(solid[..., level], below & ~roof[..., level], empty[..., level])
        shadow[..., level] = solid[..., level] & below
    return shadow


def sheet_field(carving: Carving, solid: np.ndarray) -> np.ndarray:
    """The solid, no thicker behind what was seen of it than a board: what nobody saw is empty."""
    from scipy import ndimage

    surface = np.abs(carving.votes.distance_m).reshape(carving.grid.shape) < carving.grid.voxel_m
    if not surface.any():
        return solid
    behind = ndimage.distance_transform_edt(~surface) * carving.grid.voxel_m - tuned(Params).sheet_m
    return np.maximum(solid, np.minimum(behind, carving.truncation_m))


def above(carving: Carving, field: np.ndarray, height_m: float) -> np.ndarray:
    """The field with all that is below a height (local) cut off."""
    return np.maximum(field, height_m - carving.grid.heights())


def volume_below(carving: Carving, field: np.ndarray, height_m: float) -> float:
    """How much of the solid lies below a height (local), cubic metres."""
    return float(np.count_nonzero(field[:, :, carving.grid.heights() < height_m] < 0)) * carving.grid.voxel_m**3


def emptied_height(carving: Carving, solid: np.ndarray, left: np.ndarray) -> float:
    """How much of `solid` is not in `left`: the mean height over the ground that the solid covers, metres."""
    inside = solid < 0
    columns = max(int(np.count_nonzero(inside.any(axis=2))), 1)
    return float(np.count_nonzero(inside & (left >= 0))) / columns * carving.grid.voxel_m


def _mirror_unseen(field: np.ndarray, seen: np.ndarray, free: np.ndarray, hidden: np.ndarray) -> bool:
    """Give voxels that nobody saw, in place, what their mirror twins were seen to be; the middle is the grid's own.

    Free twins carve; solid twins fill only what is `hidden` behind other things.
    """
    from scipy import ndimage

    axis = best_mirror(field < 0, seen, free)
    if axis is None:
        return False
    twin, twin_seen, twin_free = (np.flip(values, axis).copy() for values in (field, seen, free))
    filled = ndimage.binary_opening(hidden & twin_seen & (twin < 0), iterations=2)  # slivers are masks that disagree
    changed = (~seen & twin_free) | filled
    field[changed] = twin[changed]
    return bool(changed.any())
