"""Closed bodies have a positive signed volume: their faces point outwards, otherwise the renderer would drop them."""

import numpy as np
import pytest

from r2c2r_core.synthetic.fronts import handle_patches
from r2c2r_core.synthetic.kitchen import Handle, Paint
from r2c2r_core.synthetic.mesh import join_patches
from r2c2r_core.synthetic.patches import LONGEST_EDGE_M, Patch, box, lathe, tube, turned

PAINT = Paint(kind="plain", colour=(0.5, 0.5, 0.5))


def enclosed_volume(patches: list[Patch]) -> float:
    mesh = join_patches(patches)
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


def test_a_box_mesh_has_the_correct_volume_and_limited_edge_length() -> None:
    patches = box((0.2, -0.6, 0.1), (1.5, -0.1, 2.0), PAINT)
    assert enclosed_volume(patches) == pytest.approx(1.3 * 0.5 * 1.9)
    for patch in patches:
        for axis in (0, 1):
            assert np.linalg.norm(np.diff(patch.grid, axis=axis), axis=-1).max() <= LONGEST_EDGE_M


def test_a_rotated_box_keeps_its_volume() -> None:
    assert enclosed_volume(turned(box((0, 0, 0), (0.5, 0.4, 0.3), PAINT), 0.3, (0.2, 0.1))) == pytest.approx(0.06)


def test_a_lathe_mesh_has_the_volume_of_its_cylinder() -> None:
    body = lathe((0.3, -0.2, 0.9), [(0.0, 0.3), (0.05, 0.3), (0.05, 0.0), (0.0, 0.0)], PAINT, sides=64)
    assert enclosed_volume([body]) == pytest.approx(np.pi * 0.05**2 * 0.3, rel=0.01)  # a 64-gon instead of a circle


@pytest.mark.parametrize("bend", [0.0, 0.05, -0.05])
def test_a_tube_mesh_has_the_volume_of_length_times_section(bend: float) -> None:
    angle = np.linspace(0, np.pi, 21)
    points = np.column_stack([0.2 * np.cos(angle), np.zeros(21), bend * np.sin(angle)])
    length = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
    volume = enclosed_volume([tube(points, 0.006, PAINT, sides=48)])
    assert volume == pytest.approx(np.pi * 0.006**2 * length, rel=0.05)


@pytest.mark.parametrize("kind", ["bar", "flat", "bow", "knob"])
@pytest.mark.parametrize("vertical", [True, False])
def test_handle_meshes_have_the_stated_protrusion_and_length(kind: str, vertical: bool) -> None:
    length = 0.03 if kind == "knob" else 0.19
    handle = Handle(kind=kind, length_m=length, thickness_m=0.012, reach_m=0.035, vertical=vertical, x=0.3, z=0.5)  # type: ignore[arg-type]
    patches = handle_patches(handle, np.array([1.0, -0.6, 0.1]), PAINT, 7)
    points = join_patches(patches).vertices
    assert points[:, 1].min() == pytest.approx(-0.6 - 0.035, abs=0.003)
    assert points[:, 1].max() < -0.59
    size = np.ptp(points, axis=0)[2 if vertical else 0]
    assert size == pytest.approx(length if kind != "knob" else 0.014, abs=0.014)
    assert (points[:, 0] + points[:, 2]).mean() == pytest.approx(1.3 + 0.6, abs=0.01)
    assert all(patch.is_handle and patch.object_id == 7 for patch in patches)
