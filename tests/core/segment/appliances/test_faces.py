"""Depth evidence for a box: patches on its faces, ends of a side, and free space seen by the frames."""

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.capture import SceneSurface
from r2c2r_core.segment.appliances.edges import BACK, FRONT, LEFT, RIGHT, TOP
from r2c2r_core.segment.appliances.faces import Params, patches_on
from r2c2r_core.segment.scene import Scene
from r2c2r_core.segment.surface import parts_of
from r2c2r_core.tuning import tuned
from tests.core.segment.appliances.drawn import TRUE

HERE = Rigid3(np.eye(3), np.zeros(3))
DEEP = TRUE + np.array([0, 0, 0, 0, 0.09, 0, 0])  # extended to the wall
CELL_M = 0.01
CAMERA = Intrinsics(fx=200.0, fy=200.0, cx=128.0, cy=96.0, width=256, height=192)
Span = tuple[float, float]


def sheet(axis: int, at: float, first: Span, second: Span, outward: float) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and faces of a flat piece normal to an axis, facing along it (1) or against it (-1)."""
    rows, columns = (np.arange(low, high + CELL_M / 2, CELL_M) for low, high in (first, second))
    grid = np.stack(np.meshgrid(rows, columns, indexing="ij"), axis=-1).reshape(-1, 2)
    vertices = np.insert(grid, axis, at, axis=1)
    n = len(columns)
    corner = (np.arange(len(rows) - 1)[:, None] * n + np.arange(n - 1)).ravel()
    triangles = np.concatenate(
        [np.stack([corner, corner + n, corner + 1], 1), np.stack([corner + n, corner + n + 1, corner + 1], 1)]
    )
    a, b, c = (vertices[triangles[0, k]] for k in range(3))
    return vertices, triangles if np.cross(b - a, c - a)[axis] * outward > 0 else triangles[:, ::-1]


def scene_of(*sheets: tuple[np.ndarray, np.ndarray]) -> Scene:
    starts = np.cumsum([0, *(len(vertices) for vertices, _ in sheets)])
    vertices = np.concatenate([vertices for vertices, _ in sheets])
    triangles = np.concatenate([triangles + start for (_, triangles), start in zip(sheets, starts, strict=False)])
    surface = SceneSurface(
        vertices_world=vertices, faces=triangles, colours=np.zeros((len(vertices), 3), np.uint8), voxel_m=0.01
    )
    return cast(Scene, SimpleNamespace(parts=parts_of(surface)))


def test_patches_are_assigned_to_the_face_they_lie_on() -> None:
    found = patches_on(
        DEEP,
        scene_of(
            sheet(1, 0.004, (-0.2, 0.2), (-0.14, 0.14), -1),
            sheet(0, 0.26, (0.0, 0.34), (-0.14, 0.14), 1),
            sheet(2, 0.12, (-0.2, 0.2), (0.0, 0.3), 1),
        ),
        HERE,
    )
    for face, axis, at in ((FRONT, 1, 0.004), (RIGHT, 0, 0.26), (TOP, 2, 0.12)):
        on = found.face == face
        assert on.sum() > 10
        assert (found.axis[on] == axis).all()
        np.testing.assert_allclose(found.points[on][:, axis], at, atol=1e-6)


def test_depth_on_the_front_has_an_end_only_where_depth_stops() -> None:
    front = sheet(1, 0.0, (-0.24, 0.33), (-0.14, 0.14), -1)
    found = patches_on(DEEP, scene_of(front), HERE).ends
    assert found.keys() == {LEFT}
    assert found[LEFT] == pytest.approx(-0.24, abs=CELL_M)


def test_depth_on_a_side_ends_at_the_rear_less_what_smeared_depth_may_add() -> None:
    side = sheet(0, 0.26, (0.0, 0.3), (-0.14, 0.14), 1)
    ends = patches_on(DEEP, scene_of(side), HERE).ends
    assert ends == {BACK: pytest.approx(0.3 - tuned(Params).shell_m, abs=CELL_M)}


def test_a_face_with_almost_no_depth_has_no_patches() -> None:
    assert not len(patches_on(DEEP, scene_of(sheet(0, 0.25, (0.1, 0.13), (0.0, 0.03), 1)), HERE).points)
