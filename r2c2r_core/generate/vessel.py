"""Mugs, bowls and pots: a solid of revolution with a wall, a floor and a cavity, and the handle that silhouettes show.

Depth inside a mug is a handful of noisy pixels, so the cavity and the wall's thickness come from the category; direction and
reach of a handle are measured in the masks: beside the body, in the frames that look past it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np

from r2c2r_core.arrays import Faces, Points
from r2c2r_core.generate.evidence import View
from r2c2r_core.generate.lathe import lathe_mesh
from r2c2r_core.generate.symmetry import Revolution
from r2c2r_core.geometry.camera import project, sample_nearest
from r2c2r_core.geometry.meshes import unite
from r2c2r_core.geometry.transforms import Rigid3, rotation_about_z
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of mugs, bowls and pots."""

    wall_m: float = param(0.004, "m", "Thickness of the wall", source="stoneware")
    wall_share: float = param(0.2, "share", "Maximum thickness of the wall relative to the radius")
    floor: float = param(1.5, "ratio", "Ratio of the floor's thickness to the wall's")
    azimuths: int = param(36, "count", "Number of directions in which a handle is searched", ge=8)
    reaches_m: tuple[float, float, float] = param(
        (0.008, 0.06, 0.004), "m", "Start, end and step of the distances beyond the body at which a handle is searched"
    )
    spread: int = param(4, "count", "Number of azimuths to either side of the best that are averaged")
    beside: float = param(
        1.08, "ratio", "Minimum lateral distance from the axis, relative to the radius, for a frame to see past the body"
    )
    least_views: int = param(3, "count", "Minimum number of views that look past the body", ge=1)
    shown: float = param(0.5, "share", "Minimum fraction of the views that look past the body which show the handle")
    bar_m: float = param(0.009, "m", "Thickness of a handle's ring")
    bar_share: float = param(0.5, "share", "Maximum thickness of the ring relative to its radius")
    tallest: float = param(0.36, "share", "Maximum radius of a handle's ring relative to the height")


class VesselHandle(NamedTuple):
    """A handle's azimuth about the axis and the distance of its outer edge from the body."""

    azimuth_rad: float
    reach_m: float


def vessel_mesh(revolution: Revolution, handle: VesselHandle | None) -> tuple[Points, Faces]:
    """Closed surface of the body with its cavity, and the handle as a ring through the wall."""
    params = tuned(Params)
    bottom, top = float(revolution.heights_m[0]), float(revolution.heights_m[-1])
    wall = min(params.wall_m, params.wall_share * float(revolution.radii_m.min()))
    floor = bottom + params.floor * wall
    inside = revolution.heights_m > floor
    heights = np.concatenate([[floor], revolution.heights_m[inside], [top + wall]])
    radii = np.interp(heights, revolution.heights_m, revolution.radii_m) - wall
    hollow = lathe_mesh(Revolution(revolution.centre, heights, radii))
    parts = [lathe_mesh(revolution)]
    if handle is not None:
        parts.append(_ring(revolution, handle))
    return unite(parts, [hollow])


