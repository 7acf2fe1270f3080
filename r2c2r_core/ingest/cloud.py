"""TSDF fusion of an evenly spread subset of frames into one surface, without small floating components."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import cv2
import numpy as np

from r2c2r_core.arrays import Faces, Points
from r2c2r_core.geometry.camera import depth_points
from r2c2r_core.geometry.fusion import DepthView, Surface, fuse_depth
from r2c2r_core.geometry.graphs import components
from r2c2r_core.model.capture import Frame, FrameImages
from r2c2r_core.progress import SILENT, Progress
from r2c2r_core.tuning import param, tuned

_BLOCK_VOXELS = 8  # Open3D's VoxelBlockGrid allocates cubes of 8 x 8 x 8 voxels


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of surface fusion."""

    outlier_deviations: float = param(
        2.0,
        "σ",
        "Number of standard deviations of the mean neighbour distance beyond which a point is an outlier",
        source="the paper's",
    )
    most_blocks: int = param(
        48_000, "count", "Maximum number of blocks of 8 x 8 x 8 voxels", source="10 kB each with colour: 0.5 GB", ge=100
    )


def fuse_frames(
    frames: Sequence[Frame],
    images: FrameImages,
    *,
    most_frames: int,
    finest_voxel_m: float,
    coarsest_voxel_m: float,
    depth_max_m: float,
    smallest_part_m2: float,
    outlier_neighbours: int = 0,
    progress: Progress = SILENT,
) -> tuple[Surface, float]:
    """The fused surface in the frames' world, and the voxel size used, in metres."""
    chosen = spread_frames(frames, most_frames)
    grid = choose_grid(chosen, images, finest_voxel_m, coarsest_voxel_m, depth_max_m)
    views = _views(chosen, images, progress)
    surface = fuse_depth(
        views,
        grid.voxel_m,
        depth_max_m=depth_max_m,
        min_weight=min(2.0, len(chosen) / 2),
        block_count=grid.blocks + 512,
    )
    if outlier_neighbours > 0:
        surface = drop_outliers(surface, outlier_neighbours)
    return drop_crumbs(surface, smallest_part_m2), grid.voxel_m


def spread_frames(frames: Sequence[Frame], most: int) -> tuple[Frame, ...]:
    """At most `most` frames, evenly spread: the sharpest frame of each interval."""
    if len(frames) <= most:
        return tuple(frames)
    edges = np.linspace(0, len(frames), most + 1).astype(int)
    return tuple(max(frames[a:b], key=lambda f: f.sharpness) for a, b in pairwise(edges))


class Grid(NamedTuple):
    """A voxel grid for fusion."""

    voxel_m: float
    blocks: int  # of 8 x 8 x 8 voxels; an estimate, the grid grows when it is too low


def choose_grid(frames: Sequence[Frame], images: FrameImages, finest_m: float, coarsest_m: float, depth_max_m: float) -> Grid:
    """The finest grid that the depth resolution justifies and the memory allows."""
    sample = frames[:: max(1, len(frames) // 24)]
    footprints, cells = [], []
    for frame in sample:
        depth = images.depth(frame.index).metres
        known = (depth > 0) & (depth < depth_max_m)
        if not known.any():
            continue
        footprints.append(float(np.median(depth[known])) / frame.depth_camera.fx)
        points = frame.world_from_camera.apply(depth_points(depth, frame.depth_camera)[known][::3])
        cells.append(np.unique(_cell_keys(np.floor(points / (_BLOCK_VOXELS * finest_m)).astype(np.int32))))
    if not cells:
        return Grid(finest_m, 1)
    # A surface one voxel thick also claims the blocks its truncation band reaches: about 2.2 times as many
    blocks = 2.2 * len(np.unique(np.concatenate(cells)))
    for_memory = finest_m * np.sqrt(max(1.0, blocks / tuned(Params).most_blocks))
    voxel_m = float(np.clip(max(np.median(footprints), for_memory), finest_m, coarsest_m))
    return Grid(voxel_m, int(blocks * (finest_m / voxel_m) ** 2) + 1)


def _cell_keys(cells: np.ndarray) -> np.ndarray:
    """One integer key per row of integer cells (n, 3), unique within two million cells per axis: rows are slow to sort."""
    x, y, z = cells.astype(np.int64).T & (2**21 - 1)
    return np.asarray((x << 42) | (y << 21) | z)


def drop_crumbs(surface: Surface, smallest_part_m2: float) -> Surface:
    """The surface without connected parts smaller than `smallest_part_m2`."""
    faces = surface.faces
    if not len(faces):
        return surface
    part_of_vertex = components(len(surface.vertices), np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]]]))
    area_of_part = np.bincount(part_of_vertex[faces[:, 0]], weights=face_areas(surface.vertices, faces))
    return _with_faces(surface, area_of_part[part_of_vertex[faces[:, 0]]] >= smallest_part_m2)


def drop_outliers(surface: Surface, neighbours: int) -> Surface:
    """The surface without vertices that lie far from their nearest `neighbours` (paper §3: Open3D's statistical removal).

    The threshold is two standard deviations of that distance over the whole scan. Scan borders and thin objects also exceed
    it: on a sample, 97 % of the removed points are true surface (method.md row 11), so it is off by default.
    """
    import open3d as o3d

    if len(surface.vertices) <= neighbours:
        return surface
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(surface.vertices))
    kept = np.zeros(len(surface.vertices), bool)
    kept[np.asarray(cloud.remove_statistical_outlier(neighbours, tuned(Params).outlier_deviations)[1])] = True
    return _with_faces(surface, kept[surface.faces].all(axis=1))


def _with_faces(surface: Surface, kept_faces: np.ndarray) -> Surface:
    """The surface reduced to the kept faces and the vertices they use."""
    used = np.zeros(len(surface.vertices), bool)
    used[surface.faces[kept_faces].ravel()] = True
    renumbered = np.cumsum(used) - 1
    return Surface(surface.vertices[used], renumbered[surface.faces[kept_faces]], surface.colours[used])


def face_areas(vertices: Points, faces: Faces) -> np.ndarray:
    """Area (m,) of each triangle, m^2."""
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    return np.asarray(np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2)


def _views(frames: Sequence[Frame], images: FrameImages, progress: Progress) -> Iterator[DepthView]:
    for position, frame in enumerate(frames):
        progress.at(position / len(frames), f"fusing frame {position + 1}/{len(frames)}")
        depth = images.depth(frame.index).metres
        size = (frame.depth_camera.width, frame.depth_camera.height)
        colour = cv2.resize(images.rgb(frame.index), size, interpolation=cv2.INTER_AREA)
        yield DepthView(depth, frame.depth_camera, frame.world_from_camera, colour)
