"""Solids of revolution (bottles, cans, vases): one clean solid whose profile is measured in the silhouettes.

A LiDAR pixel covers a fifth of a bottle's width, a colour pixel a fortieth. So depth determines the axis and that the object is
round, and the silhouettes determine its width at each height.
"""

from dataclasses import dataclass

import numpy as np

from r2c2r_core.arrays import Faces, Points, Vector3
from r2c2r_core.generate.evidence import View
from r2c2r_core.generate.symmetry import Revolution
from r2c2r_core.geometry.camera import project, sample_nearest, unproject
from r2c2r_core.geometry.least_squares import cauchy
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of solids of revolution."""

    rings: int = param(40, "count", "Number of heights of the profile", ge=4)
    segments: int = param(40, "count", "Number of segments around the axis", ge=6)
    step_px: float = param(0.25, "px", "Sampling distance across an outline", gt=0)
    same_width: float = param(
        0.08, "share", "Maximum deviation of a view's width, relative to the median, for its silhouette to be complete"
    )
    bitten: float = param(
        0.88, "ratio", "Ratio of narrower to wider half-width below which the narrower side counts as occluded", gt=0, lt=1
    )
    mask_weight: float = param(0.3, "ratio", "Weight of the masks relative to depth in the axis fit")
    least_views: int = param(3, "count", "Minimum number of views that measure a radius", ge=1)
    robust_scales_m: tuple[float, float, float, float] = param(
        (0.04, 0.02, 0.01, 0.01),
        "m",
        "Scale of the robust kernel on depth residuals, iteration by iteration",
        source="the initial axis may be 2 cm off",
    )


def fit_lathe(
    points: Points, start: Revolution, bottom_m: float, top_m: float, views: tuple[View, ...], world_from_local: Rigid3
) -> Revolution | None:
    """Solid of revolution fitted to masks and depth; None if too few masks show the whole object.

    The rays through the mask's two edges at a height are tangent to the circle there, which gives the radius; with the radii
    known, the axis is where the depth points lie on them and the masks are centred on it. (A circle fitted to depth alone is
    too small and too near: noise along the rays looks like curvature.)
    """
    params = tuned(Params)
    whole = tuple(view for view in views if not view.is_cropped)
    if len(whole) < params.least_views:
        return None
    current = start
    for scale_m in params.robust_scales_m:
        top_m = _silhouette_top(current, bottom_m, top_m, whole, world_from_local)
        measured = _silhouette_profile(current, bottom_m, top_m, whole, world_from_local)
        if measured is None:
            return None
        profile, balance = measured
        current = profile._replace(centre=_balanced_centre(points, profile, balance, scale_m))
    return current


def is_round(points: Points, revolution: Revolution) -> bool:
    """Whether the points lie on the solid of revolution within LiDAR noise: a carton's flat side and a mug's handle do not."""
    off = np.abs(revolution.signed_distance(points))
    radius = np.interp(points[:, 2], revolution.heights_m, revolution.radii_m)
    near = off < np.maximum(0.01, 0.3 * radius)
    return bool(np.median(off) < max(0.006, 0.12 * float(revolution.radii_m.max())) and near.mean() > 0.8)


def _silhouette_profile(
    revolution: Revolution, bottom_m: float, top_m: float, views: tuple[View, ...], world_from_local: Rigid3
) -> tuple[Revolution, np.ndarray] | None:
    """Radii at `rings` heights, and per view one equation (sideways x, y, metres) for its mask's offset from the axis."""
    params = tuned(Params)
    from scipy import ndimage

    heights = bottom_m + (np.arange(params.rings) + 0.5) / params.rings * (top_m - bottom_m)
    edges = np.array([_half_widths(revolution, heights, view, world_from_local) for view in views])  # (view, 2, height)
    widths = _full_halves(edges)
    counts = np.isfinite(widths).sum(axis=0)
    known = counts >= params.least_views
    if known.mean() < 0.7:
        return None
    radii = np.array([np.median(column[np.isfinite(column)]) for column in widths.T[known]])
    radii = np.interp(heights, heights[known], radii)
    smooth = ndimage.gaussian_filter1d(ndimage.median_filter(radii, 5, mode="nearest"), 1.0, mode="nearest")
    step = (top_m - bottom_m) / params.rings
    ends = np.concatenate([[bottom_m], heights, [heights[-1] + step / 2]])
    # a mask narrower than the others ends at an occluder, not at the object's own outline
    own = [k for k in range(len(views)) if abs(_middle(widths[k] / radii) - 1.0) < params.same_width]
    balance = np.array([_balance(revolution, edges[k], views[k], world_from_local) for k in own]).reshape(-1, 3)
    profile = Revolution(revolution.centre, ends, np.concatenate([smooth[:1], smooth, smooth[-1:]]))
    return profile, balance


