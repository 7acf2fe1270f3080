"""A candidate's mesh for a person's eyes: upright and facing the camera where its placement is known."""

from collections.abc import Callable
from itertools import permutations, product
from typing import Any

import cv2
import numpy as np
from scipy.spatial import cKDTree  # here, not where it is used: two first requests at once would meet it half imported

from app.files import ProjectFiles
from app.services import views
from r2c2r_core.arrays import Mask, Matrix3, Points
from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.raster import rasterize
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.mesh import MeshAsset, TexturedMesh

SIZE = 320
TURNS = 24  # pictures of a turntable, side by side from left to right
TURN_SIZE = 240
SAMPLES = 1500
_MARK, _FADED = np.array([235.0, 95.0, 20.0]), 0.2  # RGB of what differs, and how much of its own colour shows through
_AZIMUTH, _ELEVATION = np.deg2rad(-30.0), np.deg2rad(20.0)

_BOX_TURNS = [  # the 24 ways to lay a box onto a box
    np.eye(3)[list(order)] * np.array(signs)[:, None]
    for order in permutations(range(3))
    for signs in product((1.0, -1.0), repeat=3)
    if np.linalg.det(np.eye(3)[list(order)] * np.array(signs)[:, None]) > 0
]


def upright(files: ProjectFiles, name: str, candidate: str) -> Matrix3:
    """Rotation from the mesh's arbitrary frame to one with +Z up and the front at -Y; identity while nothing is known.

    Only the chosen candidate was aligned with the scan; the others are turned until they look like it.
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
    """The rotation that makes `mesh` look most like `model`, among those that lay its box onto the model's box."""
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

    vertices = _unit(mesh.vertices @ rotation.T)
    gltf_from_object = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
    material = trimesh.visual.material.PBRMaterial(
        baseColorTexture=Image.fromarray(mesh.texture), metallicFactor=0.0, roughnessFactor=0.9
    )
    visual = trimesh.visual.TextureVisuals(uv=mesh.uv, material=material)
    shown = trimesh.Trimesh(vertices @ gltf_from_object.T, mesh.faces, visual=visual, process=False)
    _ = shown.vertex_normals  # without them viewers shade every face flat
    exported: Any = shown.export(file_type="glb")
    return bytes(exported)


def mesh_picture(mesh: TexturedMesh, rotation: Matrix3) -> bytes:
    """The mesh as a PNG with a transparent ground, every candidate from the same side and distance."""
    return cv2.imencode(".png", _drawn(mesh, mesh.vertices @ rotation.T, 0.0, SIZE))[1].tobytes()


def turntable(mesh: TexturedMesh, rotation: Matrix3, marked: Callable[[Points], Mask] | None = None) -> bytes:
    """The mesh from `TURNS` sides, turned about its upright axis; points (n, 3) that are `marked` are in another colour."""
    upright_points = mesh.vertices @ rotation.T
    sides = [_drawn(mesh, upright_points, 2 * np.pi * k / TURNS, TURN_SIZE, marked) for k in range(TURNS)]
    return cv2.imencode(".png", np.hstack(sides))[1].tobytes()


def _drawn(
    mesh: TexturedMesh, points: Points, turn_rad: float, size: int, marked: Callable[[Points], Mask] | None = None
) -> np.ndarray:
    """BGRA (size, size, 4) of an upright mesh, turned."""
    around = Rigid3(cv2.Rodrigues(np.array([0.0, 0.0, turn_rad]))[0])
    vertices = around.apply(_unit(points))
    camera = Intrinsics(fx=1.9 * size, fy=1.9 * size, cx=size / 2, cy=size / 2, width=size, height=size)
    attributes = np.column_stack([mesh.uv, np.ones(len(vertices))])
    drawn = rasterize(vertices, mesh.faces, attributes, camera, _camera_from_world())
    hit = drawn.depth_m > 0
    colours = _textured(mesh.texture, drawn.attributes)
    if marked is not None:
        places = rasterize(vertices, mesh.faces, np.asarray(points), camera, _camera_from_world()).attributes[hit]
        colours[hit] = np.where(marked(places)[:, None], _FADED * colours[hit] + (1 - _FADED) * _MARK, colours[hit])
    shaded = np.clip(colours * _shading(drawn.depth_m, camera)[..., None], 0, 255).astype(np.uint8)
    return np.dstack([shaded[..., ::-1], hit.astype(np.uint8) * 255])


def _sampled(mesh: TexturedMesh) -> tuple[np.ndarray, np.ndarray, Matrix3]:
    """Points on the surface (n, 3) in the unit ball, their colours 0..1, and the axes of the smallest box, longest last."""
    import trimesh

    centred = _unit(mesh.vertices)
    shape = trimesh.Trimesh(centred, mesh.faces, process=False)
    points, faces = trimesh.sample.sample_surface(shape, SAMPLES, seed=0)
    corners = trimesh.triangles.points_to_barycentric(shape.triangles[faces], points)
    uv = np.einsum("nk,nkd->nd", corners, mesh.uv[mesh.faces[faces]])
    to_box, sizes = trimesh.bounds.oriented_bounds(shape, ordered=False)
    order = np.argsort(sizes)
    axes = to_box[:3, :3].T[:, order]
    axes[:, 0] *= np.sign(np.linalg.det(axes))
    return np.asarray(points), _textured(mesh.texture, uv) / 255.0, axes


def _object_axes(files: ProjectFiles, name: str) -> Matrix3:
    """world_from_object rotation as the masks say it; identity where they do not."""
    track = views.latest(files, "segment", name)
    if track is None:
        return np.eye(3)
    pose = track.front.world_from_front if track.front else track.box.world_from_object if track.box else None
    return np.asarray(pose.rotation) if pose is not None else np.eye(3)


def _candidates(files: ProjectFiles, name: str) -> tuple[MeshAsset, ...]:
    found = views.latest(files, "generate", name)
    return tuple(found.candidates) if found is not None else ()


def _unit(vertices: np.ndarray) -> np.ndarray:
    """Centred, with a bounding sphere of radius 1."""
    centre = (vertices.min(axis=0) + vertices.max(axis=0)) / 2
    moved = vertices - centre
    return np.asarray(moved / max(float(np.linalg.norm(moved, axis=1).max()), 1e-9))


def _camera_from_world() -> Rigid3:
    """A camera before the front (-Y), a little to the side and above, looking at the origin."""
    away = np.array([np.sin(_AZIMUTH) * np.cos(_ELEVATION), -np.cos(_AZIMUTH) * np.cos(_ELEVATION), np.sin(_ELEVATION)])
    forward = -away
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    down = np.cross(forward, right)
    rotation = np.stack([right, down, forward])
    return Rigid3(rotation, -rotation @ (away * 4.2))


def _textured(texture: np.ndarray, uv: np.ndarray) -> np.ndarray:
    height, width = texture.shape[:2]
    u = np.clip((uv[..., 0] * width).astype(int), 0, width - 1)
    v = np.clip(((1.0 - uv[..., 1]) * height).astype(int), 0, height - 1)
    return texture[v, u].astype(np.float32)


def _shading(depth: np.ndarray, camera: Intrinsics) -> np.ndarray:
    """Light from the camera, so that shape shows on plain textures."""
    dy, dx = np.gradient(np.where(depth > 0, depth, np.nan))
    scale = camera.fx / np.where(depth > 0, depth, 1.0)
    cosine = 1.0 / np.sqrt(1.0 + (dx * scale) ** 2 + (dy * scale) ** 2)
    return np.asarray(0.55 + 0.45 * np.nan_to_num(cosine, nan=0.6))
