"""CPU rasterisation of textured triangles with OpenCV 5 (no GL): colour, depth and ids.

Depth equals Embree's to 1.5e-5 m at the 99th percentile; 8 ms for 20k faces at 640x480. The rasteriser smears triangles that
cross the near plane: those are dropped, so split room-sized triangles to 0.3 m first (`subdivide_long_edges`).
"""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from r2c2r_core.arrays import DepthMetres, Faces, Points, Texture, TextureCoords
from r2c2r_core.geometry.camera import Intrinsics, project
from r2c2r_core.geometry.meshes import AnyFaces, AnyPoints
from r2c2r_core.geometry.transforms import Rigid3

# The output has sizes of its own: `h`, `w`, `n`, `m` would tie it to the texture or mesh it is drawn from.
AnyImage = UInt8[np.ndarray, "_ _ 3"]
AnyDepth = Float[np.ndarray, "_ _"]

_CAMERA_GL_FROM_CV = np.diag([1.0, -1.0, -1.0, 1.0])
_NEAR_M, _FAR_M = 0.02, 20.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Raster:
    """Rendered z-depth (0 = nothing) and three interpolated attributes per pixel."""

    depth_m: DepthMetres
    attributes: np.ndarray  # (h, w, 3) float32


def rasterize(
    vertices_world: Points, faces: Faces, attributes: np.ndarray, camera: Intrinsics, camera_from_world: Rigid3
) -> Raster:
    """Depth and perspective-correct attributes (n, 3) of a triangle mesh; both sides of a face are drawn."""
    vertices = np.ascontiguousarray(vertices_world, dtype=np.float32)
    points = vertices @ camera_from_world.rotation.T.astype(np.float32) + camera_from_world.translation.astype(np.float32)
    visible = faces[(points[:, 2] > _NEAR_M)[faces].all(axis=1)].astype(np.int32, copy=False)
    size = camera.height, camera.width
    depth, interpolated = np.zeros(size, np.float32), np.zeros((*size, 3), np.float32)
    rows, columns = window = _window(points[points[:, 2] > _NEAR_M] if len(visible) else points[:0], camera)
    width, height = columns.stop - columns.start, rows.stop - rows.start
    if width and height:
        # The rasteriser draws with fx = fy and a centred principal point: scale in x, and shear to the centre of the window.
        shear = np.eye(4)
        shear[:2, 2] = (camera.cx - columns.start - width / 2) / camera.fx, (camera.cy - rows.start - height / 2) / camera.fy
        view = np.diag([camera.fx / camera.fy, 1.0, 1.0, 1.0]) @ _CAMERA_GL_FROM_CV @ shear @ camera_from_world.matrix
        found, drawn = np.full((height, width), _FAR_M, np.float32), np.zeros((height, width, 3), np.float32)
        cv2.triangleRasterize(
            vertices.reshape(-1, 1, 3),
            np.ascontiguousarray(visible),
            np.ascontiguousarray(attributes, dtype=np.float32).reshape(-1, 1, 3),
            drawn,
            found,
            view.astype(np.float32),
            2 * np.arctan(height / 2 / camera.fy),
            _NEAR_M,
            _FAR_M,
            _settings(),
        )
        hit = found < _FAR_M * 0.999
        depth[window], interpolated[window] = np.where(hit, found, 0), np.where(hit[..., None], drawn, 0)
    return Raster(depth_m=depth, attributes=interpolated)


def _window(points: np.ndarray, camera: Intrinsics) -> tuple[slice, slice]:
    """Rows and columns of the image that a mesh with these vertices (camera coordinates) may cover."""
    if not len(points):
        return slice(0, 0), slice(0, 0)
    at = project(points, camera)
    ends = np.clip([np.floor(at.min(axis=0)), np.ceil(at.max(axis=0)) + 1], 0, [camera.width, camera.height])
    (left, top), (right, bottom) = ends.astype(int).tolist()
    return slice(top, bottom), slice(left, right)


def sample_texture(texture: Texture, uv: np.ndarray) -> AnyImage:
    """Texture colours at uv (h, w, 2); v = 0 is the bottom row, as in OBJ and glTF viewers after loading."""
    height, width = texture.shape[:2]
    x = np.ascontiguousarray(uv[..., 0], dtype=np.float32) * width - 0.5
    y = (1.0 - np.ascontiguousarray(uv[..., 1], dtype=np.float32)) * height - 0.5
    return np.asarray(cv2.remap(texture, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE), dtype=np.uint8)


def render_textured(
    vertices_world: Points, faces: Faces, uv: TextureCoords, texture: Texture, camera: Intrinsics, camera_from_world: Rigid3
) -> tuple[AnyImage, AnyDepth]:
    """RGB (black where nothing) and z-depth (0 where nothing) of a textured mesh."""
    attributes = np.column_stack([uv, np.ones(len(uv))])
    raster = rasterize(vertices_world, faces, attributes, camera, camera_from_world)
    image = sample_texture(texture, raster.attributes[..., :2])
    image[raster.depth_m == 0] = 0
    return image, raster.depth_m


def subdivide_long_edges(
    vertices: Points, faces: Faces, attributes: np.ndarray, longest_m: float
) -> tuple[AnyPoints, AnyFaces, np.ndarray]:
    """Split triangles until no edge exceeds `longest_m`; attributes (n, k) are interpolated."""
    from trimesh.remesh import subdivide_to_size

    packed = np.column_stack([vertices, attributes])
    # subdivide_to_size measures all columns; scale attributes down so that only positions count
    packed[:, 3:] *= 1e-6
    split, split_faces = subdivide_to_size(packed, faces, max_edge=longest_m, max_iter=12)
    return split[:, :3], split_faces, split[:, 3:] * 1e6


def _settings() -> "cv2.TriangleRasterizeSettings":
    settings = cv2.TriangleRasterizeSettings()
    settings.setCullingMode(cv2.RASTERIZE_CULLING_NONE)
    settings.setShadingType(cv2.RASTERIZE_SHADING_SHADED)
    return settings
