"""CPU rendering of a running simulation without GL: colour, depth and body index per pixel."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from r2c2r_core.arrays import DepthMetres, Image, Points, Vector3
from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.raster import rasterize
from r2c2r_core.geometry.texels import texture_colours
from r2c2r_core.geometry.transforms import Rigid3

_SKY = 246.0
_LONGEST_M = 0.5  # side of a floor tile: the rasteriser drops triangles that cross the near plane
_FLOOR_M = 3.0  # half side of the drawn part of an infinite plane
_SEEN_GROUPS = (0, 2)  # the gripper, and a bundle's visuals
_PLANE, _BOX, _MESH = 0, 6, 7  # mjtGeom


class Seen(NamedTuple):
    """A rendered camera image."""

    rgb: Image
    depth_m: DepthMetres  # 0: nothing
    body: np.ndarray  # (h, w) int32 of the model's bodies; -1: nothing


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Surfaces:
    """Triangles of all visible geoms, in their own frames."""

    geoms: np.ndarray  # (g,) of the model
    starts: np.ndarray  # (g + 1,) of their corners
    corners: Points  # (3 m, 3)
    uv: np.ndarray  # (3 m, 2)
    textures: tuple[Image | None, ...]  # of each geom; None: its colour
    colours: np.ndarray  # (g, 3), 0..255


def surfaces_of(model: Any) -> Surfaces:
    """The drawable surfaces of a model."""
    shown = [model.geom_group[g] in _SEEN_GROUPS or model.geom_type[g] == _PLANE for g in range(model.ngeom)]
    seen = [int(g) for g in np.flatnonzero(shown) if model.geom_rgba[g][3] > 0.05]
    parts = [(g, *shape) for g in seen if (shape := _triangles(model, g)) is not None]
    return Surfaces(
        geoms=np.array([g for g, _, _ in parts], dtype=np.int64),
        starts=np.cumsum([0, *(len(corners) for _, corners, _ in parts)]),
        corners=np.concatenate([corners for _, corners, _ in parts]),
        uv=np.concatenate([uv for _, _, uv in parts]),
        textures=tuple(_texture(model, g) for g, _, _ in parts),
        colours=np.array([_colour(model, g) for g, _, _ in parts], np.float32),
    )


class Poses(NamedTuple):
    """Poses of all geoms of a model, as in MjData."""

    geom_xpos: np.ndarray  # (g, 3)
    geom_xmat: np.ndarray  # (g, 9)


def poses_now(data: Any) -> Poses:
    """A copy of the current geom poses, for later rendering."""
    return Poses(data.geom_xpos.copy(), data.geom_xmat.copy())


def look(surfaces: Surfaces, model: Any, data: Any, camera: Intrinsics, camera_from_world: Rigid3) -> Seen:
    """Rendering of the model at the poses of `data` (MjData, or stored Poses)."""
    corners = np.zeros_like(surfaces.corners)
    for number, geom in enumerate(surfaces.geoms):
        part = slice(surfaces.starts[number], surfaces.starts[number + 1])
        corners[part] = surfaces.corners[part] @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom]
    ids = np.repeat(np.arange(1.0, len(surfaces.geoms) + 1), np.diff(surfaces.starts))
    faces = np.arange(len(corners)).reshape(-1, 3)
    marks = rasterize(corners, faces, np.column_stack([surfaces.uv, ids]), camera, camera_from_world)
    number = np.rint(marks.attributes[..., 2]).astype(np.int64) - 1
    body = np.where(number >= 0, np.append(model.geom_bodyid[surfaces.geoms], -1)[number], -1)
    colour = _albedo(surfaces, number, marks.attributes[..., :2])
    light = _light(marks.depth_m, camera)
    colour[number >= 0] *= light[number >= 0][:, None]
    return Seen(np.asarray(colour.clip(0, 255), dtype=np.uint8), marks.depth_m, np.asarray(body, dtype=np.int32))


def aimed(eye: Vector3, target: Vector3, size: tuple[int, int], field_rad: float) -> tuple[Intrinsics, Rigid3]:
    """An upright camera at `eye` that looks at `target`, `field_rad` high, and camera_from_world."""
    width, height = size
    focal = height / 2 / np.tan(field_rad / 2)
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    rotation = np.stack([right, np.cross(forward, right), forward])
    camera = Intrinsics(fx=focal, fy=focal, cx=width / 2, cy=height / 2, width=width, height=height)
    return camera, Rigid3(rotation, -rotation @ eye)


def _albedo(surfaces: Surfaces, number: np.ndarray, uv: np.ndarray) -> np.ndarray:
    colour = np.concatenate([surfaces.colours, np.full((1, 3), _SKY, np.float32)])[number]
    for geom, texture in enumerate(surfaces.textures):
        if texture is not None and (own := number == geom).any():
            colour[own] = texture_colours(texture, uv[own]) * (surfaces.colours[geom] / 255)  # tinted by its material
    return np.asarray(colour)


def _light(depth_m: DepthMetres, camera: Intrinsics) -> np.ndarray:
    """Headlight shading 0.6 to 1 by surface orientation, from depth alone."""
    rows, columns = np.indices(depth_m.shape)
    x, y = (columns + 0.5 - camera.cx) / camera.fx * depth_m, (rows + 0.5 - camera.cy) / camera.fy * depth_m
    points = np.stack([x, y, depth_m], axis=-1)
    normal = np.cross(np.gradient(points, axis=1), np.gradient(points, axis=0))
    length = np.maximum(np.linalg.norm(normal, axis=-1), 1e-12)
    return np.asarray(0.6 + 0.4 * np.abs(normal[..., 2]) / length)


def _triangles(model: Any, geom: int) -> tuple[Points, np.ndarray] | None:
    """Corners (3 m, 3) and uv of a geom; None for a shape that does not occur in bundles."""
    kind = model.geom_type[geom]
    if kind == _MESH:
        return _mesh(model, int(model.geom_dataid[geom]))
    if kind == _BOX:
        corners = _box(model.geom_size[geom])
        return corners, np.zeros((len(corners), 2))
    if kind == _PLANE:
        reach = np.where(model.geom_size[geom][:2] > 0, np.minimum(model.geom_size[geom][:2], _FLOOR_M), _FLOOR_M)
        corners = _tiles(reach)
        return corners, np.zeros((len(corners), 2))
    return None


def _mesh(model: Any, mesh: int) -> tuple[Points, np.ndarray]:
    first, faces = (
        int(model.mesh_vertadr[mesh]),
        slice(model.mesh_faceadr[mesh], model.mesh_faceadr[mesh] + model.mesh_facenum[mesh]),
    )
    corners = model.mesh_vert[first + model.mesh_face[faces].ravel()].astype(np.float64)
    uv = np.zeros((len(corners), 2))
    if model.mesh_texcoordadr[mesh] >= 0:
        uv = model.mesh_texcoord[model.mesh_texcoordadr[mesh] + model.mesh_facetexcoord[faces].ravel()].astype(np.float64)
        uv[:, 1] = 1.0 - uv[:, 1]  # MuJoCo counts rows from the top
    return corners, uv


def _texture(model: Any, geom: int) -> Image | None:
    material = int(model.geom_matid[geom])
    number = -1 if material < 0 else int(model.mat_texid[material].max())
    if number < 0 or model.geom_type[geom] != _MESH:
        return None
    height, width, channels = int(model.tex_height[number]), int(model.tex_width[number]), int(model.tex_nchannel[number])
    start = int(model.tex_adr[number])
    return np.ascontiguousarray(
        model.tex_data[start : start + height * width * channels].reshape(height, width, channels)[..., :3]
    )


def _colour(model: Any, geom: int) -> np.ndarray:
    material = int(model.geom_matid[geom])
    if model.geom_type[geom] == _PLANE:
        return np.array([206.0, 205.0, 202.0])
    return np.asarray(255.0 * (model.geom_rgba[geom] if material < 0 else model.mat_rgba[material])[:3])


def _box(half: Vector3) -> Points:
    """Corners of a box's twelve triangles."""
    face = np.array([[-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, -1, 1], [1, 1, 1], [-1, 1, 1]])
    turned = [sign * np.roll(face, axis, axis=1) for axis in range(3) for sign in (-1.0, 1.0)]
    return np.asarray(np.concatenate(turned) * half, dtype=np.float64)


def _tiles(reach: np.ndarray) -> Points:
    """Triangles of a tiled rectangle in z = 0."""
    steps = [np.linspace(-r, r, max(round(2 * r / _LONGEST_M), 1) + 1) for r in reach]
    squares = [
        [[x0, y0, 0], [x1, y0, 0], [x1, y1, 0], [x0, y0, 0], [x1, y1, 0], [x0, y1, 0]]
        for x0, x1 in zip(steps[0][:-1], steps[0][1:], strict=True)
        for y0, y1 in zip(steps[1][:-1], steps[1][1:], strict=True)
    ]
    return np.array(squares, dtype=np.float64).reshape(-1, 3)
