"""The fused surface as each frame would see it: occluders that the sensor missed, and depth where it has none."""

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from os import cpu_count
from typing import TypeVar

import numpy as np

from r2c2r_core.arrays import Faces, Points
from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.raster import rasterize
from r2c2r_core.model.capture import Frame, SceneSurface

A = TypeVar("A")
B = TypeVar("B")

WIDTH_PX = 256  # of the drawn surface: the occluders that sensors miss are broad
_PART_M = 0.5  # parts of the surface outside the view are left out


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceParts:
    """A surface cut into parts, each with a ball around it, so that a frame draws only those it may see."""

    vertices: Points  # float32
    faces: Faces  # sorted by part
    starts: np.ndarray  # of each part in `faces`, and the end
    centres: Points
    radii_m: np.ndarray


def parts_of(surface: SceneSurface) -> SurfaceParts:
    """Cut a surface at a coarse grid."""
    corners = surface.vertices_world[surface.faces]
    middles = corners.mean(axis=1)
    cells = np.floor(middles / _PART_M).astype(np.int64)
    _, part = np.unique(cells, axis=0, return_inverse=True)
    order = np.argsort(part, kind="stable")
    counts = np.bincount(part)
    centres = np.stack([np.bincount(part, middles[:, k]) for k in range(3)], axis=1) / np.maximum(counts, 1)[:, None]
    reach = np.linalg.norm(corners - centres[part][:, None], axis=2).max(axis=1)
    radii = np.zeros(len(counts))
    np.maximum.at(radii, part, reach)
    starts = np.concatenate([[0], counts.cumsum()])
    return SurfaceParts(
        surface.vertices_world.astype(np.float32), surface.faces[order].astype(np.int32), starts, centres, radii
    )


def draw(parts: SurfaceParts, frame: Frame) -> np.ndarray:
    """Depth of the surface from a frame, uint16 millimetres, 0 where the scan has nothing."""
    width, height = drawn_size(frame.rgb_camera)
    camera = frame.rgb_camera.resized(width, height)
    shown = np.flatnonzero(_may_be_seen(parts, frame))
    faces = [parts.faces[parts.starts[i] : parts.starts[i + 1]] for i in shown]
    if not faces:
        return np.zeros((height, width), np.uint16)
    nothing = np.zeros_like(parts.vertices)
    raster = rasterize(parts.vertices, np.concatenate(faces), nothing, camera, frame.world_from_camera.inverse)
    return (raster.depth_m * 1000 + 0.5).clip(0, 65535).astype(np.uint16)


def drawn_size(camera: Intrinsics) -> tuple[int, int]:
    """Width and height of the drawn surface."""
    return WIDTH_PX, max(1, round(WIDTH_PX * camera.height / camera.width))


def in_threads(work: Callable[[A], B], items: Iterable[A]) -> Iterator[B]:
    """The results in order, computed on all cores; what is not begun is dropped when the caller stops asking."""
    pool = ThreadPoolExecutor(min(4, cpu_count() or 1))
    try:
        yield from pool.map(work, items)
    finally:
        pool.shutdown(cancel_futures=True)


def _may_be_seen(parts: SurfaceParts, frame: Frame) -> np.ndarray:
    """Which balls reach into the frame's viewing pyramid."""
    camera = frame.rgb_camera
    local = frame.world_from_camera.inverse.apply(parts.centres)
    sides = np.array(
        [
            [camera.fx, 0, camera.cx],
            [-camera.fx, 0, camera.width - camera.cx],
            [0, camera.fy, camera.cy],
            [0, -camera.fy, camera.height - camera.cy],
            [0, 0, 1],
        ]
    )
    sides = sides / np.linalg.norm(sides, axis=1, keepdims=True)
    return np.asarray((local @ sides.T > -parts.radii_m[:, None] - 0.01).all(axis=1))
