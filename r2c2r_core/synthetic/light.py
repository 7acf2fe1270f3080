"""Baked lighting of every surface: soft shadows from the window and the lamp, and interreflections between the surfaces.

Irradiance is stored on a coarse grid per patch ("lumels"), in units in which radiosity = albedo * light.
"""

from dataclasses import dataclass

import cv2
import numpy as np

from r2c2r_core.synthetic.patches import Patch

_SHADOW_RAYS = 20
_BOUNCE_RAYS = 40
_BOUNCES = 3
_CHUNK = 40_000
_NEAREST_M2 = 0.03  # limits the irradiance of surfaces that touch a lamp


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Lumels:
    positions: np.ndarray  # (n, 3)
    normals: np.ndarray  # (n, 3)
    first: np.ndarray  # (patches,) index of each patch's first lumel
    shape: np.ndarray  # (patches, 2) rows, columns


def bake_light(patches: list[Patch], albedo: np.ndarray, rng: np.random.Generator) -> list[np.ndarray]:
    """Incoming light (rows, columns, 3) of every patch; `albedo` (patches, 3) is its mean colour."""
    lumels = _place_lumels(patches)
    scene, patch_of_face, corners = _ray_scene(patches)
    direct = np.zeros_like(lumels.positions)
    for patch in patches:
        if patch.paint.kind == "emitter":
            radiance = np.array(patch.paint.colour) * np.array(patch.paint.accent)
            direct += _direct_light(scene, lumels, patch, radiance, rng)
    glowing = np.array([patch.paint.kind == "emitter" for patch in patches])
    albedo = np.where(glowing[:, None], 0.0, albedo)  # their light is in `direct` already
    albedo_of_lumel = np.concatenate([np.repeat(albedo[i : i + 1], r * c, axis=0) for i, (r, c) in enumerate(lumels.shape)])
    hits = _bounce_hits(scene, lumels, patch_of_face, corners, rng)
    total = direct
    for _ in range(_BOUNCES):
        leaving = np.vstack([albedo_of_lumel * total, np.zeros((1, 3))])  # the last row: rays that left the room
        total = direct + leaving[hits].mean(axis=1)
    grids = []
    for index in range(len(patches)):
        grid = total[_range_of(lumels, index)].reshape(*lumels.shape[index], 3).astype(np.float32)
        grids.append(
            np.asarray(cv2.GaussianBlur(grid, (3, 3), 0.8, borderType=cv2.BORDER_REPLICATE))
            if min(grid.shape[:2]) > 2
            else grid
        )
    return grids


def _place_lumels(patches: list[Patch]) -> _Lumels:
    positions, normals, first, shapes, count = [], [], [], [], 0
    for patch in patches:
        columns = int(np.clip(np.ceil(patch.size_m[0] / patch.lumel_m), 1, 160))
        rows = int(np.clip(np.ceil(patch.size_m[1] / patch.lumel_m), 1, 160))
        point, normal = _surface_at(patch, rows, columns)
        positions.append(point + 0.0012 * normal)
        normals.append(normal)
        first.append(count)
        shapes.append((rows, columns))
        count += rows * columns
    return _Lumels(
        positions=np.concatenate(positions), normals=np.concatenate(normals), first=np.array(first), shape=np.array(shapes)
    )


def _surface_at(patch: Patch, rows: int, columns: int) -> tuple[np.ndarray, np.ndarray]:
    """Positions and outward normals at the centres of a rows x columns grid."""
    grid_rows, grid_columns = patch.grid.shape[0] - 1, patch.grid.shape[1] - 1
    t = (np.arange(rows) + 0.5) / rows * grid_rows
    s = (np.arange(columns) + 0.5) / columns * grid_columns
    i, j = np.minimum(t.astype(int), grid_rows - 1), np.minimum(s.astype(int), grid_columns - 1)
    a, b = (t - i)[:, None, None], (s - j)[None, :, None]
    g = patch.grid
    tl, tr = g[np.ix_(i, j)], g[np.ix_(i, j + 1)]
    bl, br = g[np.ix_(i + 1, j)], g[np.ix_(i + 1, j + 1)]
    point = (1 - a) * ((1 - b) * tl + b * tr) + a * ((1 - b) * bl + b * br)
    right = (1 - a) * (tr - tl) + a * (br - bl)
    down = (1 - b) * (bl - tl) + b * (br - tr)
    normal = np.cross(down, right)
    normal /= np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-12)
    return point.reshape(-1, 3), normal.reshape(-1, 3)


