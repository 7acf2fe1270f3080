"""A click on a front that returns no light, taken to the plane of what is round it: black glass has no depth."""

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
    """When a hole in the depth is a front's."""

    off_m: float = param(0.03, "m", "off a plane, within which what is round a hole is on it")
    least_share: float = param(
        0.2, "share", "of what is round a hole, that must be on the plane: a front has neighbours on two sides"
    )
    reach_m: float = param(
        0.6, "m", "from what was seen of a plane to a click: the middle of the widest oven", source="ovens: 60-90 cm"
    )
    dark_m: tuple[float, float, float] = param(
        (0.05, 0.1, 0.15),
        "m",
        "beyond a plane's border, where it goes on as black glass if none of them has depth",
        source="phones' depth ends 1-3 cm short of an edge; ovens are 0.6 m",
    )
    margin_step_m: float = param(0.1, "m", "of margins beyond such a border: clicks nearby ask for the same run", gt=0)


def dark_place(scene: Scene, planes: Sequence[PlaneRegion], click: PromptPoint) -> Vector3 | None:
    """Where a click (world) meets the plane that most of the depth round it lies on; None where it has depth, or none does.

    The surface fused from other frames tells nothing there: through a hole in it one sees what is behind. Black glass parts
    the plane of what is above it from that of what is below: the depth of both is round it.
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
    """How far the front may reach beyond a border of its plane beside which the clicked frame has no depth.

    There black glass may go on: in a tall unit it parts the plane of the fronts above from that of those below.
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
    """Whether a pixel is in the picture, and the sensor measured nothing there."""
    camera = scene.frame(frame_index).rgb_camera
    inside = 0 <= x_px < camera.width and 0 <= y_px < camera.height
    return inside and not scene.has_depth(frame_index, x_px, y_px)
