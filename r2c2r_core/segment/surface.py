"""Spatial index of the fused surface: triangles near a point, and its depth image from each frame."""

from dataclasses import dataclass

import numpy as np

from r2c2r_core.arrays import Faces, Points, Vector3
from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.raster import rasterize
from r2c2r_core.model.capture import Frame, SceneSurface

_PART_M = 0.5
_NONE = np.zeros(0, np.int64)


_WIDTH_PX = 256  # width of the rendered depth image: the occluders that sensors miss are broad


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceParts:
    """A surface cut into parts, each with a bounding sphere, so that a frame draws only those it may see."""

    vertices: Points  # float32
    faces: Faces  # sorted by part
    numbers: np.ndarray  # index in the surface of each of these faces
    starts: np.ndarray  # start of each part in `faces`, and the end
    centres: Points
    radii_m: np.ndarray
    # By face index in the surface:
    upward: np.ndarray  # cosine between the face's own normal and up
    middles: Points
    normals: Points  # smoothed
    areas_m2: np.ndarray

    def faces_near(self, point_world: Vector3, reach_m: float, *, any_height: bool = False) -> np.ndarray:
        """Sorted indices of the surface's faces that may have a corner within reach; farther ones may be included."""
        away = (self.centres - point_world)[:, : 2 if any_height else 3]
        near = np.flatnonzero(np.linalg.norm(away, axis=1) < reach_m + self.radii_m)
        return np.sort(np.concatenate([self.numbers[self.starts[i] : self.starts[i + 1]] for i in near] or [_NONE]))


def parts_of(surface: SceneSurface) -> SurfaceParts:
    """Surface cut at a coarse grid."""
    if len(surface.faces) == 0:
        empty = surface.faces.astype(np.int32)
        nothing = np.zeros(0)
        return SurfaceParts(
            surface.vertices_world.astype(np.float32),
            empty,
            _NONE,
            _NONE[:1],
            np.zeros((0, 3)),
            nothing,
            nothing,
            np.zeros((0, 3)),
            np.zeros((0, 3)),
            nothing,
        )
    corners = surface.vertices_world[surface.faces]
    middles, normals, areas = face_normals(surface.vertices_world, surface.faces)
    cells = np.floor(middles / _PART_M).astype(np.int64)
    cells -= cells.min(axis=0)
    span = cells.max(axis=0) + 1
    _, part = np.unique((cells[:, 0] * span[1] + cells[:, 1]) * span[2] + cells[:, 2], return_inverse=True)
    order = np.argsort(part, kind="stable")
    counts = np.bincount(part)
    centres = np.stack([np.bincount(part, middles[:, k]) for k in range(3)], axis=1) / np.maximum(counts, 1)[:, None]
    reach = np.linalg.norm(corners - centres[part][:, None], axis=2).max(axis=1)
    radii = np.zeros(len(counts))
    np.maximum.at(radii, part, reach)
    starts = np.concatenate([[0], counts.cumsum()])
    vertices = surface.vertices_world.astype(np.float32)
    faces = surface.faces[order].astype(np.int32)
    return SurfaceParts(vertices, faces, order, starts, centres, radii, _upward(corners), middles, normals, areas)


def face_normals(vertices: Points, faces: Faces) -> tuple[Points, Points, np.ndarray]:
    """Centres, unit normals averaged over two rings (those of a 1 cm TSDF are noisy) and areas of triangles."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    raw = np.cross(b - a, c - a)
    areas = 0.5 * np.linalg.norm(raw, axis=1)
    for _ in range(2):
        smooth = np.zeros_like(vertices)
        for k in range(3):
            for axis in range(3):
                smooth[:, axis] += np.bincount(faces[:, k], raw[:, axis], len(vertices))
        raw = smooth[faces[:, 0]] + smooth[faces[:, 1]] + smooth[faces[:, 2]]
    return (a + b + c) / 3, raw / np.maximum(np.linalg.norm(raw, axis=1, keepdims=True), 1e-12), areas


def _upward(corners: np.ndarray) -> np.ndarray:
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    x = first[:, 1] * second[:, 2] - first[:, 2] * second[:, 1]
    y = first[:, 2] * second[:, 0] - first[:, 0] * second[:, 2]
    z = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    return np.asarray(z / np.maximum(np.sqrt(x * x + y * y + z * z), 1e-12))


def draw(parts: SurfaceParts, frame: Frame) -> np.ndarray:
    """Depth image of the surface from a frame, uint16 millimetres, 0 where the scan has no surface."""
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
    """Width and height of the rendered depth image."""
    return _WIDTH_PX, max(1, round(_WIDTH_PX * camera.height / camera.width))


def _may_be_seen(parts: SurfaceParts, frame: Frame) -> np.ndarray:
    """Mask of the parts whose bounding spheres reach into the frame's viewing frustum."""
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
