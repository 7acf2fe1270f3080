"""Side-by-side candidates: pictures from all sides, surface that differs from another candidate, and their source crops."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from app.drawing import TURN_SIZE, TURNS, turntable
from r2c2r_core.model.mesh import MeshAsset, TexturedMesh
from r2c2r_core.workspace import Workspace
from tests.app.conftest import Running
from tests.app.nouns import BOX, FACES, asset, candidates, finish

SIZES = np.array([0.9, 0.4, 0.9])


def pieces(depth: float = 1.0) -> TexturedMesh:
    """A box of small triangles with a blue front, `depth` times as deep behind it."""
    import trimesh

    vertices, faces = trimesh.remesh.subdivide_to_size(BOX, FACES, 0.2)
    column = np.where(vertices[:, 1] < -0.499, 0.1, 0.9)
    vertices[:, 1] = -0.5 + (vertices[:, 1] + 0.5) * depth
    texture = np.full((4, 4, 3), 120, np.uint8)
    texture[:, 0] = (30, 60, 200)
    uv = np.column_stack([column, np.full(len(column), 0.5)])
    return TexturedMesh(vertices=vertices * SIZES, faces=faces, uv=uv, texture=texture)


def with_a_deeper_one(work: Path, name: str = "drawer_1") -> None:
    """The tiny workspace with a second candidate half as deep again, scaled by three, and displaced."""
    finish(work, name)
    second = replace(pieces(1.5), vertices=3.0 * pieces(1.5).vertices + 7.0)
    both: tuple[MeshAsset, ...] = (
        replace(asset(name, "c0"), mesh=pieces()),
        replace(asset(name, "c1"), mesh=second, frames=(7,), assumes="0.6 m deep, as is usual"),
    )
    made = replace(candidates(name), candidates=both)
    Workspace(work).save("generate", name, made, {"key": "k", "seconds": 1.0})


@pytest.fixture
def compared(web: Running) -> tuple[Running, str, int]:
    project = web.sample()
    with_a_deeper_one(web.settings.data_dir / "projects" / project / "work")
    number = next(one["id"] for one in web.get(f"/api/projects/{project}/objects") if one["name"] == "drawer_1")
    return web, project, number


def test_a_deeper_candidate_differs_only_behind_its_front(compared: tuple[Running, str, int]) -> None:
    web, project, number = compared
    found = web.get(f"/api/projects/{project}/objects/{number}/differences?against=c0")
    (other,) = found["candidates"]
    assert other["candidate"] == "c1"
    assert other["most"] == pytest.approx(0.2 / 0.9, abs=0.01)  # half as deep again, as a fraction of the width
    # its back (0.81 of 3.78) and the last third of its other four sides (2.16) differ
    assert other["share"] == pytest.approx((0.81 + 2.16 / 3) / 3.78, abs=0.03)
    assert found["longest_m"] == pytest.approx(0.45)  # at half the size
    assert [(crop["frame"], crop["box"]) for crop in found["crops"]] == [
        (frame, pytest.approx([60 / 160, 40 / 120, 100 / 160, 80 / 120])) for frame in (3, 7)
    ]


def test_the_turntable_strip_highlights_surface_that_differs(compared: tuple[Running, str, int]) -> None:
    web, project, number = compared
    plain, marked = (strip_of(web, f"/media/{project}/candidates/{number}/c1/turns.png?against={name}") for name in ("", "c0"))
    assert plain.shape == (TURN_SIZE, TURN_SIZE * TURNS, 4)
    sides = np.split(marked, TURNS, axis=1)
    orange = [float(((side[..., 2] > side[..., 0] + 60.0) & (side[..., 3] > 0)).sum()) for side in sides]
    assert orange[TURNS // 2] > 2 * orange[0] > 0  # its back is visible instead of its front
    assert not (plain[..., 2] > plain[..., 0] + 60.0).any()
    itself = strip_of(web, f"/media/{project}/candidates/{number}/c0/turns.png?against=c0")
    assert not (itself[..., 2] > itself[..., 0] + 60.0).any()


def test_an_unknown_candidate_is_not_found(compared: tuple[Running, str, int]) -> None:
    web, project, number = compared
    web.get(f"/api/projects/{project}/objects/{number}/differences?against=c9", 404)
    web.get(f"/media/{project}/candidates/{number}/c9/turns.png", 404)
    web.get(f"/media/{project}/candidates/{number}/c0/turns.png?against=c9", 404)


def test_a_turntable_mesh_stays_inside_its_image() -> None:
    image = cv2.imdecode(np.frombuffer(turntable(pieces(), np.eye(3)), np.uint8), cv2.IMREAD_UNCHANGED)
    for side in np.split(image, TURNS, axis=1):
        shown = side[..., 3] > 0
        assert shown.any()
        assert not np.pad(shown[1:-1, 1:-1], 1).sum() < shown.sum()  # no pixel at its border


def strip_of(web: Running, path: str) -> Any:
    answer = web.client.get(path)
    assert answer.status_code == 200, answer.text
    image = cv2.imdecode(np.frombuffer(answer.content, np.uint8), cv2.IMREAD_UNCHANGED)
    assert image is not None
    return image.astype(np.int32)
