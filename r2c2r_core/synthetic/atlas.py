"""Texture atlas of all surfaces, painted and lit, so that a frame is a single texture lookup."""

from dataclasses import dataclass, field

import cv2
import numpy as np

from r2c2r_core.arrays import Faces, Image, Points
from r2c2r_core.synthetic.light import bake_light
from r2c2r_core.synthetic.mesh import join_patches
from r2c2r_core.synthetic.patches import Patch
from r2c2r_core.synthetic.textures import paint_tile

_WIDTH_PX = 4096
_PAD_PX = 2
_MIDDLE_TONE = 0.20  # linear; phones expose a little above 18 % grey


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LitScene:
    """Geometry and atlas for the renderer, in the kitchen frame."""

    vertices: Points
    faces: Faces
    attributes: np.ndarray  # (n, 3) float32: atlas x, atlas y in pixels (pixel centres at i + 0.5), patch index
    atlas: Image
    object_of_patch: np.ndarray  # (patches,) instance ids
    handle_patch: np.ndarray  # (patches,) bool
    gloss_of_patch: np.ndarray  # (patches,) float32
    normal_of_patch: np.ndarray  # (patches, 3): mean outward normal
    flat_patch: np.ndarray  # (patches,) bool
    reflectance_of_patch: np.ndarray  # (patches,) mean albedo, which determines the return of the depth sensor
    pane_faces: np.ndarray  # (faces,) bool, belongs to clear glass
    face_normals: np.ndarray  # (m, 3) outward
    face_offsets: np.ndarray  # (m,) of the faces' planes
    emitters: tuple["Emitter", ...]
    mover_of_patch: tuple[str, ...] = ()
    body_patch: np.ndarray = field(
        default_factory=lambda: np.zeros(0, bool)
    )  # (patches,) bool, moving parts other than the front


def front_patches(scene: LitScene) -> np.ndarray:
    """(patches,) mask of the patches of a front that can move: its panel and its handle."""
    return np.asarray(np.array([bool(mover) for mover in scene.mover_of_patch]) & ~scene.body_patch)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Emitter:
    """A rectangular light source."""

    corner: np.ndarray
    right: np.ndarray
    down: np.ndarray
    colour: np.ndarray  # RGB 0..1


def light_scene(patches: list[Patch], rng: np.random.Generator) -> LitScene:
    """Scene with all patches painted, lit and packed."""
    tiles = [paint_tile(*_tile_size(patch), patch.paint, rng) for patch in patches]
    albedo = np.array([tile.reshape(-1, 3).mean(axis=0) for tile in tiles])
    panes = np.array([patch.paint.kind == "glass" for patch in patches])
    light = _light_through(patches, panes, albedo, rng)
    emitters = np.array([patch.paint.kind == "emitter" for patch in patches])
    exposure = _exposure(patches, albedo, light)
    lit = [
        np.ones_like(tile) if emitter else tile * np.maximum(cv2.resize(grid, tile.shape[1::-1]), 0.0) * exposure
        for tile, grid, emitter in zip(tiles, light, emitters, strict=True)
    ]
    places, height = _shelve([tile.shape[:2] for tile in lit])
    atlas = np.zeros((height, _WIDTH_PX, 3), np.uint8)
    for tile, (x, y) in zip(lit, places, strict=True):
        framed = cv2.copyMakeBorder(_tone(tile), _PAD_PX, _PAD_PX, _PAD_PX, _PAD_PX, cv2.BORDER_REPLICATE)
        atlas[y : y + framed.shape[0], x : x + framed.shape[1]] = framed
    mesh = join_patches(patches)
    sizes = np.array([tile.shape[:2] for tile in lit])[mesh.patch_of_vertex]
    corner = np.array(places)[mesh.patch_of_vertex] + _PAD_PX
    attributes = np.column_stack(
        [corner[:, 0] + mesh.unit[:, 1] * sizes[:, 1], corner[:, 1] + mesh.unit[:, 0] * sizes[:, 0], mesh.patch_of_vertex]
    )
    first, second, third = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    normals = np.cross(second - first, third - first)
    return LitScene(
        vertices=mesh.vertices,
        faces=mesh.faces,
        attributes=attributes.astype(np.float32),
        atlas=atlas,
        object_of_patch=np.array([patch.object_id for patch in patches]),
        handle_patch=np.array([patch.is_handle for patch in patches]),
        gloss_of_patch=np.array([patch.paint.gloss for patch in patches], np.float32),
        normal_of_patch=np.array([_normal(patch) for patch in patches]),
        flat_patch=np.array([_is_flat(patch) for patch in patches]),
        reflectance_of_patch=albedo.mean(axis=1),
        pane_faces=panes[mesh.patch_of_vertex[mesh.faces[:, 0]]],
        face_normals=normals,
        face_offsets=np.einsum("ij,ij->i", normals, first),
        emitters=tuple(_emitter(patch) for patch in patches if patch.paint.kind == "emitter"),
        mover_of_patch=tuple(patch.mover for patch in patches),
        body_patch=np.array([patch.is_body for patch in patches]),
    )