def _ray_scene(patches: list[Patch]) -> tuple[object, np.ndarray, np.ndarray]:
    """An Embree scene, the patch of every triangle, and the (row, column) in 0..1 of its corners."""
    import open3d as o3d

    from r2c2r_core.synthetic.mesh import join_patches

    mesh = join_patches(patches)
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(
        o3d.core.Tensor.from_numpy(mesh.vertices.astype(np.float32)), o3d.core.Tensor.from_numpy(mesh.faces.astype(np.uint32))
    )
    return scene, mesh.patch_of_vertex[mesh.faces[:, 0]], mesh.unit[mesh.faces]


def _direct_light(scene: object, lumels: _Lumels, emitter: Patch, radiance: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Direct light from one rectangular emitter, with soft shadows."""
    corner, right, down = emitter.grid[0, 0], emitter.grid[0, -1] - emitter.grid[0, 0], emitter.grid[-1, 0] - emitter.grid[0, 0]
    facing = np.cross(down, right)
    area = float(np.linalg.norm(facing))
    facing = facing / area
    light = np.zeros(len(lumels.positions))
    side = int(np.ceil(np.sqrt(_SHADOW_RAYS)))
    for sample in range(_SHADOW_RAYS):
        jitter = rng.random((len(lumels.positions), 2))
        u = ((sample % side) + jitter[:, :1]) / side
        v = ((sample // side) + jitter[:, 1:]) / np.ceil(_SHADOW_RAYS / side)
        towards = corner + u * right + v * down + 0.002 * facing - lumels.positions
        distance = np.linalg.norm(towards, axis=1)
        towards /= distance[:, None]
        gain = np.maximum(np.einsum("ij,ij->i", towards, lumels.normals), 0.0) * np.maximum(-(towards @ facing), 0.0)
        lit = np.flatnonzero(gain > 1e-5)
        reach = _first_hits(scene, lumels.positions[lit], towards[lit])["t_hit"]
        clear = reach > distance[lit] - 0.01
        chosen = lit[clear]
        light[chosen] += gain[chosen] / (distance[chosen] ** 2 + _NEAREST_M2)
    return light[:, None] * (area / np.pi / _SHADOW_RAYS) * radiance


def _bounce_hits(
    scene: object, lumels: _Lumels, patch_of_face: np.ndarray, corners: np.ndarray, rng: np.random.Generator
) -> np.ndarray:
    """(n, rays) index of the lumel hit by each cosine-distributed ray; n for a miss."""
    count = len(lumels.positions)
    helper = np.where(np.abs(lumels.normals[:, :1]) < 0.7, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    tangent = np.cross(lumels.normals, helper)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    other = np.cross(lumels.normals, tangent)
    hits = np.zeros((count, _BOUNCE_RAYS), np.int32)
    for ray in range(_BOUNCE_RAYS):
        radius = np.sqrt((ray + rng.random(count)) / _BOUNCE_RAYS)
        angle = 2 * np.pi * rng.random(count)
        direction = (
            (radius * np.cos(angle))[:, None] * tangent
            + (radius * np.sin(angle))[:, None] * other
            + np.sqrt(1 - radius**2)[:, None] * lumels.normals
        )
        answer = _first_hits(scene, lumels.positions, direction)
        met = np.isfinite(answer["t_hit"])
        face = np.where(met, answer["primitive_ids"], 0).astype(np.int64)
        uv = answer["primitive_uvs"]
        weights = np.column_stack([1 - uv.sum(axis=1), uv])
        place = np.einsum("ij,ijk->ik", weights, corners[face])
        patch = patch_of_face[face]
        shape = lumels.shape[patch]
        row = np.clip((place[:, 0] * shape[:, 0]).astype(int), 0, shape[:, 0] - 1)
        column = np.clip((place[:, 1] * shape[:, 1]).astype(int), 0, shape[:, 1] - 1)
        hits[:, ray] = np.where(met, lumels.first[patch] + row * shape[:, 1] + column, count)
    return hits


def _first_hits(scene: object, origins: np.ndarray, directions: np.ndarray) -> dict[str, np.ndarray]:
    parts = []
    for start in range(0, len(origins), _CHUNK):
        rays = np.hstack([origins[start : start + _CHUNK], directions[start : start + _CHUNK]]).astype(np.float32)
        parts.append(scene.cast_rays(rays))  # type: ignore[attr-defined]
    names = ("t_hit", "primitive_ids", "primitive_uvs")
    if not parts:
        return {"t_hit": np.zeros(0), "primitive_ids": np.zeros(0, np.int64), "primitive_uvs": np.zeros((0, 2))}
    return {name: np.concatenate([part[name].numpy() for part in parts]) for name in names}


def _range_of(lumels: _Lumels, patch: int) -> slice:
    rows, columns = lumels.shape[patch]
    start = int(lumels.first[patch])
    return slice(start, start + int(rows * columns))
