"""What masks get wrong on a body of revolution, put right by depth: a cap of the wall's colour, a shadow at its foot.

A mask is cut along colours, so a white cap before a white wall is missing from it in every frame, and a dark shadow on the
worktop is part of it. Depth tells both: pixels over the cap are as near as the body, not as far as the wall.
"""

from collections.abc import Sequence

import numpy as np

from r2c2r_core.arrays import Points
from r2c2r_core.generate.evidence import View
from r2c2r_core.generate.symmetry import Revolution
from r2c2r_core.geometry.camera import project, sample_nearest
from r2c2r_core.geometry.transforms import Rigid3

_STEP_M = 0.003
_HIGHEST = 0.35  # of the height: what may be missing above
_LEAST_M = 0.006  # a shorter piece is within the masks' error
_NOISE_M = 0.015  # of one depth pixel
_CLEAR_M = 0.03  # behind the far rim: something else
_LEAST_SEEN = 3  # pixels that know, of all views
_FOOT, _BODY = 0.12, 0.35  # of the height: the foot, and the body above it
_FLARE = 1.06


def with_true_ends(revolution: Revolution, points: Points, views: Sequence[View], world_from_local: Rigid3) -> Revolution:
    """The body with its top and foot where depth has them: the very same one where depth says nothing else."""
    whole = tuple(view for view in views if not view.is_cropped)
    return with_unmasked_top(without_flared_foot(revolution, points), whole, world_from_local)


def with_unmasked_top(revolution: Revolution, views: Sequence[View], world_from_local: Rigid3) -> Revolution:
    """The body continued upwards for as long as most depth pixels on its axis are as near as the body."""
    bottom, top, widest = revolution.heights_m[0], revolution.heights_m[-1], float(revolution.radii_m.max())
    heights = np.arange(top + _STEP_M / 2, top + _HIGHEST * (top - bottom), _STEP_M)
    offsets = np.arange(0.0, widest + _STEP_M, _STEP_M)
    counts = [_hits_and_known(revolution, heights, offsets, view, world_from_local) for view in views]
    hits, known = (np.sum(values, axis=0) for values in zip(*counts, strict=True))
    solid = (known >= _LEAST_SEEN) & (hits > 0.5 * known)
    rows = int(np.argmin(np.append(solid[:, 0], False)))
    if rows * _STEP_M < _LEAST_M or rows == len(heights):  # something stands behind it all the way up
        return revolution
    radii = offsets[np.argmin(np.column_stack([solid[:rows], np.zeros(rows, bool)]), axis=1) - 1] + _STEP_M / 2
    radii = np.minimum(np.full(rows, np.median(radii)), widest)
    above, end = heights[:rows] - _STEP_M / 2, heights[rows - 1] + _STEP_M / 2
    return Revolution(
        revolution.centre,
        np.concatenate([revolution.heights_m, above[:1] + 1e-4, [end]]),
        np.concatenate([revolution.radii_m, radii[:1], radii[-1:]]),
    )


def without_flared_foot(revolution: Revolution, points: Points) -> Revolution:
    """The foot no wider than the body above it, unless depth points lie that far out."""
    bottom, top = revolution.heights_m[0], revolution.heights_m[-1]
    share = (revolution.heights_m - bottom) / (top - bottom)
    body = float(np.median(revolution.radii_m[(share > _FOOT) & (share < _BODY)]))
    flared = (share < _FOOT) & (revolution.radii_m > _FLARE * body)
    if not flared.any():
        return revolution
    low = points[points[:, 2] < bottom + _FOOT * (top - bottom)]
    out = np.hypot(*(low[:, :2] - revolution.centre).T) if len(low) else np.zeros(1)
    if float(np.median(out)) > (body + float(revolution.radii_m[flared].max())) / 2:
        return revolution
    return revolution._replace(radii_m=np.where(flared, body, revolution.radii_m))


def _hits_and_known(
    revolution: Revolution, heights: np.ndarray, offsets: np.ndarray, view: View, world_from_local: Rigid3
) -> tuple[np.ndarray, np.ndarray]:
    """Of the two depth pixels at each (height, distance to either side of the axis): how many lie on the body, or on either."""
    eye = world_from_local.inverse.apply(view.eye_world[None])[0]
    away = revolution.centre - eye[:2]
    away /= max(float(np.linalg.norm(away)), 1e-9)
    rim = float(revolution.radii_m[-1])
    # seen from above, it is the far rim that hides what is behind; nearer to the axis the top itself does
    sides = np.concatenate([offsets, -offsets])
    plan = revolution.centre + rim * away + sides[:, None] * np.array([away[1], -away[0]])
    places = np.column_stack([np.tile(plan, (len(heights), 1)), np.repeat(heights, len(sides))])
    in_camera = (view.world_from_camera.inverse @ world_from_local).apply(places)
    depth, inside = sample_nearest(view.depth_m, project(in_camera, view.depth_camera))
    behind = np.where(inside & (depth > 0), depth, np.nan) - in_camera[:, 2]
    hit = (behind > -2.0 * rim - _NOISE_M) & (behind < _NOISE_M)
    clear = behind > _CLEAR_M
    shape = (len(heights), 2, len(offsets))
    return hit.reshape(shape).sum(axis=1), (hit | clear).reshape(shape).sum(axis=1)