def _light_through(patches: list[Patch], panes: np.ndarray, albedo: np.ndarray, rng: np.random.Generator) -> list[np.ndarray]:
    """Light on every patch; panes neither block light nor have light of their own."""
    solid = np.flatnonzero(~panes)
    light = [np.ones((1, 1, 3), np.float32)] * len(patches)
    for index, grid in zip(solid, bake_light([patches[i] for i in solid], albedo[solid], rng), strict=True):
        light[index] = grid
    return light


def _emitter(patch: Patch) -> Emitter:
    grid = patch.grid
    return Emitter(
        corner=grid[0, 0], right=grid[0, -1] - grid[0, 0], down=grid[-1, 0] - grid[0, 0], colour=np.array(patch.paint.colour)
    )


def _tile_size(patch: Patch) -> tuple[int, int]:
    width, height = (int(np.clip(np.ceil(size / patch.paint.texel_m), 2, _WIDTH_PX - 2 * _PAD_PX)) for size in patch.size_m)
    return height, width


def _shelve(sizes: list[tuple[int, int]]) -> tuple[list[tuple[int, int]], int]:
    """Shelf packing: positions (x, y) of the padded tiles, tallest first, and the height used."""
    places = [(0, 0)] * len(sizes)
    x = y = shelf = 0
    for index in sorted(range(len(sizes)), key=lambda i: (-sizes[i][0], i)):
        height, width = sizes[index][0] + 2 * _PAD_PX, sizes[index][1] + 2 * _PAD_PX
        if x + width > _WIDTH_PX:
            x, y, shelf = 0, y + shelf, 0
        places[index] = (x, y)
        x, shelf = x + width, max(shelf, height)
    return places, y + shelf


def _exposure(patches: list[Patch], albedo: np.ndarray, light: list[np.ndarray]) -> float:
    """Gain of an automatic exposure: the run and its surroundings average to a middle tone."""
    radiance = np.array([float(albedo[i].mean() * light[i].mean()) for i in range(len(patches))])
    area = np.array([patch.size_m[0] * patch.size_m[1] for patch in patches])
    things = np.array([patch.object_id > 0 for patch in patches])
    room = np.array([patch.object_id == 0 and patch.paint.kind != "emitter" for patch in patches])
    mean = 0.6 * np.average(radiance[things], weights=area[things]) + 0.4 * np.average(radiance[room], weights=area[room])
    return float(_MIDDLE_TONE / max(mean, 1e-4))


def _tone(linear: np.ndarray) -> np.ndarray:
    """Linear light to 8-bit sRGB with a soft shoulder and the contrast that phones add."""
    soft = np.where(linear < 0.6, linear, 0.6 + 0.4 * (1 - np.exp(-(linear - 0.6) / 0.4)))
    srgb = np.clip(np.where(soft < 0.0031308, 12.92 * soft, 1.055 * np.maximum(soft, 1e-6) ** (1 / 2.4) - 0.055), 0, 1)
    crisp = 0.6 * srgb + 0.4 * srgb * srgb * (3 - 2 * srgb)
    return np.asarray((crisp * 255 + 0.5).astype(np.uint8))


def _normal(patch: Patch) -> np.ndarray:
    grid = patch.grid
    normal = np.cross(grid[-1, 0] - grid[0, 0], grid[0, -1] - grid[0, 0])
    return np.asarray(normal / max(float(np.linalg.norm(normal)), 1e-12))


def _is_flat(patch: Patch) -> bool:
    return (
        float(np.abs((patch.grid - patch.grid[0, 0]) @ _normal(patch)).max()) < 1e-4
        and float(np.linalg.norm(_normal(patch))) > 0.5
    )
