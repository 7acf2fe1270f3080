"""CPU renderings of a mesh for display."""

from collections.abc import Callable

import cv2
import numpy as np

from r2c2r_core.arrays import Mask, Matrix3, Points
from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.raster import rasterize
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.mesh import TexturedMesh

SIZE = 320
TURNS = 24  # number of turntable pictures, side by side from left to right
TURN_SIZE = 240
_MARK, _FADED = np.array([235.0, 95.0, 20.0]), 0.2  # RGB of marked points, and the fraction of their own colour kept
_AZIMUTH, _ELEVATION = np.deg2rad(-30.0), np.deg2rad(20.0)


def mesh_picture(mesh: TexturedMesh, rotation: Matrix3) -> bytes:
    """PNG of the mesh on a transparent background, from the same side and distance for every candidate."""
    return cv2.imencode(".png", _drawn(mesh, mesh.vertices @ rotation.T, 0.0, SIZE))[1].tobytes()


def turntable(mesh: TexturedMesh, rotation: Matrix3, marked: Callable[[Points], Mask] | None = None) -> bytes:
    """PNG of the mesh from `TURNS` sides about its upright axis; points (n, 3) that are `marked` have another colour."""
    upright_points = mesh.vertices @ rotation.T
    sides = [_drawn(mesh, upright_points, 2 * np.pi * k / TURNS, TURN_SIZE, marked) for k in range(TURNS)]
    return cv2.imencode(".png", np.hstack(sides))[1].tobytes()


def _drawn(
    mesh: TexturedMesh, points: Points, turn_rad: float, size: int, marked: Callable[[Points], Mask] | None = None
) -> np.ndarray:
    """BGRA (size, size, 4) of an upright mesh, rotated by `turn_rad`."""
    around = Rigid3(cv2.Rodrigues(np.array([0.0, 0.0, turn_rad]))[0])
    vertices = around.apply(unit(points))
    camera = Intrinsics(fx=1.9 * size, fy=1.9 * size, cx=size / 2, cy=size / 2, width=size, height=size)
    attributes = np.column_stack([mesh.uv, np.ones(len(vertices))])
    drawn = rasterize(vertices, mesh.faces, attributes, camera, _camera_from_world())
    hit = drawn.depth_m > 0
    colours = textured(mesh.texture, drawn.attributes)
    if marked is not None:
        places = rasterize(vertices, mesh.faces, np.asarray(points), camera, _camera_from_world()).attributes[hit]
        colours[hit] = np.where(marked(places)[:, None], _FADED * colours[hit] + (1 - _FADED) * _MARK, colours[hit])
    shaded = np.clip(colours * _shading(drawn.depth_m, camera)[..., None], 0, 255).astype(np.uint8)
    return np.dstack([shaded[..., ::-1], hit.astype(np.uint8) * 255])


def _camera_from_world() -> Rigid3:
    """A camera before the front (-Y), a little to the side and above, looking at the origin."""
    away = np.array([np.sin(_AZIMUTH) * np.cos(_ELEVATION), -np.cos(_AZIMUTH) * np.cos(_ELEVATION), np.sin(_ELEVATION)])
    forward = -away
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    down = np.cross(forward, right)
    rotation = np.stack([right, down, forward])
    return Rigid3(rotation, -rotation @ (away * 4.2))


def _shading(depth: np.ndarray, camera: Intrinsics) -> np.ndarray:
    """Headlight shading, which shows shape on plain textures."""
    dy, dx = np.gradient(np.where(depth > 0, depth, np.nan))
    scale = camera.fx / np.where(depth > 0, depth, 1.0)
    cosine = 1.0 / np.sqrt(1.0 + (dx * scale) ** 2 + (dy * scale) ** 2)
    return np.asarray(0.55 + 0.45 * np.nan_to_num(cosine, nan=0.6))


def textured(texture: np.ndarray, uv: np.ndarray) -> np.ndarray:
    """The colours (..., 3) of a texture at uv (..., 2)."""
    height, width = texture.shape[:2]
    u = np.clip((uv[..., 0] * width).astype(int), 0, width - 1)
    v = np.clip(((1.0 - uv[..., 1]) * height).astype(int), 0, height - 1)
    return texture[v, u].astype(np.float32)


def unit(vertices: np.ndarray) -> np.ndarray:
    """Vertices centred and scaled to a bounding sphere of radius 1."""
    centre = (vertices.min(axis=0) + vertices.max(axis=0)) / 2
    moved = vertices - centre
    return np.asarray(moved / max(float(np.linalg.norm(moved, axis=1).max()), 1e-9))
