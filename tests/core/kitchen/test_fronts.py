"""Align, synthesize and warp use the same front plane of a mesh: for a shaker door, the frame's."""

import numpy as np
import pytest

from r2c2r_core.align.judge import face_depth
from r2c2r_core.align.shape import prepare_shape
from r2c2r_core.geometry.meshes import unite
from r2c2r_core.geometry.transforms import Rigid3, Similarity3
from r2c2r_core.kitchen.fronts import front_plane, front_y
from r2c2r_core.model.mesh import TexturedMesh
from r2c2r_core.model.track import FrontPanel
from r2c2r_core.synthesize.dimensions import mesh_range
from r2c2r_core.synthesize.surface import sampled
from r2c2r_core.warp.corners import find_front
from tests.core.warp.test_corners import DEPTH, FRONT_Y, HEIGHT, WIDTH, block, shaker, turned

Surface = tuple[np.ndarray, np.ndarray]


def shared_by_stages(vertices: np.ndarray, faces: np.ndarray) -> list[float]:
    """Position along y at which align, synthesize and warp put the front of a mesh in the object frame."""
    rng = np.random.default_rng(0)
    mesh = TexturedMesh(vertices=vertices, faces=faces, uv=np.zeros((len(vertices), 2)), texture=np.zeros((2, 2, 3), np.uint8))
    shape = prepare_shape(mesh, point_count=6000, face_limit=2000, rng=rng)
    panel = FrontPanel(world_from_front=Rigid3(), width_m=WIDTH, height_m=HEIGHT, handle=None, confidence=1.0)
    found = find_front(vertices, faces)
    assert found is not None
    return [
        face_depth(Similarity3(1.0, np.eye(3), np.zeros(3)), shape, panel),
        float(mesh_range(sampled(vertices, faces, 6000, 0), np.eye(3), with_front=True)[0][1]),
        float(found.centre[1]),
    ]


def two_drawers() -> Surface:
    """Two fronts in one plane with a gap between them, each with a bar before it."""
    x, z = WIDTH / 2, HEIGHT / 2
    carcass = block((-x, FRONT_Y + 0.02, -z), (x, DEPTH / 2, z))
    fronts = [block((-x, FRONT_Y, a), (x, FRONT_Y + 0.021, b)) for a, b in ((-z, -0.0015), (0.0015, z))]
    bars = [block((-0.2, FRONT_Y - 0.035, c - 0.006), (0.2, FRONT_Y + 0.01, c + 0.006)) for c in (-0.2, 0.2)]
    return unite([carcass, *fronts, *bars])


@pytest.mark.parametrize(
    "mesh",
    [
        *(pytest.param(shaker(sunk, frame), id=f"shaker {sunk} {frame}") for sunk in (0.006, 0.02) for frame in (0.03, 0.09)),
        pytest.param(two_drawers(), id="two drawers"),
        pytest.param(block((-0.3, FRONT_Y, -0.35), (0.3, DEPTH / 2, 0.35)), id="slab"),
    ],
)
def test_all_stages_use_the_same_front_plane_of_a_mesh(mesh: Surface) -> None:
    np.testing.assert_allclose(shared_by_stages(*mesh), FRONT_Y, atol=1e-3)


def test_the_front_plane_of_a_leaning_mesh_leans_with_it() -> None:
    vertices, faces = shaker(0.012)
    samples = sampled(turned(vertices, 3.0), faces, 12000, 0)
    plane = front_plane(samples.points, samples.normals)
    assert plane is not None
    np.testing.assert_allclose(plane.outward, turned(np.array([[0.0, -1.0, 0.0]]), 3.0)[0], atol=3e-3)
    assert abs(float(plane.outward @ turned(np.array([[0.1, FRONT_Y, 0.1]]), 3.0)[0]) - plane.offset_m) < 1e-3


def test_a_mesh_without_forward_facing_surface_starts_at_its_foremost_points() -> None:
    wedge = np.random.default_rng(0).uniform([-0.1, 0.3, -0.1], [0.1, 0.5, 0.1], (1000, 3))
    sideways = np.tile([1.0, 0.0, 0.0], (1000, 1))
    assert front_plane(wedge, sideways) is None
    assert front_y(wedge, sideways) == pytest.approx(0.3, abs=0.005)
