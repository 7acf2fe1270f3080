"""Candidate mesh prepared for alignment: sampled surface, colours, box axes, and a simplified copy for rendering."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull, QhullError, cKDTree
from scipy.spatial.transform import Rotation

from r2c2r_core.align.standing import hull_directions, standing_directions
from r2c2r_core.arrays import Faces, Matrix3, Points, Vector3
from r2c2r_core.errors import PlacementFailed
from r2c2r_core.geometry.transforms import Similarity3, nearest_rotation, rotation_between
from r2c2r_core.model.mesh import TexturedMesh

_HULL_SIDES = 40  # number of hull sides on which a box may stand


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Shape:
    """A mesh prepared for alignment, in its own frame and unit."""

    points: Points  # area-uniform samples of the outer surface
    normals: Points  # unit, smoothed over flat parts
    colours: np.ndarray  # (n, 3) float32 RGB 0..255
    tree: cKDTree  # over points
    vertices: Points  # simplified copy, at most `face_limit` faces
    faces: Faces
    diameter: float
    frames: tuple[Matrix3, ...]  # columns: candidate box axes of the mesh, right-handed, best first
    ups: tuple[Vector3, ...]  # directions that may point up (standing.py)
    bases: tuple[Vector3, ...]  # those along which the object stands stably
    oriented: bool  # faces wind outwards


def prepare_shape(mesh: TexturedMesh, *, point_count: int, face_limit: int, rng: np.random.Generator) -> Shape:
    """A mesh of unknown pose and unit, sampled, coloured and measured; raises PlacementFailed when it has no surface."""
    triangles = mesh.vertices[mesh.faces]
    doubled = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    area = np.linalg.norm(doubled, axis=1) / 2
    if not len(area) or not np.isfinite(area).all() or area.sum() <= 0:
        raise PlacementFailed("the mesh has no surface", hint="choose another candidate")
    points, normals, colours = _sample(mesh, triangles, doubled, area, point_count, rng)
    tree = cKDTree(points)
    normals = _smooth_normals(tree, points, normals)
    vertices, faces = _lighten(mesh, face_limit)
    manhattan, boxiness = manhattan_axes(normals, rng)
    sides = hull_directions(points, _HULL_SIDES)
    boxes = [manhattan, *least_volume_axes(points, sides)]
    frames = _distinct_frames(boxes)
    volume = float((triangles[:, 0] * np.cross(triangles[:, 1], triangles[:, 2])).sum() / 6)
    diameter = float(np.linalg.norm(np.ptp(points @ frames[0], axis=0)))  # of its own box: the mesh's frame is arbitrary
    ups, bases = standing_directions(points, frames, boxiness, sides)
    return Shape(
        points=points,
        normals=normals,
        colours=colours,
        tree=tree,
        vertices=vertices,
        faces=faces,
        diameter=diameter,
        frames=frames,
        ups=ups,
        bases=bases,
        oriented=volume > 0.02 * float(np.prod(np.ptp(points @ frames[0], axis=0))),
    )


def surface_distance(pose: Similarity3, shape: Shape, points_world: Points) -> np.ndarray:
    """Distance of points to the placed surface, metres, corrected for the spacing of the samples that represent it."""
    local = pose.inverse.apply(points_world)
    distance, nearest = shape.tree.query(local)
    away = np.abs(np.einsum("nj,nj->n", shape.normals[nearest], local - shape.points[nearest]))
    spacing = _spacing(shape)
    along = np.sqrt(np.maximum(distance**2 - away**2, 0.0))
    return np.asarray(np.hypot(away, np.maximum(along - 1.5 * spacing, 0.0)) * pose.scale)


def spins_alike(shape: Shape, axis_mesh: Vector3) -> bool:
    """Whether the shape is invariant under rotation about the axis (of any length)."""
    axis_mesh = axis_mesh / np.linalg.norm(axis_mesh)
    middle = shape.points.mean(axis=0)  # of an even sample: on the axis of revolution, if there is one
    sample = shape.points[:: max(len(shape.points) // 400, 1)] - middle
    radius = float(np.median(np.linalg.norm(np.cross(sample, axis_mesh), axis=1)))
    worst = 0.0
    for angle in (0.4, 0.9, 1.7):
        spin: Matrix3 = Rotation.from_rotvec(angle * axis_mesh).as_matrix()
        distance, _ = shape.tree.query(sample @ spin.T + middle)
        worst = max(worst, float(np.quantile(distance, 0.9)))
    return worst < 0.2 * radius  # a square's corners move by 0.3


def manhattan_axes(normals: Points, rng: np.random.Generator) -> tuple[Matrix3, float]:
    """Dominant surface axes (columns) and the fraction of the surface along them; several starts, polar iteration.

    Maximises the sum of |R n|_4^4, which is invariant under signed permutations; 2-3 times more accurate than the least-volume
    box on noisy meshes.
    """
    n = normals[:: max(1, len(normals) // 1500)]
    best_value, best = -1.0, np.eye(3)
    for _ in range(12):
        axes = nearest_rotation(rng.normal(size=(3, 3)))
        for _ in range(25):
            axes = nearest_rotation(((n @ axes.T) ** 3).T @ n)
        value = float(((n @ axes.T) ** 4).sum() / len(n))
        if value > best_value + 1e-9:
            best_value, best = value, axes
    best = _polish_axes(normals, best)
    aligned = np.abs(normals @ best.T).max(axis=1) > np.cos(np.radians(12))
    return best.T, float(aligned.mean())


def least_volume_axes(points: Points, sides: Sequence[Vector3]) -> list[Matrix3]:
    """Axes (columns) of the smallest box on one of the `sides` of the convex hull; empty for a flat point set."""
    best_volume, best = np.inf, None
    for up in sides:
        to_plan = rotation_between(up, np.array([0.0, 0.0, 1.0]))
        plan = points @ to_plan.T
        try:
            outline = plan[ConvexHull(plan[:, :2]).vertices]
        except QhullError:
            continue
        edges = np.diff(np.vstack([outline, outline[:1]]), axis=0)[:, :2]
        angles = np.unique(np.round(np.arctan2(edges[:, 1], edges[:, 0]) % (np.pi / 2), 3))
        c, s = np.cos(angles), np.sin(angles)
        u = np.outer(c, outline[:, 0]) + np.outer(s, outline[:, 1])
        v = np.outer(c, outline[:, 1]) - np.outer(s, outline[:, 0])
        areas = np.ptp(u, axis=1) * np.ptp(v, axis=1)
        k = int(np.argmin(areas))
        volume = areas[k] * np.ptp(plan[:, 2])
        if volume < best_volume:
            turn = np.array([[c[k], s[k], 0.0], [-s[k], c[k], 0.0], [0.0, 0.0, 1.0]])
            best_volume, best = volume, (turn @ to_plan).T
    return [] if best is None else [best]


def _polish_axes(normals: Points, axes: Matrix3) -> Matrix3:
    """Axes averaged from the normals near each, within an angle narrowing from 20 to 8 degrees."""
    for angle in (20.0, 12.0, 8.0):
        along = normals @ axes.T
        gathered = np.zeros((3, 3))
        for k in range(3):
            near = np.abs(along[:, k]) > np.cos(np.radians(angle))
            gathered[k] = (normals[near] * np.sign(along[near, k : k + 1])).sum(axis=0) if near.any() else 0.05 * axes[k]
        axes = nearest_rotation(gathered)
    return axes


def _distinct_frames(frames: list[Matrix3]) -> tuple[Matrix3, ...]:
    """The frames that differ by more than 4 degrees modulo signed permutations."""
    kept: list[Matrix3] = []
    for frame in frames:
        frame = frame * np.array([1.0, 1.0, np.sign(np.linalg.det(frame))])
        if all(np.abs(k.T @ frame).max(axis=1).min() < np.cos(np.radians(4)) for k in kept):
            kept.append(frame)
    return tuple(kept)


def _sample(
    mesh: TexturedMesh, triangles: np.ndarray, doubled: np.ndarray, area: np.ndarray, count: int, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Area-uniform points with face normals and texture colours."""
    steps = (np.arange(count) + rng.random(count)) / count * area.sum()
    face = np.minimum(np.searchsorted(np.cumsum(area), steps), len(area) - 1)
    r1, r2 = np.sqrt(rng.random(count)), rng.random(count)
    weight = np.stack([1 - r1, r1 * (1 - r2), r1 * r2], axis=1)
    points = np.einsum("nk,nkj->nj", weight, triangles[face])
    normals = doubled[face] / np.maximum(2 * area[face, None], 1e-30)
    uv = np.einsum("nk,nkj->nj", weight, mesh.uv[mesh.faces[face]])
    height, width = mesh.texture.shape[:2]
    column = np.clip((uv[:, 0] * width).astype(np.int64), 0, width - 1)
    row = np.clip(((1.0 - uv[:, 1]) * height).astype(np.int64), 0, height - 1)
    return points, normals, mesh.texture[row, column].astype(np.float32)


