"""TSDF fusion of posed depth images into one surface (Open3D VoxelBlockGrid; its ScalableTSDFVolume is broken in 0.20.0)."""

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from r2c2r_core.arrays import Colours, DepthMetres, Faces, Image, Points
from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.transforms import Rigid3


class DepthView(NamedTuple):
    """One posed depth image; colour, when given, has the depth image's size."""

    depth_m: DepthMetres
    camera: Intrinsics
    world_from_camera: Rigid3
    colour: Image | None = None


class Surface(NamedTuple):
    """A triangle surface with one colour per vertex."""

    vertices: Points
    faces: Faces
    colours: Colours


def fuse_depth(
    views: Iterable[DepthView], voxel_m: float, *, depth_max_m: float = 6.0, min_weight: float = 2.0, block_count: int = 4000
) -> Surface:
    """Fuse depth images (0 = unknown) into a surface in the world frame; pixels are never filled before fusion."""
    import open3d as o3d

    core: Any = o3d.core  # its stubs know neither arrays nor tuples
    block_grid: Any = o3d.t.geometry.VoxelBlockGrid
    grid = block_grid(
        ("tsdf", "weight", "color"), (core.float32, core.float32, core.float32), ((1,), (1,), (3,)), voxel_m, 8, block_count
    )
    nothing = Surface(np.zeros((0, 3)), np.zeros((0, 3), np.int64), np.zeros((0, 3), np.uint8))
    fused = 0
    for view in views:
        if not ((view.depth_m > 0) & (view.depth_m < depth_max_m)).any():
            continue  # Open3D raises on an image that touches no block
        depth = o3d.t.geometry.Image(np.ascontiguousarray(view.depth_m, dtype=np.float32))
        # Open3D truncates to the pixel it reads, so its pixel centres lie at i + 0.5 like ours
        intrinsic = core.Tensor(np.ascontiguousarray(view.camera.matrix), core.float64)
        extrinsic = core.Tensor(np.ascontiguousarray(view.world_from_camera.inverse.matrix), core.float64)
        blocks = grid.compute_unique_block_coordinates(depth, intrinsic, extrinsic, 1.0, depth_max_m, 4.0)
        colour = view.colour if view.colour is not None else np.full((*view.depth_m.shape, 3), 160, np.uint8)
        image = o3d.t.geometry.Image(np.ascontiguousarray(colour, dtype=np.float32) / np.float32(255.0))
        grid.integrate(blocks, depth, image, intrinsic, intrinsic, extrinsic, 1.0, depth_max_m, 4.0)
        fused += 1
    if not fused:
        return nothing
    mesh = grid.extract_triangle_mesh(min_weight)
    if mesh.is_empty() or "indices" not in mesh.triangle:
        return nothing
    colours = (mesh.vertex.colors.numpy() * 255).clip(0, 255).astype(np.uint8)
    vertices = mesh.vertex.positions.numpy().astype(np.float64)
    return _in_canonical_order(Surface(vertices, mesh.triangle.indices.numpy().astype(np.int64), colours))


def _in_canonical_order(surface: Surface) -> Surface:
    """The same surface with vertices and faces in canonical order; Open3D's hash map returns another order each time."""
    order = np.lexsort(surface.vertices.T)
    place = np.zeros(len(order), dtype=np.int64)
    place[order] = np.arange(len(order))
    faces = place[surface.faces]
    first = np.argmin(faces, axis=1)
    faces = np.take_along_axis(faces, (first[:, None] + np.arange(3)) % 3, axis=1)  # keeps each face's orientation
    return Surface(surface.vertices[order], faces[np.lexsort(faces.T[::-1])], surface.colours[order])
