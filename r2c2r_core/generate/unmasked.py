"""Depth-based correction of mask errors on solids of revolution: a cap in the wall's colour, a shadow at the base.

A mask follows colours, so a white cap in front of a white wall is missing from it in every frame, and a dark shadow on the
worktop is part of it. Depth resolves both: pixels on the cap are as near as the body, not as far as the wall.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from r2c2r_core.arrays import Points
from r2c2r_core.generate.evidence import View
from r2c2r_core.generate.symmetry import Revolution
from r2c2r_core.geometry.camera import project, sample_nearest
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of mask correction by depth."""

    step_m: float = param(0.003, "m", "Sampling distance in height and across", gt=0)
    highest: float = param(0.35, "share", "Maximum height of a missing top, relative to the body's height")
    least_m: float = param(0.006, "m", "Minimum height of a missing top: less is within the masks' error")
    noise_m: float = param(0.015, "m", "Noise of one depth pixel")
    clear_m: float = param(0.03, "m", "Distance behind the far rim beyond which depth belongs to the background")
    least_seen: int = param(3, "count", "Minimum number of conclusive pixels over all views")
    foot: float = param(0.12, "share", "Fraction of the height that counts as the base")
    body: float = param(0.35, "share", "Fraction of the height up to which the body above the base is measured")
    flare: float = param(1.06, "ratio", "Ratio of the base's radius to the body's above which the base is a shadow")


def with_true_ends(revolution: Revolution, points: Points, views: Sequence[View], world_from_local: Rigid3) -> Revolution:
    """The body with top and base corrected by depth; unchanged where depth does not contradict the masks."""
    whole = tuple(view for view in views if not view.is_cropped)
    return with_unmasked_top(without_flared_foot(revolution, points), whole, world_from_local)


def with_unmasked_top(revolution: Revolution, views: Sequence[View], world_from_local: Rigid3) -> Revolution:
    """The body extended upwards while most depth pixels on its axis are as near as the body."""
    params = tuned(Params)
    bottom, top, widest = revolution.heights_m[0], revolution.heights_m[-1], float(revolution.radii_m.max())
    heights = np.arange(top + params.step_m / 2, top + params.highest * (top - bottom), params.step_m)
    offsets = np.arange(0.0, widest + params.step_m, params.step_m)
    counts = [_hits_and_known(revolution, heights, offsets, view, world_from_local) for view in views]
    hits, known = (np.sum(values, axis=0) for values in zip(*counts, strict=True))
    solid = (known >= params.least_seen) & (hits > 0.5 * known)
    rows = int(np.argmin(np.append(solid[:, 0], False)))
    if rows * params.step_m < params.least_m or rows == len(heights):  # an object behind it reaches all the way up
        return revolution
    radii = offsets[np.argmin(np.column_stack([solid[:rows], np.zeros(rows, bool)]), axis=1) - 1] + params.step_m / 2
    radii = np.minimum(np.full(rows, np.median(radii)), widest)
    above, end = heights[:rows] - params.step_m / 2, heights[rows - 1] + params.step_m / 2
    return Revolution(
        revolution.centre,
        np.concatenate([revolution.heights_m, above[:1] + 1e-4, [end]]),
        np.concatenate([revolution.radii_m, radii[:1], radii[-1:]]),
    )


def without_flared_foot(revolution: Revolution, points: Points) -> Revolution:
    """The body with its base no wider than the part above, unless depth points lie that far out."""
    params = tuned(Params)
    bottom, top = revolution.heights_m[0], revolution.heights_m[-1]
    share = (revolution.heights_m - bottom) / (top - bottom)
    body = float(np.median(revolution.radii_m[(share > params.foot) & (share < params.body)]))
    flared = (share < params.foot) & (revolution.radii_m > params.flare * body)
    if not flared.any():
        return revolution
    low = points[points[:, 2] < bottom + params.foot * (top - bottom)]
    out = np.hypot(*(low[:, :2] - revolution.centre).T) if len(low) else np.zeros(1)
    if float(np.median(out)) > (body + float(revolution.radii_m[flared].max())) / 2:
        return revolution
    return revolution._replace(radii_m=np.where(flared, body, revolution.radii_m))


def _hits_and_known(
    revolution: Revolution, heights: np.ndarray, offsets: np.ndarray, view: View, world_from_local: Rigid3
) -> tuple[np.ndarray, np.ndarray]:
    """Number of the two depth pixels at each (height, distance to either side of the axis) that hit the body, and that are
    conclusive.
    """
    params = tuned(Params)
    eye = world_from_local.inverse.apply(view.eye_world)
    away = revolution.centre - eye[:2]
    away /= max(float(np.linalg.norm(away)), 1e-9)
    rim = float(revolution.radii_m[-1])
    # seen from above, the far rim occludes the background; nearer to the axis the top itself does
    sides = np.concatenate([offsets, -offsets])
    plan = revolution.centre + rim * away + sides[:, None] * np.array([away[1], -away[0]])
    places = np.column_stack([np.tile(plan, (len(heights), 1)), np.repeat(heights, len(sides))])
    in_camera = (view.world_from_camera.inverse @ world_from_local).apply(places)
    depth, inside = sample_nearest(view.depth_m, project(in_camera, view.depth_camera))
    behind = np.where(inside & (depth > 0), depth, np.nan) - in_camera[:, 2]
    hit = (behind > -2.0 * rim - params.noise_m) & (behind < params.noise_m)
    clear = behind > params.clear_m
    shape = (len(heights), 2, len(offsets))
    return hit.reshape(shape).sum(axis=1), (hit | clear).reshape(shape).sum(axis=1)