def _full_halves(edges: np.ndarray) -> np.ndarray:
    """Half-widths (view, height) from both edges; where one side is occluded the other one counts, by symmetry."""
    shift = np.array([_middle((view[0] - view[1]) / 2) for view in edges])
    centred = edges - np.where(np.isfinite(shift), shift, 0.0)[:, None, None] * np.array([1.0, -1.0])[None, :, None]
    narrow, wide = centred.min(axis=1), centred.max(axis=1)
    return np.asarray(np.where(narrow < tuned(Params).bitten * wide, wide, centred.mean(axis=1)))


def _middle(values: np.ndarray) -> float:
    """Median of the finite values; infinite without any."""
    numbers = values[np.isfinite(values)]
    return float(np.median(numbers)) if len(numbers) else np.inf


def _balance(revolution: Revolution, edges: np.ndarray, view: View, world_from_local: Rigid3) -> np.ndarray:
    """(sideways x, sideways y, offset of the mask's centre in that direction in metres); nan where the axis is hidden."""
    shift = (edges[0] - edges[1]) / 2
    seen = np.isfinite(shift)
    if not seen.any():
        return np.full(3, np.nan)
    forward = _forward(revolution, view, world_from_local)
    return np.array([forward[1], -forward[0], np.median(shift[seen]) * np.linalg.norm(forward)]) / np.linalg.norm(forward)


def _forward(revolution: Revolution, view: View, world_from_local: Rigid3) -> np.ndarray:
    """Horizontal vector from the camera to the axis, local frame."""
    return np.asarray(revolution.centre - world_from_local.inverse.apply(view.eye_world[None])[0, :2])


def _balanced_centre(points: Points, profile: Revolution, balance: np.ndarray, scale_m: float) -> np.ndarray:
    """Axis position after one Gauss-Newton step: points on the radii (robust), masks centred."""
    offset = points[:, :2] - profile.centre
    distance = np.maximum(np.linalg.norm(offset, axis=1), 1e-6)
    body = (points[:, 2] > profile.heights_m[0]) & (points[:, 2] < profile.heights_m[-1])
    residual = distance - np.interp(points[:, 2], profile.heights_m, profile.radii_m)
    weight = np.where(body, cauchy(residual, scale_m), 0.0)
    rows = (offset / distance[:, None]) * weight[:, None]
    # masks constrain the axis sideways; its distance they show only through pose errors, so depth has more weight
    share = tuned(Params).mask_weight * weight.sum() / max(len(balance), 1) * cauchy(balance[:, 2:], scale_m)
    system = np.concatenate([rows, balance[:, :2] * share])
    target = np.concatenate([residual * weight, balance[:, 2] * share[:, 0]])
    step = np.linalg.lstsq(system, target, rcond=None)[0]
    return np.asarray(profile.centre + np.clip(step, -0.03, 0.03))


def lathe_mesh(revolution: Revolution) -> tuple[Points, Faces]:
    """Closed, outward-facing surface of a solid of revolution with flat ends."""
    params = tuned(Params)
    angle = np.arange(params.segments) / params.segments * 2 * np.pi
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    rings = len(revolution.heights_m)
    vertices = np.zeros((rings * params.segments + 2, 3))
    vertices[:-2, :2] = (revolution.centre + revolution.radii_m[:, None, None] * circle).reshape(-1, 2)
    vertices[:-2, 2] = np.repeat(revolution.heights_m, params.segments)
    vertices[-2:, :2] = revolution.centre
    vertices[-2:, 2] = revolution.heights_m[[0, -1]]
    here = np.arange(params.segments)
    following = np.roll(here, -1)
    faces = []
    for ring in range(rings - 1):
        low, high = ring * params.segments, (ring + 1) * params.segments
        faces.append(np.column_stack([low + here, low + following, high + following]))
        faces.append(np.column_stack([low + here, high + following, high + here]))
    last = (rings - 1) * params.segments
    faces.append(np.column_stack([following, here, np.full(params.segments, len(vertices) - 2)]))
    faces.append(np.column_stack([last + here, last + following, np.full(params.segments, len(vertices) - 1)]))
    return vertices, np.concatenate(faces)


