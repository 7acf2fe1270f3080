"""Closed triangle meshes: boxes, checks, simplification, measurements.

A mesh is (vertices, faces). Skins of a textured mesh repeat vertices at seams, so the checks first join vertices at exactly the
same position.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float, Integer

from r2c2r_core.arrays import Faces, Points, Vector3
from r2c2r_core.geometry.graphs import components

# A result has sizes of its own, and each part of a sequence too: `n` and `m` would tie them to the arguments.
AnyPoints = Float[np.ndarray, "_ 3"]
AnyFaces = Integer[np.ndarray, "_ 3"]
Surface = tuple[AnyPoints, AnyFaces]

_BOX_CORNERS = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
_SIMPLIFY_ROUNDS = 5
_SPREAD = np.random.default_rng(0).normal(size=(500, 3))  # directions, evenly spread
_BOX_QUADS = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
_BOX_FACES = np.concatenate([_BOX_QUADS[:, [0, 1, 2]], _BOX_QUADS[:, [0, 2, 3]]])


def box_mesh(low: Vector3, high: Vector3) -> Surface:
    """Closed, outward surface of an axis-aligned box."""
    return low + _BOX_CORNERS * (high - low), _BOX_FACES.copy()


def join_vertices(vertices: Points, faces: Faces) -> Surface:
    """The same surface with coincident vertices joined, and degenerate faces dropped."""
    unique, inverse = np.unique(vertices, axis=0, return_inverse=True)
    joined = inverse.reshape(-1)[faces]
    keep = (joined[:, 0] != joined[:, 1]) & (joined[:, 1] != joined[:, 2]) & (joined[:, 2] != joined[:, 0])
    return unique, joined[keep]


def is_watertight(vertices: Points, faces: Faces) -> bool:
    """Whether every directed edge is matched by exactly one opposite edge: closed and consistently wound."""
    if len(faces) == 0:
        return False
    _, joined = join_vertices(vertices, faces)
    edges = np.concatenate([joined[:, [0, 1]], joined[:, [1, 2]], joined[:, [2, 0]]]).astype(np.int64)
    span = int(edges.max()) + 1
    forward, backward = edges[:, 0] * span + edges[:, 1], edges[:, 1] * span + edges[:, 0]
    return bool(len(np.unique(forward)) == len(forward) and np.array_equal(np.sort(forward), np.sort(backward)))


def is_manifold(vertices: Points, faces: Faces) -> bool:
    """Whether manifold3d accepts the joined surface as the boundary of a solid."""
    return joined_solid(vertices, faces) is not None


def joined_solid(vertices: Points, faces: Faces) -> Any | None:
    """manifold3d's solid of a surface whose vertices are joined by position; None when it bounds none."""
    import manifold3d

    solid = _solid(*join_vertices(vertices, faces)) if len(faces) else None
    return solid if solid is not None and solid.status() == manifold3d.Error.NoError else None


def volume(vertices: Points, faces: Faces) -> float:
    """Enclosed volume of a closed mesh, in cubed units; negative when it is wound inwards."""
    centred = vertices - vertices.mean(axis=0)
    a, b, c = (centred[faces[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0)


def unite(parts: Sequence[Surface], removed: Sequence[Surface] = ()) -> Surface:
    """Boundary of the union of closed meshes, minus the closed meshes `removed`."""
    import manifold3d

    solid = manifold3d.Manifold.batch_boolean([_solid(*part) for part in parts], manifold3d.OpType.Add)
    if removed:
        holes = manifold3d.Manifold.batch_boolean([_solid(*part) for part in removed], manifold3d.OpType.Add)
        solid = solid - holes
    return _mesh_of(solid)


def simplify(vertices: Points, faces: Faces, tolerance: float, max_faces: int) -> Surface:
    """A closed mesh with fewer faces, still closed and manifold: `max_faces` or, on a rough surface, the fewest possible.

    Raises ValueError when the mesh is not the boundary of a solid.
    """
    import manifold3d

    solid = _solid(vertices, faces)
    if solid.status() != manifold3d.Error.NoError:
        raise ValueError(f"not a closed manifold: {solid.status().name}")
    for _ in range(_SIMPLIFY_ROUNDS):  # a larger tolerance does not always leave fewer faces
        solid = solid.simplify(tolerance)
        if solid.num_tri() <= max_faces:
            return _mesh_of(solid)
        tolerance *= 1.5
    return _collapsed(*_mesh_of(solid), max_faces)


def _collapsed(vertices: Points, faces: Faces, max_faces: int) -> Surface:
    """Quadric edge collapse; reduced, or skipped, where it would pinch off a thin part."""
    import fast_simplification

    for count in (max_faces, 2 * max_faces):
        if count >= len(faces):
            break
        points, triangles = fast_simplification.simplify(
            vertices.astype(np.float32), faces.astype(np.int32), target_count=count
        )
        result = join_vertices(np.asarray(points, dtype=np.float64), np.asarray(triangles, dtype=np.int64))
        if is_watertight(*result) and is_manifold(*result):
            return result
    return vertices, faces


def largest_component(vertices: Points, faces: Faces) -> Surface:
    """The connected component with the largest surface; connection is by shared vertices."""
    labels = components(len(vertices), np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]]]))
    if labels.max() == 0:
        return vertices, faces
    face_label = labels[faces[:, 0]]
    areas = np.bincount(face_label, weights=face_areas(vertices, faces))
    return compact(vertices, faces[face_label == int(np.argmax(areas))])


