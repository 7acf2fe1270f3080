"""Test bench of the alignment: posed RGB-D frames of one object in a plain room, with ground truth.

Each scene is filmed once per process; tests only read it.
"""

from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.masks import pack_mask
from r2c2r_core.geometry.raster import rasterize, sample_texture, subdivide_long_edges
from r2c2r_core.geometry.transforms import Rigid3, Similarity3, rotation_about_z
from r2c2r_core.model.capture import Capture, Depth, Frame, Room, SceneSurface
from r2c2r_core.model.mesh import MeshAsset, TexturedMesh
from r2c2r_core.model.track import FrontPanel, MaskTrack, ThingBox

RGB = Intrinsics(fx=380.0, fy=380.0, cx=241.0, cy=178.5, width=480, height=360)
DEPTH = RGB.resized(160, 120)


@dataclass
class Images:
    """Frames in memory."""

    rgbs: dict[int, np.ndarray] = field(default_factory=dict)
    depths: dict[int, Depth] = field(default_factory=dict)

    def rgb(self, frame_index: int) -> np.ndarray:
        return self.rgbs[frame_index]

    def depth(self, frame_index: int) -> Depth:
        return self.depths[frame_index]


def box_mesh(size: tuple[float, float, float], centre: Any = (0, 0, 0), cells: int = 10) -> TexturedMesh:
    """A box whose six sides share a 3x2 atlas; the texture is plain grey."""
    vertices, faces, uv = [], [], []
    half = np.array(size) / 2
    for k in range(6):
        axis, sign = k // 2, 1.0 if k % 2 else -1.0
        a, b = (axis + 1) % 3, (axis + 2) % 3
        grid = np.linspace(-1, 1, cells + 1)
        u, v = (g.ravel() for g in np.meshgrid(grid, grid, indexing="ij"))
        corner = np.zeros((len(u), 3))
        corner[:, axis], corner[:, a], corner[:, b] = sign, u, v
        base = len(np.concatenate(vertices)) if vertices else 0
        i = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel() + base
        quad = np.stack([i, i + cells + 1, i + cells + 2, i, i + cells + 2, i + 1], axis=1).reshape(-1, 3)
        faces.append(quad if sign > 0 else quad[:, ::-1])
        vertices.append(corner * half + np.array(centre))
        cell = np.array([k % 3, k // 3])
        uv.append((np.stack([u, v], axis=1) * 0.49 + 0.5 + cell) / [3, 2])
    texture = np.full((128, 192, 3), 170, np.uint8)
    return TexturedMesh(vertices=np.concatenate(vertices), faces=np.concatenate(faces), uv=np.concatenate(uv), texture=texture)


def blotches(rng: np.random.Generator, height: int = 256, width: int = 384) -> np.ndarray:
    """A texture with detail at several sizes."""
    image = np.zeros((height, width, 3), np.float32)
    for size, gain in ((8, 80), (24, 60), (64, 40)):
        small = rng.normal(size=(max(height * size // 256, 2), max(width * size // 256, 2), 3)).astype(np.float32)
        image += gain * cv2.resize(small, (width, height), interpolation=cv2.INTER_CUBIC)
    return (image * 0.6 + 128).clip(0, 255).astype(np.uint8)


def join(*meshes: TexturedMesh) -> TexturedMesh:
    """Several meshes as one, with their textures side by side."""
    height = max(m.texture.shape[0] for m in meshes)
    width = sum(m.texture.shape[1] for m in meshes)
    texture = np.zeros((height, width, 3), np.uint8)
    vertices, faces, uv, left, base = [], [], [], 0, 0
    for m in meshes:
        h, w = m.texture.shape[:2]
        texture[height - h :, left : left + w] = m.texture
        uv.append((m.uv * [w, h] + [left, 0]) / [width, height])
        vertices.append(m.vertices)
        faces.append(m.faces + base)
        left, base = left + w, base + len(m.vertices)
    return TexturedMesh(vertices=np.concatenate(vertices), faces=np.concatenate(faces), uv=np.concatenate(uv), texture=texture)


def moved(mesh: TexturedMesh, pose: Similarity3) -> TexturedMesh:
    """The mesh transformed into another frame."""
    return TexturedMesh(vertices=pose.apply(mesh.vertices), faces=mesh.faces, uv=mesh.uv, texture=mesh.texture)


def as_candidate(mesh_world: TexturedMesh, seed: int) -> tuple[MeshAsset, Similarity3]:
    """The mesh as a generator returns it, rotated at random and scaled into a unit cube; and the true world_from_mesh."""
    rotation = Rotation.random(random_state=seed).as_matrix()
    turned = mesh_world.vertices @ rotation.T
    low, high = turned.min(axis=0), turned.max(axis=0)
    scale = 1.0 / float((high - low).max())
    mesh_from_world = Similarity3(scale, rotation, -scale * (low + high) / 2)
    asset = MeshAsset(
        object_name="thing",
        candidate_id="c0",
        mesh=moved(mesh_world, mesh_from_world),
        generator="test",
        seed=seed,
        watertight=False,
        frames=(),
        metrics={},
        parameters={},
        warnings=(),
    )
    return asset, mesh_from_world.inverse


def camera_at(eye: Any, target: Any) -> Rigid3:
    """world_from_camera of an upright camera that looks at a point."""
    forward = np.asarray(target, dtype=np.float64) - np.asarray(eye)
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    return Rigid3(np.column_stack([right, np.cross(forward, right), forward]), np.asarray(eye, dtype=np.float64))


def film(
    thing: TexturedMesh,
    *,
    around: TexturedMesh | None = None,
    eyes: list[tuple[float, float, float]],
    target: Any,
    seed: int = 0,
    noise_m: float = 0.004,
    front: FrontPanel | None = None,
    box: ThingBox | None = None,
    kind: Any = "thing",
    mask_behind: float | None = None,
) -> tuple[Capture, MaskTrack]:
    """Frames of an object among other surfaces, from the given positions; masks are the object's visible pixels.

    With `mask_behind` only surface less than that behind the front panel is masked.
    """
    rng = np.random.default_rng(seed)
    images, frames, masks = Images(), [], {}
    for index, eye in enumerate(eyes):
        pose = camera_at(eye, np.asarray(target) + rng.normal(0, 0.03, 3))
        rgb, full_depth, mask = _shoot(thing, around, RGB, pose)
        if front is not None and mask_behind is not None:
            mask &= _behind(full_depth, pose, front) < mask_behind
        _, coarse, _ = _shoot(thing, around, DEPTH, pose)
        measured = coarse + rng.normal(0, noise_m, coarse.shape) * (coarse > 0)
        spread = cv2.dilate(coarse, np.ones((3, 3))) - cv2.erode(coarse, np.ones((3, 3)))
        valid = (coarse > 0) & (spread < 0.1)
        images.rgbs[index] = rgb
        images.depths[index] = Depth(np.where(valid, measured, 0.0).astype(np.float32), valid)
        frames.append(
            Frame(index=index, timestamp_s=None, rgb_camera=RGB, depth_camera=DEPTH, world_from_camera=pose, sharpness=1.0)
        )
        if mask.sum() > 30:
            masks[index] = pack_mask(mask)
    room = Room(up_source="file", floor_found=True, manhattan_yaw_rad=0.0, walls=())
    surface = SceneSurface(
        vertices_world=np.zeros((0, 3)), faces=np.zeros((0, 3), np.int64), colours=np.zeros((0, 3), np.uint8), voxel_m=0.01
    )
    capture = Capture(
        name="bench",
        sha256="",
        format="test",
        frames=tuple(frames),
        world_from_capture=Rigid3(),
        room=room,
        surface=surface,
        images=images,
        notices=(),
    )
    track = MaskTrack(
        name="thing",
        category="object",
        masks=masks,
        confidence=dict.fromkeys(masks, 1.0),
        front=front,
        box=box,
        kind=kind,
        backend="truth",
        prompt_count=1,
        warnings=(),
    )
    return capture, track


def _behind(depth: np.ndarray, pose: Rigid3, front: FrontPanel) -> np.ndarray:
    """Distance of each pixel's surface behind the panel."""
    v, u = np.indices(depth.shape)
    rays = np.stack([(u + 0.5 - RGB.cx) / RGB.fx, (v + 0.5 - RGB.cy) / RGB.fy, np.ones(depth.shape)], axis=-1)
    points = pose.apply((rays * depth[..., None]).reshape(-1, 3))
    return front.world_from_front.inverse.apply(points)[:, 1].reshape(depth.shape)


def _shoot(
    thing: TexturedMesh, around: TexturedMesh | None, camera: Intrinsics, pose: Rigid3
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Photo, depth and the object's visible pixels."""
    image = np.full((camera.height, camera.width, 3), 90, np.uint8)
    depth = np.zeros((camera.height, camera.width), np.float32)
    mask = np.zeros(depth.shape, dtype=bool)
    for mesh, is_thing in ((thing, True), (around, False)):
        if mesh is None:
            continue
        vertices, faces, uv = subdivide_long_edges(mesh.vertices, mesh.faces, mesh.uv, 0.4)
        raster = rasterize(vertices, faces, np.column_stack([uv, np.ones(len(uv))]), camera, pose.inverse)
        nearer = (raster.depth_m > 0) & ((depth == 0) | (raster.depth_m < depth))
        image[nearer] = sample_texture(mesh.texture, raster.attributes[..., :2])[nearer]
        depth[nearer] = raster.depth_m[nearer]
        mask = np.where(nearer, is_thing, mask)
    return image, depth, mask


def floor() -> TexturedMesh:
    """A patterned floor."""
    return painted(box_mesh((3, 3, 0.1), (0, 0, -0.05)), blotches(np.random.default_rng(5)))


def painted(mesh: TexturedMesh, texture: np.ndarray) -> TexturedMesh:
    """The mesh with another texture."""
    return TexturedMesh(vertices=mesh.vertices, faces=mesh.faces, uv=mesh.uv, texture=texture)


def ring(count: int, radius: float, height: float) -> list[tuple[float, float, float]]:
    """Positions on an arc of 140 degrees around the origin, at varying height."""
    return [
        (radius * np.cos(a), radius * np.sin(a), height * (1 + 0.25 * np.sin(3 * a)))
        for a in np.radians(np.linspace(-100, 40, count))
    ]


@cache
def free_box(*, textured: bool) -> tuple[TexturedMesh, Capture, MaskTrack]:
    """A box of 40 x 30 x 25 cm on the floor."""
    thing = box_mesh((0.4, 0.3, 0.25), (0, 0, 0.125))
    if textured:
        thing = painted(thing, blotches(np.random.default_rng(1)))
    thing = moved(thing, Similarity3(1.0, rotation_about_z(0.5), np.array([0.1, 0.0, 0.0])))
    return thing, *film(thing, around=floor(), eyes=ring(8, 1.3, 0.8), target=(0.1, 0, 0.12))


@cache
def blank_cabinet(*, handle: bool = True) -> tuple[TexturedMesh, Capture, MaskTrack]:
    """A grey cabinet with a grey handle between grey neighbours below a grey worktop: only depth reveals the handle."""
    parts = [box_mesh((0.6, 0.55, 0.7), (0, 0.275, 0.45))]
    if handle:
        parts.append(box_mesh((0.03, 0.04, 0.25), (0.22, -0.02, 0.6), cells=4))
    around = [
        floor(),
        box_mesh((0.5, 0.55, 0.7), (-0.553, 0.275, 0.45)),
        box_mesh((0.5, 0.55, 0.7), (0.553, 0.275, 0.45)),
        box_mesh((2.0, 0.6, 0.04), (0, 0.27, 0.822)),
    ]
    pose = Similarity3(1.0, rotation_about_z(-0.3), np.array([0.2, 0.1, 0.0]))
    middle = pose.apply(np.array([0.0, 0.0, 0.45]))
    front = FrontPanel(world_from_front=Rigid3(pose.rotation, middle), width_m=0.6, height_m=0.7, handle=None, confidence=0.9)
    eyes = [tuple(pose.apply(np.array([x, -1.3, 1.1]))) for x in np.linspace(-0.9, 0.9, 8)]
    thing = moved(join(*parts), pose)
    return thing, *film(
        thing,
        around=moved(join(*around), pose),
        eyes=eyes,
        target=middle,
        front=front,
        kind="front",
        mask_behind=0.012,
    )


@cache
def bottle(*, label: bool = False) -> tuple[TexturedMesh, Capture, MaskTrack]:
    """A bottle, 25 cm high: plain, or with blotches all around, the only cue for its yaw."""
    radius, height = np.array([0.001, 0.035, 0.035, 0.014, 0.014, 0.001]), np.array([0, 0, 0.17, 0.2, 0.25, 0.25])
    angle = np.linspace(0, 2 * np.pi, 32, endpoint=False)
    vertices = np.stack(
        [np.outer(radius, np.cos(angle)), np.outer(radius, np.sin(angle)), np.tile(height[:, None], (1, 32))], axis=-1
    ).reshape(-1, 3)
    i, j = (k.ravel() for k in np.meshgrid(np.arange(5) * 32, np.arange(32), indexing="ij"))
    a, b, c, d = i + j, i + (j + 1) % 32, i + 32 + j, i + 32 + (j + 1) % 32
    faces = np.concatenate([np.stack([a, b, d], axis=1), np.stack([a, d, c], axis=1)])
    around = np.tile(np.arange(32) / 31, 6)
    uv = np.column_stack([around, np.repeat(height / 0.25, 32)]) if label else np.full((len(vertices), 2), 0.5)
    texture = blotches(np.random.default_rng(3)) if label else np.full((8, 8, 3), 120, np.uint8)
    thing = TexturedMesh(vertices=vertices, faces=faces, uv=uv, texture=texture)
    return thing, *film(thing, around=floor(), eyes=ring(8, 0.8, 0.5), target=(0, 0, 0.12))


@cache
def chair() -> tuple[TexturedMesh, Capture, MaskTrack]:
    """A chair of a seat, four legs and a back."""
    legs = [box_mesh((0.04, 0.04, 0.44), (x, y, 0.22), cells=3) for x in (-0.19, 0.19) for y in (-0.19, 0.19)]
    parts = [box_mesh((0.42, 0.42, 0.03), (0, 0, 0.45)), *legs, box_mesh((0.42, 0.03, 0.45), (0, 0.2, 0.69))]
    thing = moved(join(*parts), Similarity3(1.0, rotation_about_z(0.8), np.zeros(3)))
    return thing, *film(thing, around=floor(), eyes=ring(8, 1.8, 1.3), target=(0, 0, 0.4))


def film_mug(folder: Path) -> tuple[TexturedMesh, Capture, MaskTrack]:
    """The YCB mug (in centimetres) on the floor."""
    import trimesh

    loaded = trimesh.load(folder / "textured.obj", force="mesh", process=False)
    vertices = np.asarray(loaded.vertices) * 0.01
    middle = (vertices.min(axis=0) + vertices.max(axis=0)) / 2
    thing = TexturedMesh(
        vertices=vertices - [middle[0], middle[1], vertices[:, 2].min()],
        faces=np.asarray(loaded.faces),
        uv=np.asarray(loaded.visual.uv),
        texture=np.asarray(loaded.visual.material.image.convert("RGB")),
    )
    return thing, *film(thing, around=floor(), eyes=ring(8, 0.55, 0.35), target=(0, 0, 0.04))


class Bench:
    """The functions above, as a fixture for tests."""

    box_mesh = staticmethod(box_mesh)
    blotches = staticmethod(blotches)
    painted = staticmethod(painted)
    join = staticmethod(join)
    moved = staticmethod(moved)
    as_candidate = staticmethod(as_candidate)
    film = staticmethod(film)
    free_box = staticmethod(free_box)
    blank_cabinet = staticmethod(blank_cabinet)
    bottle = staticmethod(bottle)
    chair = staticmethod(chair)
    film_mug = staticmethod(film_mug)


@pytest.fixture(scope="session")
def bench() -> type[Bench]:
    return Bench
