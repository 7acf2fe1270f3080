"""Photographs warped onto the vertical plane through an axis that faces each camera, with the depth evidence there."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np

from r2c2r_core.arrays import Image, Points, Vector3
from r2c2r_core.geometry.camera import Intrinsics, project, sample_nearest
from r2c2r_core.model.capture import Frame
from r2c2r_core.segment.planes import PlaneRegion
from r2c2r_core.segment.scene import Scene
from r2c2r_core.segment.things.crops import shrunk
from r2c2r_core.segment.things.support import raised, support_offset
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of depth evidence on a strip."""

    on_odds: float = param(1.5, "log", "Maximum log-odds of depth where such a body would show it")
    off_odds: float = param(
        1.0,
        "log",
        "Maximum log-odds against the body, of depth behind it, on the support or on a wall",
        source="10 bottles of as-filmed kitchens: at 2.0 two lose caps that smeared depth misses; 11 clean ones: within 2 %",
    )
    hides_m: float = param(0.03, "m", "Minimum distance in front of the body, beyond the noise, for depth to be an occluder")


class View(NamedTuple):
    """A frame's view of the object."""

    frame: Frame
    lab: Image  # of the crop
    camera: Intrinsics  # of the crop
    lift_m: float  # height error of the frame: how much too high it shows the object


class Grid(NamedTuple):
    """Grid of radii and heights."""

    cell_m: float
    level_m: float
    cells: int
    levels: int

    @property
    def across(self) -> np.ndarray:
        """Signed distances of a strip's columns from the axis, metres."""
        half = (np.arange(self.cells) + 0.5) * self.cell_m
        return np.concatenate([-half[::-1], half])

    @property
    def heights(self) -> np.ndarray:
        """Heights of the row centres above the support, metres."""
        return (np.arange(self.levels) + 0.5) * self.level_m

    def within(self, cells: np.ndarray, margin_m: float) -> np.ndarray:
        """Mask of the places (levels, columns) of a strip within a profile dilated by `margin_m` (eroded where negative)."""
        inside = np.abs(self.across)[None] < cells[:, None] * self.cell_m
        size = (2 * round(abs(margin_m) / self.cell_m) + 1, 2 * round(abs(margin_m) / self.level_m) + 1)
        change = cv2.dilate if margin_m > 0 else cv2.erode
        return np.asarray(change(inside.astype(np.uint8), np.ones(size[::-1], np.uint8)) > 0)


class Site(NamedTuple):
    """Search area of a body."""

    scene: Scene
    structure: tuple[PlaneRegion, ...]  # walls, whose depth is not the object's
    near: Vector3  # a place on the object, at the height of its support
    reach_m: float  # of the axis, from that place
    radius_m: float  # approximate


class Strips(NamedTuple):
    """All views warped onto the plane through the axis that faces each (views, levels, 2 x cells): rows from the support up."""

    lab: np.ndarray  # (..., 3) uint8
    depth_odds: np.ndarray
    hidden: np.ndarray  # bool
    on_support: np.ndarray  # bool: what lies behind the place is the support

    @property
    def shown(self) -> np.ndarray:
        """Mask of the places without an occluder in front of the body."""
        return ~self.hidden


def views_of(scene: Scene, frames: Sequence[Frame], foot: Vector3, reach_m: float, tall_m: float) -> Iterator[View]:
    """Parts of the frames around a place on the support; frames that are too near are left out."""
    sides = (-2 * reach_m, 2 * reach_m)
    corners = foot + np.array([[x, y, z] for x in sides for y in sides for z in (0.0, tall_m)])
    for frame in frames:
        lift = support_offset(scene, frame, float(foot[2]), foot)
        local = frame.world_from_camera.inverse.apply(raised(corners, lift))
        if local[:, 2].min() < 0.15:
            continue
        camera = frame.rgb_camera
        uv = project(local, camera)
        left, top = np.floor(np.maximum(uv.min(axis=0), 0)).astype(int)
        right, bottom = np.ceil(np.minimum(uv.max(axis=0), [camera.width, camera.height])).astype(int)
        if right - left < 8 or bottom - top < 8:
            continue
        area = (slice(int(top), int(bottom)), slice(int(left), int(right)))
        small = shrunk(camera, area)
        part = cv2.resize(scene.balanced(frame.index)[area], (small.width, small.height), interpolation=cv2.INTER_AREA)
        yield View(frame, np.asarray(cv2.cvtColor(part, cv2.COLOR_RGB2LAB), np.uint8), small, lift)