def compact(vertices: Points, faces: Faces) -> Surface:
    """The same faces without unused vertices."""
    used, inverse = np.unique(faces, return_inverse=True)
    return vertices[used], inverse.reshape(faces.shape)


def face_areas(vertices: Points, faces: Faces) -> np.ndarray:
    """Area of each face."""
    return np.asarray(np.linalg.norm(_face_crosses(vertices, faces), axis=1) / 2.0)


def face_normals(vertices: Points, faces: Faces) -> AnyPoints:
    """Unit outward normal of each face; zero for a degenerate one."""
    crosses = _face_crosses(vertices, faces)
    return np.asarray(crosses / np.maximum(np.linalg.norm(crosses, axis=1, keepdims=True), 1e-30))


def vertex_normals(vertices: Points, faces: Faces) -> Points:
    """Unit area-weighted normal of each vertex."""
    crosses = _face_crosses(vertices, faces)
    total = np.zeros_like(vertices)
    for corner in range(3):
        np.add.at(total, faces[:, corner], crosses)
    return np.asarray(total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-30))


def sample_surface(vertices: Points, faces: Faces, count: int, rng: np.random.Generator) -> tuple[AnyPoints, np.ndarray]:
    """`count` points distributed uniformly over the area, and the face each lies on."""
    areas = face_areas(vertices, faces)
    chosen = rng.choice(len(faces), count, p=areas / areas.sum())
    a, b = rng.random((2, count))
    flip = a + b > 1
    a[flip], b[flip] = 1 - a[flip], 1 - b[flip]
    corner = vertices[faces[chosen]]
    points = corner[:, 0] + a[:, None] * (corner[:, 1] - corner[:, 0]) + b[:, None] * (corner[:, 2] - corner[:, 0])
    return points, chosen


def distances_to_mesh(points: AnyPoints, vertices: Points, faces: Faces) -> np.ndarray:
    """Unsigned distance (n,) of each point to the nearest face."""
    import open3d as o3d

    found = _raycasting(vertices, faces).compute_distance(
        o3d.core.Tensor.from_numpy(np.ascontiguousarray(points, dtype=np.float32))
    )
    return np.asarray(found.numpy(), dtype=np.float64)


def closest_on_mesh(points: AnyPoints, vertices: Points, faces: Faces) -> tuple[AnyPoints, np.ndarray]:
    """The nearest point of the surface to each point, and the face it lies on."""
    import open3d as o3d

    found = _raycasting(vertices, faces).compute_closest_points(
        o3d.core.Tensor.from_numpy(np.ascontiguousarray(points, dtype=np.float32))
    )
    return np.asarray(found["points"].numpy(), dtype=np.float64), np.asarray(found["primitive_ids"].numpy(), dtype=np.int64)


def oriented_extents(vertices: Points) -> Vector3:
    """Side lengths of the smallest box around the vertices, longest first; independent of the mesh's rotation.

    Only the extreme vertices in 500 directions are searched: exact for boxes, within 1 % for round objects; the search over a
    fine sphere's thousands of hull faces would take half a minute.
    """
    from trimesh.bounds import oriented_bounds

    directions = np.linalg.norm(_SPREAD, axis=1, keepdims=True)
    centred = vertices - vertices.mean(axis=0)
    outermost = np.unique(np.argmax(centred @ (_SPREAD / directions).T, axis=0))
    _, extents = oriented_bounds(centred[outermost])
    return np.sort(np.asarray(extents, dtype=np.float64))[::-1]


def _raycasting(vertices: Points, faces: Faces) -> Any:
    import open3d as o3d

    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(
        o3d.core.Tensor.from_numpy(np.ascontiguousarray(vertices, dtype=np.float32)),
        o3d.core.Tensor.from_numpy(np.ascontiguousarray(faces, dtype=np.uint32)),
    )
    return scene


def _face_crosses(vertices: Points, faces: Faces) -> AnyPoints:
    corner = vertices[faces]
    return np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])


def _solid(vertices: Points, faces: Faces) -> Any:
    import manifold3d

    mesh = manifold3d.Mesh64(
        vert_properties=np.ascontiguousarray(vertices, dtype=np.float64), tri_verts=np.ascontiguousarray(faces, dtype=np.uint64)
    )
    return manifold3d.Manifold(mesh)


def _mesh_of(solid: Any) -> Surface:
    mesh = solid.to_mesh64()
    vertices = np.array(mesh.vert_properties, dtype=np.float64)[:, :3]  # a copy: the kernel's own memory is read-only
    return _parted(vertices, np.array(mesh.tri_verts, dtype=np.int64))


def _parted(vertices: Points, faces: Faces) -> tuple[Points, Faces]:
    """The mesh with merely touching vertices separated by a hundred-thousandth of its size, each into its own body.

    The kernel keeps them as two vertices at one position; a reader that joins by position would find an edge with four faces.
    """
    _, inverse, counts = np.unique(vertices, axis=0, return_inverse=True, return_counts=True)
    touching = counts[inverse.reshape(-1)] > 1
    if not touching.any():
        return vertices, faces
    step = 1e-5 * float(np.ptp(vertices, axis=0).max())
    return vertices - step * touching[:, None] * vertex_normals(vertices, faces), faces
