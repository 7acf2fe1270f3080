"""Clicks on a front without depth (black glass), projected onto the plane of the depth around the hole."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from r2c2r_core.arrays import Vector3
from r2c2r_core.geometry.camera import project
from r2c2r_core.kitchen.category import Category
from r2c2r_core.model.inputs import PromptPoint
from r2c2r_core.segment.holes import find_rim
from r2c2r_core.segment.planes import PlaneRegion, region_along
from r2c2r_core.segment.scene import Scene
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of holes in the depth that belong to a front."""

    off_m: float = param(0.03, "m", "Maximum distance from a plane of depth around a hole that lies on it")
    least_share: float = param(
        0.2,
        "share",
        "Minimum fraction of the depth around a hole that must lie on the plane: a front has neighbours on two sides",
    )
    reach_m: float = param(
        0.6, "m", "Maximum distance from a plane's observed part to a click: half the widest oven", source="ovens: 60-90 cm"
    )
    dark_m: tuple[float, float, float] = param(
        (0.05, 0.1, 0.15),
        "m",
        "Distances beyond a plane's border that must all lack depth for black glass to continue there",
        source="phones' depth ends 1-3 cm short of an edge; ovens are 0.6 m",
    )
    margin_step_m: float = param(
        0.1, "m", "Step to which margins beyond such a border are rounded up: clicks nearby share one run", gt=0
    )


def dark_place(scene: Scene, planes: Sequence[PlaneRegion], click: PromptPoint) -> Vector3 | None:
    """Intersection (world) of a click with the plane of most depth around it; None where it has depth, or no plane fits.

    The surface fused from other frames is no help there: a hole in it shows what is behind. Black glass separates the
    plane of the fronts above it from that of the fronts below; the depth of both surrounds the hole.
    """
    rim = find_rim(scene.frame(click.frame), scene.depth(click.frame), click.x, click.y)
    if rim is None or scene.depth_at_step(click.frame, click.x, click.y) is not None:
        return None
    params, around = tuned(Params), rim.points
    origin, ray = scene.ray(click.frame, click.x, click.y)
    best, place = params.least_share, None
    for region in planes:
        flush = np.abs((around - region.world_from_plane.translation) @ region.outward) < params.off_m
        share = float((flush & region.supports(around, params.off_m)).mean()) if len(around) else 0.0
        between = share > best and rim.encloses(flush)
        met = region_along((region,), origin, ray, np.inf, params.reach_m) if between else None
        if met is not None:
            best, place = share, met[1]
    return place


def dark_beyond(scene: Scene, region: PlaneRegion, click: PromptPoint, point: Vector3, kind: Category) -> float:
    """Distance that the front may extend beyond a border of its plane where the clicked frame lacks depth.

    Black glass may continue there: in a tall unit it separates the plane of the fronts above from that of those below.
    """
    params, frame = tuned(Params), scene.frame(click.frame)
    local, reach = region.world_from_plane.inverse.apply(point), 0.0
    for axis, half, usual in ((0, region.width_m / 2, kind.width.usual), (2, region.height_m / 2, kind.height.usual)):
        for sign in (-1.0, 1.0):
            beyond = np.repeat(local[None], len(params.dark_m), axis=0)
            beyond[:, axis] = sign * (half + np.array(params.dark_m))
            pixels = project(frame.world_from_camera.inverse.apply(region.world_from_plane.apply(beyond)), frame.rgb_camera)
            left = half - sign * float(local[axis])
            if left < usual and all(_is_dark(scene, click.frame, *pixel.tolist()) for pixel in pixels):
                reach = max(reach, usual - left)
    return float(np.ceil(reach / params.margin_step_m)) * params.margin_step_m


def _is_dark(scene: Scene, frame_index: int, x_px: float, y_px: float) -> bool:
    """Whether a pixel lies in the image and has no depth."""
    camera = scene.frame(frame_index).rgb_camera
    inside = 0 <= x_px < camera.width and 0 <= y_px < camera.height
    return inside and not scene.has_depth(frame_index, x_px, y_px)