def _smooth_normals(tree: cKDTree, points: Points, normals: Points) -> Points:
    """Normals averaged with similar neighbours: marching cubes leaves stairs."""
    _, near = tree.query(points, k=min(12, len(points)))
    around = normals[near]
    alike = (np.einsum("nkj,nj->nk", around, normals) > np.cos(np.radians(40))).astype(np.float64)
    mean = np.einsum("nk,nkj->nj", alike, around)
    return np.asarray(mean / np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), 1e-12))


def _lighten(mesh: TexturedMesh, face_limit: int) -> tuple[Points, Faces]:
    """The mesh without texture seams, simplified so that it can be rendered hundreds of times."""
    merged, where = np.unique(np.round(mesh.vertices, 7), axis=0, return_inverse=True)
    faces = where.ravel()[mesh.faces]
    proper = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 0] != faces[:, 2])
    faces = faces[proper]
    if len(faces) <= face_limit:
        return merged, faces
    import fast_simplification

    light, light_faces = fast_simplification.simplify(
        merged.astype(np.float32), faces.astype(np.int32), target_count=face_limit, agg=5.0
    )
    if not len(light_faces):
        return merged, faces
    return np.asarray(light, dtype=np.float64), np.asarray(light_faces, dtype=np.int64)


def _spacing(shape: Shape) -> float:
    """Typical distance between neighbouring samples, in the mesh's unit."""
    distance, _ = shape.tree.query(shape.points[:: max(len(shape.points) // 300, 1)], k=2)
    return float(np.median(distance[:, 1]) * 2.0)