def draw_strips(views: Sequence[View], site: Site, foot: Vector3, grid: Grid) -> Strips:
    """Strips of the views on the vertical planes through an axis."""
    drawn = [_strip(view, site, foot, grid) for view in views]
    return Strips(*(np.stack(part) for part in zip(*drawn, strict=True)))


def _strip(view: View, site: Site, foot: Vector3, grid: Grid) -> Strips:
    params, scene, frame = tuned(Params), site.scene, view.frame
    shape = (grid.levels, 2 * grid.cells)
    eye = frame.world_from_camera.translation
    away = (foot - eye) * [1.0, 1.0, 0.0] / max(float(np.linalg.norm((foot - eye)[:2])), 1e-6)
    right, up = np.array([away[1], -away[0], 0.0]), np.array([0.0, 0.0, 1.0])
    places = (foot + grid.across[:, None] * right + grid.heights[:, None, None] * up).reshape(-1, 3)
    local = frame.world_from_camera.inverse.apply(raised(places, view.lift_m))
    z = np.maximum(local[:, 2], 0.05)
    uv = (project(np.column_stack([local[:, :2], z]), view.camera) - 0.5).astype(np.float32)
    u, v = (uv[:, k].reshape(shape) for k in (0, 1))
    lab = np.asarray(cv2.remap(view.lab, u, v, cv2.INTER_LINEAR), np.uint8)
    outside = ((uv < 0) | (uv > [view.camera.width - 1, view.camera.height - 1])).any(axis=1)
    seen, inside = sample_nearest(scene.depth(frame.index), project(local, frame.depth_camera))
    known = inside & (seen > 0)
    beyond, noise = np.where(known, seen - z, 0.0), scene.noise.sigma(z)
    rays = (raised(places, view.lift_m) - eye) / z[:, None]
    on_support, to_wall = _room_behind(rays, z, raised(eye, -view.lift_m), foot, site)
    room = np.minimum(np.minimum(on_support, to_wall), 2 * site.radius_m)
    # Gaussian noise around the place itself against noise around the background; depth in front of the place supports the body
    # all the more.
    odds = np.clip(room * (room / 2 - beyond) / noise**2, -params.off_odds, params.on_odds) * known
    before = -(2 * grid.cells * grid.cell_m + params.hides_m + 3 * noise)
    hidden = outside | (known & (beyond < before))
    return Strips(lab, odds.reshape(shape), hidden.reshape(shape), (on_support < to_wall).reshape(shape))


def _room_behind(rays: Points, z_m: np.ndarray, eye: Vector3, foot: Vector3, site: Site) -> tuple[np.ndarray, np.ndarray]:
    """Distances along the optical axis from places at depths `z_m` to where rays (of depth 1) meet the support, and a wall."""
    with np.errstate(divide="ignore", invalid="ignore"):
        support = np.where(rays[:, 2] < 0, (foot[2] - eye[2]) / rays[:, 2] - z_m, np.inf)
        wall = np.full(len(rays), np.inf)
        for plane in site.structure:
            depth = ((plane.world_from_plane.translation - eye) @ plane.outward) / (rays @ plane.outward)
            met = np.isfinite(depth) & (depth > z_m)
            met[met] = plane.supports(eye + depth[met, None] * rays[met], 0.10)
            wall = np.where(met, np.minimum(wall, depth - z_m), wall)
    return np.maximum(support, 0.0), wall
