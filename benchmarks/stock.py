"""Articles to place: scans and models of true size, meshes that a finished run chose, and boxes with and without pictures."""

from collections.abc import Iterator
from pathlib import Path
from typing import Literal, NamedTuple

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from r2c2r_core.align.shape import least_volume_axes
from r2c2r_core.align.standing import hull_directions
from r2c2r_core.generate.upload import read_upload
from r2c2r_core.geometry.transforms import Similarity3, rotation_between
from r2c2r_core.model.mesh import MeshAsset, TexturedMesh
from r2c2r_core.workspace import Workspace

Kind = Literal["scan", "generated", "picture box", "blank box"]


class Article(NamedTuple):
    """A mesh of true size, upright, its front towards -Y, its lowest point at z = 0 and its centre on the z axis."""

    name: str
    kind: Kind
    mesh: TexturedMesh

    @property
    def size_m(self) -> float:
        """The diagonal of its bounding box."""
        return float(np.linalg.norm(np.ptp(self.mesh.vertices, axis=0)))


def assortment(meshes: Path | None, workdirs: list[Path]) -> list[Article]:
    """Articles with the kinds interleaved, so that any number of trials has its share of each."""
    kinds = [
        list(_scans(meshes)) if meshes is not None else [],
        [article for work in workdirs for article in _chosen(work)],
        [_box(k, pictures=True) for k in range(20)],
        [_box(100 + k, pictures=False) for k in range(10)],
    ]
    kinds = [kind for kind in kinds if kind]
    longest = max(len(kind) for kind in kinds)
    return [kind[k % len(kind)] for k in range(longest) for kind in kinds]


def as_candidate(article: Article, world_from_article: Similarity3, rng: np.random.Generator) -> tuple[MeshAsset, Similarity3]:
    """The mesh in its own frame, rotated and scaled at random, and the true world_from_mesh."""
    rotation = Rotation.random(rng=rng).as_matrix()
    scale = float(np.exp(rng.uniform(-1.5, 1.5))) / article.size_m
    mesh_from_article = Similarity3(scale, rotation, rng.uniform(-0.3, 0.3, 3))
    asset = MeshAsset(
        object_name=article.name,
        candidate_id="c0",
        mesh=_moved(article.mesh, mesh_from_article),
        generator="benchmark",
        seed=0,
        watertight=False,
        frames=(),
        metrics={},
        parameters={},
        warnings=(),
    )
    return asset, world_from_article @ mesh_from_article.inverse


def _scans(folder: Path) -> Iterator[Article]:
    """The mug, the refrigerator (its textures do not load: plain grey) and the generated figure, each at its true height."""
    import trimesh

    mug = read_upload(folder / "ycb-025_mug" / "textured.obj", "mug", "c0").mesh
    base = min(hull_directions(mug.vertices, 8), key=lambda side: float(side[2]))  # the scan is tilted by 15 degrees
    mug = _moved(mug, Similarity3(1.0, rotation_between(base, np.array([0.0, 0.0, -1.0])), np.zeros(3)))
    yield _standing("mug", "scan", mug, 0.081, by_height=True)
    loaded = trimesh.load(folder / "aws-Refrigerator_01" / "meshes" / "aws_Refrigerator_01_visual.DAE", force="scene")
    yield _standing("refrigerator model", "scan", _patterned(loaded.to_geometry()), 1.75, by_height=True)
    figure = read_upload(folder / "sam3d-bench" / "0.glb", "figure", "c0").mesh
    turn = least_volume_axes(figure.vertices, hull_directions(figure.vertices, 40))[0].T
    turn = np.roll(turn, 2 - int(np.argmax(np.ptp(figure.vertices @ turn.T, axis=0))), axis=0)  # longest side upright
    yield _standing("figure", "scan", _moved(figure, Similarity3(1.0, turn, np.zeros(3))), 0.9, by_height=True)


