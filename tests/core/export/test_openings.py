"""Free interior of an 8 cm mug with known cavity, after its colliders."""

import numpy as np
import pytest

from r2c2r_core.export.openings import opening_free
from r2c2r_core.export.reading import UrdfLink, UrdfShape
from r2c2r_core.export.rules.files import BundleFiles, ObjMesh
from r2c2r_core.geometry.transforms import Rigid3

OUTER_M, INNER_M, HEIGHT_M, FLOOR_M, SIDES = 0.04, 0.034, 0.09, 0.01, 16


def ring(radius_m: float, z: float) -> np.ndarray:
    angles = 2 * np.pi * np.arange(SIDES) / SIDES
    return np.column_stack([radius_m * np.cos(angles), radius_m * np.sin(angles), np.full(SIDES, z)])


def mug() -> ObjMesh:
    """Outer wall, rim, inner wall, and both floors, as rings of quads closed by two fans."""
    rings = [ring(OUTER_M, 0.0), ring(OUTER_M, HEIGHT_M), ring(INNER_M, HEIGHT_M), ring(INNER_M, FLOOR_M)]
    vertices = np.concatenate([*rings, [[0.0, 0.0, 0.0], [0.0, 0.0, FLOOR_M]]])
    k, n = np.arange(SIDES), np.roll(np.arange(SIDES), -1)
    faces = [np.column_stack([a, b, c]) for r in range(3) for a, b, c in _quads(r * SIDES + k, r * SIDES + n)]
    faces += [np.column_stack([np.full(SIDES, 4 * SIDES), n, k])]
    faces += [np.column_stack([np.full(SIDES, 4 * SIDES + 1), 3 * SIDES + k, 3 * SIDES + n])]
    return ObjMesh(vertices=vertices, faces=np.concatenate(faces), parts=1, libraries=())


def _quads(k: np.ndarray, n: np.ndarray) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    return [(k, n, n + SIDES), (k, n + SIDES, k + SIDES)]


def staves() -> list[np.ndarray]:
    """The wall as one convex piece per side, and the floor."""
    pieces = [np.concatenate([ring(OUTER_M, 0.0), ring(OUTER_M, FLOOR_M)])]
    for side in range(SIDES):
        pair = [side, (side + 1) % SIDES]
        pieces.append(np.concatenate([ring(r, z)[pair] for r in (INNER_M, OUTER_M) for z in (0.0, HEIGHT_M)]))
    return pieces


def opened(visual: ObjMesh, colliders: list[np.ndarray]) -> float | None:
    meshes = {"visual.obj": visual}
    meshes |= {
        f"{k}.obj": ObjMesh(vertices=p, faces=np.zeros((1, 3), int), parts=1, libraries=()) for k, p in enumerate(colliders)
    }
    shapes = [
        UrdfShape(
            kind="visual" if name == "visual.obj" else "collision",
            name=name,
            link_from_shape=Rigid3(),
            mesh=name,
            scale=np.ones(3),
            box_m=None,
        )
        for name in meshes
    ]
    files = BundleFiles(folder=None, _meshes=meshes)  # type: ignore[arg-type]  # nothing is read from a folder
    return opening_free(UrdfLink(name="mug", inertial=None, shapes=tuple(shapes)), files)


def test_a_mug_of_stave_colliders_keeps_its_opening() -> None:
    assert opened(mug(), staves()) == pytest.approx(1.0, abs=0.02)


def test_a_mug_with_one_convex_hull_has_no_opening() -> None:
    assert opened(mug(), [mug().vertices]) == 0.0


def test_a_mug_half_filled_by_colliders_is_half_open() -> None:
    half = np.concatenate([ring(OUTER_M, 0.0), ring(OUTER_M, (HEIGHT_M + FLOOR_M) / 2)])
    assert opened(mug(), [*staves(), half]) == pytest.approx(0.5, abs=0.04)


def test_a_solid_block_and_an_upside_down_mug_have_no_cavity() -> None:
    block = mug()
    solid = ObjMesh(vertices=block.vertices[: 2 * SIDES], faces=_hull(block.vertices[: 2 * SIDES]), parts=1, libraries=())
    turned = ObjMesh(vertices=block.vertices * [1, -1, -1], faces=block.faces, parts=1, libraries=())
    assert opened(solid, []) is None
    assert opened(turned, []) is None


def _hull(points: np.ndarray) -> np.ndarray:
    from scipy.spatial import ConvexHull

    return ConvexHull(points).simplices
