"""Convex colliders of free-standing rigid objects from the placed mesh."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from r2c2r_core.arrays import Faces, Points, Vector3
from r2c2r_core.geometry.meshes import face_areas, face_normals, joined_solid
from r2c2r_core.model.scene import ConvexPiece
from r2c2r_core.synthesize.runs import weighted_median
from r2c2r_core.synthesize.vessels import between, corners_of, staves
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of convex decomposition."""

    openness: float = param(
        1.35,
        "ratio",
        "Ratio of hull to solid volume above which an object has a cavity, legs or, at some height, a neck",
        ge=1,
    )
    flat_m: float = param(
        0.006, "m", "Maximum distance of points of the underside or a flat top from it", source="reconstructed feet are uneven"
    )
    simplified_m: float = param(0.005, "m", "Maximum distance by which a solid is simplified before its decomposition", ge=0)
    level_cos: float = param(0.9, "cosine", "Minimum cosine of the angle between a slab's top and up")
    most_pieces: int = param(16, "count", "Maximum number of convex pieces of an object", ge=1)


def convex_pieces(
    vertices: Points, faces: Faces, dimensions_m: Vector3, *, flat_top: bool = False, seed: int = 0
) -> tuple[ConvexPiece, ...]:
    """The hull, parted where it would fill a neck; staves or a convex decomposition where it would fill a cavity.

    All have one flat underside and, where others stand on it, one flat top. The mesh is in the object's frame.
    """
    shape, top_m = joined_solid(vertices, faces), _level_top(vertices, faces) if flat_top else np.inf
    if shape is None or shape.volume() <= 0:
        parts = [vertices]
    elif shape.hull().volume() > tuned(Params).openness * shape.volume():
        parts = staves(vertices, faces) or _decomposed(shape, seed)
    else:
        parts = corners_of(_parted(shape))
    pieces = []
    for number, points in enumerate(parts):
        simple = _simplified(_with_level_ends(points, -dimensions_m[2] / 2, top_m))
        if simple is not None:
            pieces.append(ConvexPiece(name=f"piece_{number}", vertices_link=simple))
    return tuple(pieces)


def _parted(shape: Any) -> list[Any]:
    """Hulls between as few heights as keep the parts of a hull below `openness` times the shape's own hull there."""
    import manifold3d

    params = tuned(Params)
    _, _, foot, _, _, head = shape.bounding_box()
    slabs = list(pairwise(np.linspace(foot, head, params.most_pieces + 1)))
    own = [between(shape, *slab).hull() for slab in slabs]
    hulls, start = [], 0
    while start < len(own):
        for end in range(len(own), start, -1):
            hull = manifold3d.Manifold.batch_hull(own[start:end])
            if all(between(hull, *slabs[k]).volume() <= params.openness * own[k].volume() for k in range(start, end)):
                break
        hulls.append(hull)
        start = end
    return hulls


def _decomposed(shape: Any, seed: int) -> list[Points]:
    """CoACD parts of a simplified solid. It is closed already: CoACD's own remeshing thickens a 2 m table by 3 cm."""
    import coacd

    mesh = shape.simplify(tuned(Params).simplified_m).to_mesh64()
    vertices, faces = np.array(mesh.vert_properties)[:, :3], np.array(mesh.tri_verts)
    coacd.set_log_level("error")
    parts = coacd.run_coacd(
        coacd.Mesh(vertices.astype(np.float64), faces.astype(np.int32)),
        threshold=0.05,
        max_convex_hull=12,
        preprocess_mode="off",
        mcts_iterations=20,  # with the defaults a chair takes 26 s of CPU instead of 3, for the same volume
        mcts_nodes=8,
        mcts_max_depth=2,
        seed=seed,
    )
    return [np.asarray(points, dtype=np.float64) for points, _ in parts][: tuned(Params).most_pieces]


def _level_top(vertices: Points, faces: Faces) -> float:
    """Height of a slab that is the highest part: the median over the area of its upward faces, whose bumps lie above it."""
    heights, areas = vertices[faces][:, :, 2].mean(axis=1), face_areas(vertices, faces)
    top = (face_normals(vertices, faces)[:, 2] > tuned(Params).level_cos) & (heights > vertices[:, 2].mean())
    return weighted_median(heights[top], areas[top]) if top.any() else np.inf


def _with_level_ends(points: Points, underside_m: float, top_m: float) -> Points:
    """The points, with those near or beyond the underside and the top projected onto them."""
    flat, near = points.copy(), tuned(Params).flat_m
    flat[:, 2] = np.where(points[:, 2] < underside_m + near, underside_m, points[:, 2])
    flat[:, 2] = np.where(points[:, 2] > top_m - near, top_m, flat[:, 2])
    return flat


def _simplified(points: Points) -> Points | None:
    """Extreme points of the hull over a set of directions; None for a sliver without volume (simulators refuse flat hulls).

    Points are chosen, never moved: the piece stays inside its shape and touches it along its axes.
    """
    from scipy.spatial import ConvexHull, QhullError

    try:
        corners = points[ConvexHull(points).vertices]
        kept = np.unique(np.argmax(corners @ _directions().T, axis=0))
        hull = ConvexHull(corners[kept])
    except QhullError:
        return None
    if hull.volume < 1e-8 or np.ptp(corners[kept], axis=0).min() < 1e-3:
        return None
    return np.asarray(corners[kept][hull.vertices])


def _directions() -> Points:
    """Unit directions: rings of 20 at several heights, for upright rims, and the axes."""
    azimuth, height = (v.ravel() for v in np.meshgrid(np.arange(20) * np.pi / 10, np.deg2rad([-60, -25, -5, 5, 25, 60])))
    ring = np.column_stack([np.cos(azimuth) * np.cos(height), np.sin(azimuth) * np.cos(height), np.sin(height)])
    return np.concatenate([ring, np.eye(3), -np.eye(3)])