def _chosen(workdir: Path) -> Iterator[Article]:
    """The mesh that a finished run chose for each object, at the size it was placed in."""
    work = Workspace(workdir)
    scene = work.load_latest("synthesize", "scene")
    for thing in () if scene is None else scene.objects:
        found, placed = work.load_latest("generate", thing.name), work.load_latest("align", thing.name)
        if found is not None and placed is not None:
            asset = next(c for c in found.candidates if c.candidate_id == placed.candidate_id)
            mesh = _moved(asset.mesh, placed.world_from_mesh)
            back = thing.world_from_object.inverse
            yield _standing(
                f"{workdir.name} {thing.name}",
                "generated",
                _moved(mesh, Similarity3(1.0, back.rotation, back.translation)),
                1.0,
            )


def _standing(name: str, kind: Kind, mesh: TexturedMesh, scale: float, *, by_height: bool = False) -> Article:
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    factor = scale / float(high[2] - low[2]) if by_height else scale
    foot = np.array([(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, low[2]])
    return Article(name, kind, _moved(mesh, Similarity3(factor, np.eye(3), -factor * foot)))


def _patterned(mesh: "object") -> TexturedMesh:
    """A mesh whose textures do not load, in plain grey, so that only its shape can be matched."""
    vertices = np.asarray(mesh.vertices, dtype=np.float64)  # type: ignore[attr-defined]
    faces = np.asarray(mesh.faces, dtype=np.int64)  # type: ignore[attr-defined]
    return TexturedMesh(
        vertices=vertices, faces=faces, uv=np.full((len(vertices), 2), 0.5), texture=np.full((8, 8, 3), 175, np.uint8)
    )


def _box(seed: int, *, pictures: bool) -> Article:
    """A box of 12 to 80 cm per side: a different picture on every side, or blank with a bar handle on its front."""
    rng = np.random.default_rng([seed, 23])
    size = rng.uniform([0.15, 0.12, 0.12], [0.8, 0.6, 0.9]) * float(rng.uniform(0.5, 1.0))
    parts = [_cuboid(size, np.array([0.0, 0.0, size[2] / 2]))]
    if not pictures:
        at = np.array([rng.uniform(-0.35, 0.35) * size[0], -size[1] / 2 - 0.015, rng.uniform(0.6, 0.85) * size[2]])
        parts.append(_cuboid(np.array([0.3 * size[0], 0.03, 0.02]), at))
    vertices = np.concatenate([p[0] for p in parts])
    faces = np.concatenate([p[1] + 24 * k for k, p in enumerate(parts)])
    uv = np.concatenate([p[2] for p in parts])
    texture = _pictures(rng) if pictures else np.full((16, 16, 3), rng.integers(60, 230), np.uint8)
    name = f"{'picture' if pictures else 'blank'} box {seed % 100}"
    return Article(
        name,
        "picture box" if pictures else "blank box",
        TexturedMesh(vertices=vertices, faces=faces, uv=uv, texture=texture),
    )


def _cuboid(size: np.ndarray, centre: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Four corners per side, and uv in a 3 x 2 atlas."""
    vertices, faces, uv = [], [], []
    square = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    for k in range(6):
        axis, sign = k // 2, 1.0 if k % 2 else -1.0
        corner = np.zeros((4, 3))
        corner[:, axis] = sign
        corner[:, [(axis + 1) % 3, (axis + 2) % 3]] = square
        order = [[0, 1, 2], [0, 2, 3]] if sign > 0 else [[0, 2, 1], [0, 3, 2]]
        faces.append(np.array(order) + 4 * k)
        vertices.append(corner * size / 2 + centre)
        uv.append((square * 0.49 + 0.5 + [k % 3, k // 3]) / [3, 2])
    return np.concatenate(vertices), np.concatenate(faces), np.concatenate(uv)


def _pictures(rng: np.random.Generator) -> np.ndarray:
    """An atlas of six tiles with random blotches of several sizes."""
    image = np.zeros((512, 768, 3), np.float32)
    for cells, gain in ((10, 80), (30, 55), (90, 35)):
        small = rng.normal(size=(cells, cells * 3 // 2, 3)).astype(np.float32)
        image += gain * cv2.resize(small, (768, 512), interpolation=cv2.INTER_CUBIC)
    return (0.6 * image + 128).clip(0, 255).astype(np.uint8)


def _moved(mesh: TexturedMesh, pose: Similarity3) -> TexturedMesh:
    return TexturedMesh(vertices=pose.apply(mesh.vertices), faces=mesh.faces, uv=mesh.uv, texture=mesh.texture)
