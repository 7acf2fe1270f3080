"""Clicks on a front without depth (black glass), projected onto the plane of the depth around the hole."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from r2c2r_core.arrays import Mask, Points, Vector3
from r2c2r_core.geometry.camera import project, sample_through, unproject
from r2c2r_core.kitchen.category import Category
from r2c2r_core.model.capture import Frame
from r2c2r_core.model.inputs import PromptPoint
from r2c2r_core.segment.holes import Rim, find_hole, find_rim, measured
from r2c2r_core.segment.planes import PlaneRegion, region_along
from r2c2r_core.segment.scene import Scene
from r2c2r_core.segment.viewpoints import best_views
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
    frames: int = param(8, "count", "Maximum number of frames in which black glass is looked for: a click waits for them", ge=1)
    margin_step_m: float = param(
        0.1, "m", "Step to which margins beyond a plane's border are rounded up: clicks nearby share one run", gt=0
    )


def dark_place(scene: Scene, planes: Sequence[PlaneRegion], click: PromptPoint) -> Vector3 | None:
    """Intersection (world) of a click with the plane of most depth around it; None where it has depth, or no plane fits.

    The surface fused from other frames is no help there: a hole in it shows what is behind. Black glass separates the
    plane of the fronts above it from that of the fronts below; the depth of both surrounds the hole.
    """
    rim = find_rim(scene.frame(click.frame), scene.depth(click.frame), click.x, click.y)
    if rim is None or scene.depth_at_step(click.frame, click.x, click.y) is not None:
        return None
    origin, ray = scene.ray(click.frame, click.x, click.y)
    best, place = 0.0, None
    for region in planes:
        share = _share_on(region, rim)
        met = region_along((region,), origin, ray, np.inf, tuned(Params).reach_m) if share > best else None
        if met is not None:
            best, place = share, met[1]
    return place


def framing_plane(scene: Scene, planes: Sequence[PlaneRegion], frame: Frame, mask: Mask) -> PlaneRegion | None:
    """Plane nearest to the camera with enough of a mask's depth, on all sides: a glazed door's frame, not the board behind."""
    within, inside = sample_through(mask, frame.rgb_camera, frame.depth_camera)
    row, column = np.argwhere(within & inside).mean(axis=0).astype(int).tolist() if within.any() else (0, 0)
    rim, camera = measured(frame, scene.depth(frame.index), within & inside, (column, row)), frame.world_from_camera.translation
    away = [((camera - region.world_from_plane.translation) @ region.outward, region) for region in planes]
    held = [(metres, region) for metres, region in away if metres > 0 and _share_on(region, rim) > 0]
    return min(held, key=lambda pair: pair[0])[1] if held else None


def _share_on(region: PlaneRegion, rim: Rim) -> float:
    """Fraction of a rim that lies on a plane; 0 where the plane does not surround the hole."""
    params, around = tuned(Params), rim.points
    if not len(around):
        return 0.0
    flush = np.abs((around - region.world_from_plane.translation) @ region.outward) < params.off_m
    share = float((flush & region.supports(around, params.off_m)).mean())
    return share if share > params.least_share and rim.encloses(flush) else 0.0


def best_frames(scene: Scene, point: Vector3) -> list[int]:
    """Frames that show a point (world) best, in which black glass is looked for."""
    return [frame.index for frame in best_views(scene, point, tuned(Params).frames)]


def dark_frames(scene: Scene, region: PlaneRegion, point: Vector3, frames: Iterable[int]) -> tuple[int, ...]:
    """Those of some frames that show a hole in the depth at a point (world), surrounded by a plane's observed part."""
    if not region.supports(point[None], tuned(Params).reach_m)[0]:
        return ()
    found = []
    for frame in map(scene.frame, frames):
        rim = find_rim(frame, scene.depth(frame.index), *_pixel_of(point, frame))
        if rim is not None and _share_on(region, rim) > 0:
            found.append(frame.index)
    return tuple(found)


def dark_beyond(scene: Scene, region: PlaneRegion, point: Vector3, frames: Iterable[int], kind: Category) -> float:
    """Distance that the front under a point (world) extends beyond a border of its plane, over the holes in frames' depth.

    Black glass may continue there: in a tall unit it separates the plane of the fronts above from that of those below.
    """
    local, reach = region.world_from_plane.inverse.apply(point), 0.0
    for frame in map(scene.frame, frames):
        hole = find_hole(frame, scene.depth(frame.index), *_pixel_of(point, frame))
        glass = np.zeros((0, 3)) if hole is None else _on_plane(region, frame, hole)
        for axis, half, usual in ((0, region.width_m / 2, kind.width.usual), (2, region.height_m / 2, kind.height.usual)):
            for sign in (-1.0, 1.0):
                beyond = float((sign * glass[:, axis]).max(initial=-np.inf)) - half
                reach = max(reach, min(beyond, usual - half + sign * float(local[axis])))
    return float(np.ceil(reach / tuned(Params).margin_step_m)) * tuned(Params).margin_step_m


def _pixel_of(point: Vector3, frame: Frame) -> tuple[float, float]:
    """Pixel of a point (world) in a frame's colour image."""
    x_px, y_px = project(frame.world_from_camera.inverse.apply(point), frame.rgb_camera)
    return float(x_px), float(y_px)


def _on_plane(region: PlaneRegion, frame: Frame, pixels: Mask) -> Points:
    """Pixels (n) of a frame's depth image, projected onto a plane: points (n, 3) in its frame."""
    rows, columns = np.nonzero(pixels)
    rays = unproject(np.stack([columns, rows], axis=1) + 0.5, np.ones(len(rows)), frame.depth_camera)
    plane_from_camera = region.world_from_plane.inverse @ frame.world_from_camera
    turned, origin = plane_from_camera.turn(rays), plane_from_camera.translation
    return np.asarray(origin - turned * (origin[1] / turned[:, 1])[:, None])