def _half_widths(revolution: Revolution, heights: np.ndarray, view: View, world_from_local: Rigid3) -> np.ndarray:
    """(2, n) metres from the axis to the mask's right and left edge at each height; nan where the axis itself is hidden."""
    params = tuned(Params)
    axis = _axis_points(revolution, heights)
    camera_from_local = view.world_from_camera.inverse @ world_from_local
    in_camera = camera_from_local.apply(axis)
    pixel = project(in_camera, view.rgb_camera)
    along = pixel[-1] - pixel[0]
    across = np.array([-along[1], along[0]]) / max(float(np.linalg.norm(along)), 1e-9)  # to the right: heights run up
    reach = int(np.ceil(2.5 * revolution.radii_m.max() * view.rgb_camera.fx / in_camera[:, 2].min() / params.step_px))
    offsets = (np.arange(-reach, reach + 1) * params.step_px)[None, :, None] * across
    values, inside = sample_nearest(view.mask, (pixel[:, None, :] + offsets).reshape(-1, 2))
    row = (values & inside).reshape(len(heights), -1)
    right, left = row[:, reach:], row[:, reach::-1]
    shown = row[:, reach] & ~right.all(axis=1) & ~left.all(axis=1)
    forward = _forward(revolution, view, world_from_local)
    local_from_camera = world_from_local.inverse.rotation @ view.world_from_camera.rotation
    edges = []
    for sign, run in ((1.0, right), (-1.0, left)):
        edge = pixel + sign * (_run_length(run) - 0.5)[:, None] * params.step_px * across
        ray = (unproject(edge, np.ones(len(edge)), view.rgb_camera) @ local_from_camera.T)[:, :2]
        # in plan view the ray is tangent to the circle: its distance from the axis is the radius
        edges.append(sign * (ray[:, 0] * forward[1] - ray[:, 1] * forward[0]) / np.linalg.norm(ray, axis=1))
    return np.where(shown, np.stack(edges), np.nan)


def _run_length(rows: np.ndarray) -> np.ndarray:
    """Number of leading true entries in each row."""
    return np.asarray(np.where(rows.all(axis=1), rows.shape[1], np.argmin(rows, axis=1)))


def _silhouette_top(
    revolution: Revolution, bottom_m: float, top_m: float, views: tuple[View, ...], world_from_local: Rigid3
) -> float:
    """Median height over the views at which the far rim leaves the mask (seen from above, the far rim is visible)."""
    heights = np.linspace(bottom_m + 0.5 * (top_m - bottom_m), bottom_m + 2.0 * (top_m - bottom_m), 400)
    rim = float(revolution.radii_m[-1])
    tops = []
    for view in views:
        eye = world_from_local.inverse.apply(view.eye_world)
        away = np.append(revolution.centre - eye[:2], 0.0)
        points = _axis_points(revolution, heights) + rim * away / max(float(np.linalg.norm(away)), 1e-9)
        pixel = project((view.world_from_camera.inverse @ world_from_local).apply(points), view.rgb_camera)
        values, inside = sample_nearest(view.mask, pixel)
        shown = values & inside
        if shown[0] and not shown.all():
            tops.append(heights[int(np.argmin(shown))])
    return float(np.median(tops)) if len(tops) >= tuned(Params).least_views else top_m


def _axis_points(revolution: Revolution, heights: np.ndarray) -> Points:
    centre: Vector3 = np.array([revolution.centre[0], revolution.centre[1], 0.0])
    return centre + heights[:, None] * np.array([0.0, 0.0, 1.0])
