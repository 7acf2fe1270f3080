"""A candidate's mesh for display: upright and facing the camera if its placement is known."""

from itertools import permutations, product
from typing import Any

import numpy as np
from scipy.spatial import cKDTree  # not imported lazily: two concurrent first requests would see it half imported

from app.drawing import textured, unit
from app.files import ProjectFiles
from app.services import views
from r2c2r_core.arrays import Matrix3
from r2c2r_core.model.mesh import MeshAsset, TexturedMesh

SAMPLES = 1500

_BOX_TURNS = [  # the 24 rotations that map a box onto a box
    np.eye(3)[list(order)] * np.array(signs)[:, None]
    for order in permutations(range(3))
    for signs in product((1.0, -1.0), repeat=3)
    if np.linalg.det(np.eye(3)[list(order)] * np.array(signs)[:, None]) > 0
]


def upright(files: ProjectFiles, name: str, candidate: str) -> Matrix3:
    """Rotation from the mesh's arbitrary frame to one with +Z up and the front at -Y; identity if unknown.

    Only the chosen candidate is aligned with the scan; the others are rotated to look most like it.
    """
    placement = views.latest(files, "align", name)
    if placement is None:
        return np.eye(3)
    object_from_placed = np.asarray(_object_axes(files, name).T @ placement.world_from_mesh.rotation)
    if placement.candidate_id == candidate:
        return object_from_placed
    meshes = {asset.candidate_id: asset.mesh for asset in _candidates(files, name)}
    if candidate not in meshes or placement.candidate_id not in meshes:
        return np.eye(3)
    return np.asarray(object_from_placed @ turned_like(meshes[candidate], meshes[placement.candidate_id]))


def turned_like(mesh: TexturedMesh, model: TexturedMesh) -> Matrix3:
    """The rotation that makes `mesh` most similar to `model`, among those that align their boxes."""
    points, colours, axes = _sampled(mesh)
    model_points, model_colours, model_axes = _sampled(model)
    tree = cKDTree(model_points)
    best, best_cost = np.eye(3), np.inf
    for turn in _BOX_TURNS:
        rotation = model_axes @ turn @ axes.T
        distance, nearest = tree.query(points @ rotation.T)
        cost = float(np.mean(distance)) + 0.3 * float(np.mean(np.abs(colours - model_colours[nearest])))
        if cost < best_cost:
            best, best_cost = rotation, cost
    return np.asarray(best)


def mesh_glb(mesh: TexturedMesh, rotation: Matrix3) -> bytes:
    """The mesh as GLB, centred, in glTF's axes (+Y up, front at +Z)."""
    import trimesh
    from PIL import Image

    vertices = unit(mesh.vertices @ rotation.T)
    gltf_from_object = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
    material = trimesh.visual.material.PBRMaterial(
        baseColorTexture=Image.fromarray(mesh.texture), metallicFactor=0.0, roughnessFactor=0.9
    )
    visual = trimesh.visual.TextureVisuals(uv=mesh.uv, material=material)
    shown = trimesh.Trimesh(vertices @ gltf_from_object.T, mesh.faces, visual=visual, process=False)
    _ = shown.vertex_normals  # without them viewers shade every face flat
    exported: Any = shown.export(file_type="glb")
    return bytes(exported)


def _sampled(mesh: TexturedMesh) -> tuple[np.ndarray, np.ndarray, Matrix3]:
    """Points on the surface (n, 3) in the unit ball, their colours 0..1, and the axes of the smallest box, longest last."""
    import trimesh

    centred = unit(mesh.vertices)
    shape = trimesh.Trimesh(centred, mesh.faces, process=False)
    points, faces = trimesh.sample.sample_surface(shape, SAMPLES, seed=0)
    corners = trimesh.triangles.points_to_barycentric(shape.triangles[faces], points)
    uv = np.einsum("nk,nkd->nd", corners, mesh.uv[mesh.faces[faces]])
    to_box, sizes = trimesh.bounds.oriented_bounds(shape, ordered=False)
    order = np.argsort(sizes)
    axes = to_box[:3, :3].T[:, order]
    axes[:, 0] *= np.sign(np.linalg.det(axes))
    return np.asarray(points), textured(mesh.texture, uv) / 255.0, axes


def _object_axes(files: ProjectFiles, name: str) -> Matrix3:
    """world_from_object rotation from the masks; identity without one."""
    track = views.latest(files, "segment", name)
    if track is None:
        return np.eye(3)
    pose = track.front.world_from_front if track.front else track.box.world_from_object if track.box else None
    return np.asarray(pose.rotation) if pose is not None else np.eye(3)


def _candidates(files: ProjectFiles, name: str) -> tuple[MeshAsset, ...]:
    found = views.latest(files, "generate", name)
    return tuple(found.candidates) if found is not None else ()
