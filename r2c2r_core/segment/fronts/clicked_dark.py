"""A click on a front that returns no light, taken to the plane of what is round it: black glass has no depth."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from r2c2r_core.arrays import Mask, Points, Vector3
from r2c2r_core.geometry.camera import project, unproject
from r2c2r_core.kitchen.category import Category
from r2c2r_core.model.inputs import PromptPoint
from r2c2r_core.segment.planes import PlaneRegion, region_along
from r2c2r_core.segment.scene import Scene
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """When a hole in the depth is a front's."""

    thin_px: int = param(5, "px", "width of what is only an outline between two depths, and no hole", ge=1)
    about_px: int = param(7, "px", "across a hole's border, where what is round it is measured", ge=3)
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
    hole = _hole(scene, click)
    if hole is None or scene.depth_at_step(click.frame, click.x, click.y) is not None:
        return None
    params, (pixels, around) = tuned(Params), _around(scene, click.frame, hole)
    at = _depth_pixel(scene, click)
    origin, ray = scene.ray(click.frame, click.x, click.y)
    best, place = params.least_share, None
    for region in planes:
        flush = np.abs((around - region.world_from_plane.translation) @ region.outward) < params.off_m
        share = float((flush & region.supports(around, params.off_m)).mean()) if len(around) else 0.0
        between = share > best and _encloses(pixels[flush], at)
        met = region_along((region,), origin, ray, np.inf, params.reach_m) if between else None
        if met is not None:
            best, place = share, met[1]
    return place


def dark_beyond(scene: Scene, region: PlaneRegion, click: PromptPoint, point: Vector3, kind: Category) -> float:
    """How far the front may reach beyond a border of its plane beside which the clicked frame has no depth.

    There black glass may go on: in a tall unit it parts the plane of the fronts above from that of those below.
    """
    params, frame = tuned(Params), scene.frame(click.frame)
    local, reach = region.world_from_plane.inverse.apply(point[None])[0], 0.0
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


def _hole(scene: Scene, click: PromptPoint) -> Mask | None:
    """Pixels (h, w) of the depth image round a click that have none."""
    depth, (column, row) = scene.depth(click.frame), _depth_pixel(scene, click)
    side = tuned(Params).thin_px
    unknown = cv2.morphologyEx((depth == 0).astype(np.uint8), cv2.MORPH_OPEN, np.ones((side, side), np.uint8))
    if not unknown[row, column]:
        return None
    _, labels = cv2.connectedComponents(unknown)
    return np.asarray(labels == labels[row, column])


def _depth_pixel(scene: Scene, click: PromptPoint) -> tuple[int, int]:
    """(column, row) of the depth image at a click."""
    (height, width), camera = scene.depth(click.frame).shape, scene.frame(click.frame).rgb_camera
    return int(click.x * width / camera.width), int(click.y * height / camera.height)


def _encloses(pixels: Points, at: tuple[int, int]) -> bool:
    """Whether a pixel lies in the convex hull of others (n, 2); at a picture's border a hole goes on unseen, as anything."""
    return len(pixels) > 0 and cv2.pointPolygonTest(cv2.convexHull(pixels.astype(np.int32)), at, measureDist=False) >= 0


def _around(scene: Scene, frame_index: int, hole: Mask) -> tuple[Points, Points]:
    """Depth pixels (n, 2) just outside a hole that have depth, as (column, row), and their world points (n, 3)."""
    side, frame, depth = tuned(Params).about_px, scene.frame(frame_index), scene.depth(frame_index)
    wide = cv2.dilate(hole.astype(np.uint8), np.ones((side, side), np.uint8)) > 0
    row, column = np.nonzero(wide & ~hole & (depth > 0))
    pixels = np.stack([column, row], axis=1)
    seen = unproject(pixels + 0.5, depth[row, column].astype(np.float64), frame.depth_camera)
    return pixels, frame.world_from_camera.apply(seen)