def find_handle(revolution: Revolution, views: Sequence[View], world_from_local: Rigid3) -> VesselHandle | None:
    """Direction in which most frames that look past the body show mask beside it; None without one."""
    params = tuned(Params)
    shares = np.stack([_shown(revolution, azimuth, views, world_from_local) for azimuth in _azimuths()])
    near = shares[:, : len(_reaches_m()) // 3].mean(axis=1)
    if not np.isfinite(near).any():
        return None
    best = int(np.nanargmax(near))
    if near[best] < params.shown or np.nanmedian(near) > 0.5 * near[best]:  # a mask that is wide all around is simply too wide
        return None
    reach = float(_reaches_m()[shares[best] >= params.shown].max(initial=_reaches_m()[0]))
    beside = (best + np.arange(-params.spread, params.spread + 1)) % params.azimuths
    middle = np.nan_to_num(near[beside]) @ np.exp(1j * _azimuths()[beside])
    return VesselHandle(float(np.angle(middle)), reach)


def _azimuths() -> np.ndarray:
    params = tuned(Params)
    return np.arange(params.azimuths) * 2 * np.pi / params.azimuths


def _shown(revolution: Revolution, azimuth: float, views: Sequence[View], world_from_local: Rigid3) -> np.ndarray:
    """Per reach, the fraction of the frames looking past the body whose mask contains that point; nan with too few frames."""
    params = tuned(Params)
    bottom, top = revolution.heights_m[0], revolution.heights_m[-1]
    out = np.array([np.cos(azimuth), np.sin(azimuth)])
    heights = bottom + np.array([0.45, 0.6, 0.75]) * (top - bottom)
    radius = float(np.interp(heights[1], revolution.heights_m, revolution.radii_m))
    places = [np.append(revolution.centre + (radius + r) * out, z) for r in _reaches_m() for z in heights]
    body = np.array([[*revolution.centre, z] for z in heights])
    held = []
    for view in views:
        eye = world_from_local.inverse.apply(view.eye_world)
        towards = (revolution.centre - eye[:2]) / max(float(np.linalg.norm(revolution.centre - eye[:2])), 1e-9)
        if abs(out @ [towards[1], -towards[0]]) * (radius + _reaches_m()[2]) < params.beside * radius:
            continue
        camera_from_local = view.world_from_camera.inverse @ world_from_local
        pixels = project(camera_from_local.apply(np.array(places)), view.rgb_camera)
        pixels = pixels + _pose_error(view, project(camera_from_local.apply(body), view.rgb_camera))
        mask, inside = sample_nearest(view.mask, pixels)
        held.append((mask & inside).reshape(len(_reaches_m()), -1).any(axis=1))
    return np.mean(held, axis=0) if len(held) >= params.least_views else np.full(len(_reaches_m()), np.nan)


def _pose_error(view: View, body_px: np.ndarray) -> np.ndarray:
    """Offset in pixels of the mask's innermost point, which lies in the body and not the handle, from the body's centre."""
    inside = cv2.distanceTransform(np.pad(view.mask, 1).astype(np.uint8), cv2.DIST_L2, 5)[1:-1, 1:-1]
    rows, columns = np.nonzero(inside > 0.9 * inside.max())
    return np.array([columns.mean() + 0.5, rows.mean() + 0.5]) - body_px.mean(axis=0)


def _ring(revolution: Revolution, handle: VesselHandle) -> tuple[Points, Faces]:
    """Upright ring whose outer edge is the end of the handle; its inner part is cut off by the cavity."""
    params = tuned(Params)
    bottom, top = float(revolution.heights_m[0]), float(revolution.heights_m[-1])
    middle = 0.55 * top + 0.45 * bottom
    radius = float(np.interp(middle, revolution.heights_m, revolution.radii_m))
    outer = min(params.tallest * (top - bottom), radius)  # on a tall jug, a larger ring would protrude on the other side
    bar = min(params.bar_m, params.bar_share * outer)
    stretch = max(1.0, (handle.reach_m / 2 + bar) / outer)  # on a flat pan, a circular ring would not touch the body
    centre = radius + max(handle.reach_m - stretch * outer, -0.4 * outer)
    disc, hole = (
        lathe_mesh(Revolution(np.zeros(2), np.array([-half, half]), np.full(2, size)))
        for half, size in ((bar / 2, outer), (bar, outer - bar))
    )
    vertices, faces = unite([disc], [hole])
    upright = np.column_stack(
        [stretch * vertices[:, 0] + centre, -vertices[:, 2], vertices[:, 1]]
    )  # its axis along the tangent
    turned = upright @ rotation_about_z(handle.azimuth_rad).T
    return turned + np.append(revolution.centre, middle), faces


def _reaches_m() -> np.ndarray:
    return np.arange(*tuned(Params).reaches_m)
